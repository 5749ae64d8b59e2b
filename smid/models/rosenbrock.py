"""A step of a linearly implicit scheme for stiff rates, as lines.

With J the derivative of the rates f by the states x at the start of a step of length h, the stages are

    (1 / (h gamma) - J) k_i = f(x + sum_j a_ij k_j) + sum_j c_ij k_j / h,        x + sum_i m_i k_i

The coefficients are those of ROS4: order 4, and a fast decay is damped at any h (L-stable). J is part of the formula,
so nothing is iterated. J is written symbolically, and the equations are solved by elimination without pivots, a line
for each entry. J leaves out jumps of f (sign, floor), so a step across a jump has order 1.

A single state whose rate is ``s x + g`` needs no stages: with z = h s the step is ``R(z) x + h Q(z) g``, where R is the
fraction with denominator (1 - gamma z)^4 that agrees with exp(z) to z^4, and ``Q(z) = (R(z) - 1) / z``.

Reference: Hairer and Wanner, Solving Ordinary Differential Equations II (1996), section IV.7, table 7.2.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

import sympy

from smid.models.parts import Line
from smid.models.symbols import signal, swapped, t

__all__ = ["affine_step", "rosenbrock_step"]

ORDER = 4
GAMMA = sympy.Rational("0.57282")
_A = (
    (),
    ("2",),
    ("1.867943637803922", "0.2344449711399156"),
    ("1.867943637803922", "0.2344449711399156"),
)
_C = (
    (),
    ("-7.137615036412310",),
    ("2.580708087951457", "0.6515950076447975"),
    ("-2.137148994382534", "-0.3214669691237626", "-0.6949742501781779"),
)
_M = ("2.255570073418735", "0.2870493262186792", "0.4353179431840180", "1.093502252409163")
A, C = (tuple(tuple(map(sympy.Rational, row)) for row in table) for table in (_A, _C))
M = tuple(map(sympy.Rational, _M))


def affine_step(z: sympy.Expr) -> tuple[sympy.Expr, sympy.Expr]:
    """Return R and Q at z.

    Examples
    --------
    >>> growth, drive = affine_step(sympy.Rational(-1, 10))
    >>> round(float(growth), 6), round(float(drive), 6)
    (0.904837, 0.951628)
    """
    unit = sympy.Symbol("z")
    below = (1 - GAMMA * unit) ** ORDER
    series = sum((unit**k / sympy.factorial(k) for k in range(ORDER + 1)), sympy.Integer(0))
    bottom = sympy.Poly(below, unit)
    top = sympy.Poly(sympy.Poly(below * series, unit).all_coeffs()[-ORDER - 1 :], unit)
    rest = sympy.Poly((top - bottom).all_coeffs()[:-1], unit)
    at_z = below.xreplace({unit: z})
    return top.as_expr().xreplace({unit: z}) / at_z, rest.as_expr().xreplace({unit: z}) / at_z


def rosenbrock_step(
    start: Mapping[str, sympy.Expr],
    rates: Mapping[str, sympy.Expr],
    step: sympy.Expr,
    targets: Mapping[str, sympy.Expr],
    names: Iterator[str],
) -> Iterator[Line]:
    """Yield the lines of one step.

    Parameters
    ----------
    start, targets
        Samples of the states before and after the step.
    rates
        In ``x[t]``, the state at the stage.
    step
        In seconds.
    names
        Free names for helper lines.

    Examples
    --------
    >>> x = signal("x")
    >>> lines = rosenbrock_step({"x": x[t - 1]}, {"x": -x[t] ** 3}, sympy.Integer(1), {"x": x[t]}, iter("abcdefghi"))
    >>> [line.signal for line in lines]
    ['a', 'b', 'c', 'd', 'e', 'f', 'g', 'h', 'i', 'x']
    """
    states = list(start)

    def helper(expression: sympy.Expr) -> tuple[Line, sympy.Expr]:
        name = signal(next(names))[t]
        return Line(name, expression), name

    def at(expression: sympy.Expr, stages: Sequence[Mapping[str, sympy.Expr]], row: Sequence[sympy.Expr]) -> sympy.Expr:
        moved = {x: sum((a * k[x] for a, k in zip(row, stages, strict=True)), start[x]) for x in states}
        return swapped(expression, {signal(x)[t]: moved[x] for x in states})

    # Eliminate: afterwards the rows of the matrix are triangular, and the factors below it are kept apart.
    diagonal, zero = 1 / (step * GAMMA), sympy.Integer(0)
    matrix: dict[tuple[str, str], sympy.Expr] = {}
    for r in states:
        for s in states:
            slope = at(_slope(rates[r], signal(s)[t]), (), ())
            entry = (diagonal if r == s else zero) - slope
            if slope.atoms(sympy.Indexed):
                line, entry = helper(entry)
                yield line
            matrix[r, s] = entry
    factors: dict[tuple[str, str], sympy.Expr] = {}
    for k, pivot in enumerate(states):
        for r in states[k + 1 :]:
            if matrix[r, pivot] == 0:
                continue
            line, factors[r, pivot] = helper(matrix[r, pivot] / matrix[pivot, pivot])
            yield line
            for s in states[k + 1 :]:
                if matrix[pivot, s] != 0:
                    line, matrix[r, s] = helper(matrix[r, s] - factors[r, pivot] * matrix[pivot, s])
                    yield line
    # Solve for each stage, forwards and backwards.
    stages: list[dict[str, sympy.Expr]] = []
    for row, pulls in zip(A, C, strict=True):
        right: dict[str, sympy.Expr] = {}
        for k, r in enumerate(states):
            pulled = sum((c * done[r] for c, done in zip(pulls, stages, strict=True)), zero) / step
            known = sum((factors[r, s] * right[s] for s in states[:k] if (r, s) in factors), zero)
            line, right[r] = helper(at(rates[r], stages[: len(row)], row) + pulled - known)
            yield line
        stage: dict[str, sympy.Expr] = {}
        for k, r in reversed(list(enumerate(states))):
            later = sum((matrix[r, s] * stage[s] for s in states[k + 1 :] if matrix[r, s] != 0), zero)
            line, stage[r] = helper((right[r] - later) / matrix[r, r])
            yield line
        stages.append(stage)
    for x in states:
        yield Line(targets[x], start[x] + sum((m * k[x] for m, k in zip(M, stages, strict=True)), zero))


def _slope(rate: sympy.Expr, state: sympy.Expr) -> sympy.Expr:
    """Return the derivative of a rate by a state, zero at the jumps of sign and floor."""
    jumps = {node: sympy.Dummy(real=True) for node in rate.atoms(sympy.sign, sympy.floor, sympy.ceiling)}
    slope = sympy.diff(rate.xreplace(jumps), state)
    # The derivatives of Max and Min.
    slope = slope.replace(sympy.Heaviside, lambda place, *_: (1 + sympy.sign(place)) / 2)
    return slope.xreplace({dummy: node for node, dummy in jumps.items()})
