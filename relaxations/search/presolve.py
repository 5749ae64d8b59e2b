"""Bounds of variables that single rows imply, before any relaxation: each is a step that a checker can follow.

- *Linear in x.* Where x occurs in a row in one linear term only, ``c x + r >= 0`` gives ``c x >= -max r`` over the box.
- *Ellipsoids.* Where the terms of a row in some variables x are ``-x' A x + b' x`` with A positive definite, the row is

      g(x, y) = -(x - m)' A (x - m) + m' A m + r(y),       m = A^-1 b / 2,

  and ``g >= 0`` bounds each x_k, whether it had a bound or not: for every lambda > 0

      s x_k - lambda g = lambda (x - d)' A (x - d) - lambda d' A d - lambda r,       d = m - s A^-1 e_k / (2 lambda),

  so ``s x_k >= -lambda (d' A d + max r)``. The best lambda is ``sqrt((A^-1)_kk / (m' A m + max r)) / 2``.

An equality is a row on both sides: ``x^2 = x`` is an ellipsoid, the interval [0, 1].

The square must be a sum of squares exactly, because a variable without bounds leaves no room for a remainder. With F a
factor of the matrix less a small part of its diagonal, in floats, the difference ``R`` from ``F F'`` is known exactly,
and its diagonal dominates: ``sum_{i<j} |R_ij| (z_i +- z_j)^2 + sum_i (R_ii - sum_j |R_ij|) z_i^2``. All numbers are
floats or sums of their products, so that no division rounds.

References
----------
P. Belotti, S. Cafieri, J. Lee and L. Liberti, "Feasibility-based bounds tightening via fixed points", COCOA 2010,
LNCS 6508, 65-76.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from fractions import Fraction

import numpy as np
from numpy.typing import NDArray

from relaxations.algebra.arrays import Array, Index
from relaxations.algebra.ball_arithmetic import Balls, outwards
from relaxations.algebra.polynomial import Polynomials, pad
from relaxations.deadline import check_time
from relaxations.problem.problem import PolynomialProblem
from relaxations.proof.proof_steps import Consequence, Recorder, Square
from relaxations.reductions.scaling import Scaling

ROUNDS = 8
WORTH = 0.1  # a bound that takes less of a width off is not worth a step
MOST_ROWS = 1000  # a problem with more is left to the methods for long records
EPSILON = 1e-11  # share of the diagonal that stays outside of the factor


def presolve(problem: PolynomialProblem, record: Recorder | None = None) -> PolynomialProblem | None:
    """Return the problem on the box that its rows imply; None if this box is empty.

    Parameters
    ----------
    record
        Called with each step of the proof.

    Examples
    --------
    >>> from relaxations.formats.expressions import stated_problem, variables
    >>> x, y = variables("x y")
    >>> rows = [x**2 - 2 * x + y**2 <= 0, x + y == 2]  # a disc around (1, 0), and a line
    >>> problem, _ = stated_problem(x, rows, {"x": (None, None), "y": (None, None)})
    >>> smaller = presolve(problem)
    >>> (smaller.lower + 0.5).round(6), smaller.upper.round(6)
    (array([1.5, 0.5]), array([2., 1.]))
    """
    if problem.equalities.n_rows + problem.inequalities.n_rows > MOST_ROWS:
        return problem
    sides = _sides(problem)
    for _ in range(ROUNDS):
        check_time()
        lower, upper = problem.lower, problem.upper
        for found in (*_from_ellipsoids(problem, sides), *_from_linear_terms(problem)):
            narrowed = _narrowed(problem, found)
            if narrowed is None:
                continue
            if record:
                record(found)
            if (narrowed[0] > narrowed[1]).any():
                return None
            problem = problem.with_box(*narrowed)
        if problem.lower is lower and problem.upper is upper:
            break
    return problem


def beyond(stated: PolynomialProblem, presolved: PolynomialProblem) -> PolynomialProblem:
    """Return the stated problem with finite bounds, wider than those derived where it has none.

    Feasible points are searched and verified on this box. A derived bound is rounded outwards, so that no feasible
    point lies on it exactly.
    """
    width = np.maximum(presolved.upper - presolved.lower, np.finfo(float).tiny)
    return stated.with_box(
        np.where(np.isfinite(stated.lower), stated.lower, presolved.lower - width),
        np.where(np.isfinite(stated.upper), stated.upper, presolved.upper + width),
    )


def _narrowed(problem: PolynomialProblem, found: Consequence) -> tuple[Array, Array] | None:
    """Return the box that a bound of one variable leaves; None where the bound is not worth a step."""
    (k,), (slope,) = found.objective.factors[:, -1].tolist(), found.objective.coefficients.mid.tolist()
    end, below = Fraction(found.bound) / Fraction(slope), slope > 0
    ends = (problem.upper if not below else problem.lower).copy()
    ends[k], old = outwards(end, -1 if below else 1), ends[k]
    if not np.isfinite(ends[k]) or not _worth(problem, k, ends[k] - old if below else old - ends[k]):
        return None
    return (ends, problem.upper) if below else (problem.lower, ends)


def _worth(problem: PolynomialProblem, k: int, gain: float) -> bool:
    width = problem.upper[k] - problem.lower[k]
    return bool(gain > 0 if np.isinf(gain) else gain > WORTH * width if np.isfinite(width) else gain > 0)


# ---------------------------------------------------------------- linear terms


def _from_linear_terms(problem: PolynomialProblem) -> Iterator[Consequence]:
    """Yield the best bound of each end of a variable, by rows in which it occurs in one linear term only."""
    scaling = Scaling.of_box(problem, np.ones(problem.n_variables))
    best: dict[tuple[int, bool], tuple[float, Polynomials, Index, int, int]] = {}
    for family, signs in ((problem.equalities, (1, -1)), (problem.inequalities, (1,))):
        if family.degree < 1:
            continue
        alone = _linear_terms(family, problem.n_variables)
        scaled = scaling.polynomials(family)
        for sign in signs:
            most = _most(problem, family, scaled, alone, sign)
            for term in alone.tolist():
                row, k, slope = int(family.rows[term]), int(family.factors[term, -1]), family.coefficients.mid[term]
                own = _end(problem, k, sign * slope)
                others = most.sums[row] - (own if np.isfinite(own) else 0.0)
                if not slope or most.unbounded[row] > np.isinf(own):
                    continue
                end, below = -others / (sign * slope), sign * slope > 0
                gain = end - problem.lower[k] if below else problem.upper[k] - end
                known = best[k, below][0] if (k, below) in best else -np.inf
                if _worth(problem, k, gain) and (end if below else -end) > known:
                    best[k, below] = (end if below else -end), family, alone, term, sign
    for _, family, alone, term, sign in best.values():
        found = _linear(problem, scaling, family, alone, term, sign)
        if found is not None:
            yield found


@dataclass(frozen=True)
class _Most:
    """Estimates of the largest value of each row, and how many of its terms have none; each of shape (n_rows,)."""

    sums: Array
    unbounded: Index


def _most(problem: PolynomialProblem, family: Polynomials, scaled: Polynomials, alone: Index, sign: int) -> _Most:
    """Return the largest values of rows, or minus the least for sign -1, in floats."""
    n = problem.n_variables
    loose = np.append(~np.isfinite(problem.upper - problem.lower), False)
    # Terms of variables with a box, about its middle; then linear terms of variables with one end.
    free = loose[scaled.factors].any(axis=1)
    value = np.where(scaled.term_degrees == 0, sign * scaled.coefficients.mid, np.abs(scaled.coefficients.mid))
    sums = np.bincount(scaled.rows, np.where(free, 0.0, value), family.n_rows)
    last = pad(scaled.factors, max(1, scaled.factors.shape[1]))[:, -1]  # no column is left where all are fixed
    open_ = free & ~np.isin(scaled.rows * n + last, (family.rows * n + family.factors[:, -1])[alone])
    unbounded = np.bincount(scaled.rows[open_], minlength=family.n_rows)
    for term in alone[loose[family.factors[alone, -1]]].tolist():
        row, end = family.rows[term], _end(problem, int(family.factors[term, -1]), sign * family.coefficients.mid[term])
        if np.isfinite(end):
            sums[row] += end
        else:
            unbounded[row] += 1
    return _Most(np.asarray(sums, dtype=np.float64), unbounded)


def _end(problem: PolynomialProblem, k: int, slope: float) -> float:
    """Return the largest value of ``slope x_k`` on the box."""
    return float(slope * (problem.upper[k] if slope > 0 else problem.lower[k])) if slope else 0.0


def _linear_terms(family: Polynomials, n_variables: int) -> Index:
    """Return the linear terms whose variable occurs in no other term of its row."""
    real = family.factors >= 0
    key = family.rows[:, None] * n_variables + family.factors
    counts = np.bincount(key[real], minlength=family.n_rows * n_variables)
    linear = np.flatnonzero(family.term_degrees == 1)
    return np.asarray(linear[counts[key[linear, -1]] == 1], dtype=np.int64)


def _linear(
    problem: PolynomialProblem, scaling: Scaling, family: Polynomials, alone: Index, term: int, sign: int
) -> Consequence | None:
    """Return the bound of one variable by one row, rounding accounted for."""
    row, k = int(family.rows[term]), int(family.factors[term, -1])
    loose = ~np.isfinite(problem.upper - problem.lower)
    others = (family.rows == row) & (np.arange(len(family.rows)) != term)
    # A variable with one end: the factor x - lower, or upper - x, cancels its linear term.
    centre, scale, most = scaling.centre.copy(), np.where(loose, 1.0, scaling.scale), Fraction(0)
    ends: list[tuple[int, int, Fraction]] = []
    for other in alone[others[alone]].tolist():
        v = int(family.factors[other, -1])
        if loose[v]:
            slope, side = sign * family.coefficients.mid[other], 1 if sign * family.coefficients.mid[other] < 0 else -1
            centre[v] = _beyond(problem.lower[v] if side > 0 else problem.upper[v], side)
            most += Fraction(slope) * (Fraction(centre[v]) - side)
            ends.append((v, side, abs(Fraction(slope))))
            others[other] = False
            if family.coefficients.rad[other]:
                return None
    rest = Polynomials(1, np.zeros(others.sum(), dtype=np.int64), family.factors[others], family.coefficients[others])
    # The radius of the variable's own coefficient.
    ball = family.coefficients[np.array([term])]
    if ball.rad[0] and loose[k]:
        return None
    wide = Polynomials(1, np.zeros(1, dtype=np.int64), np.array([[k]]), Balls(np.zeros(1), ball.rad))
    most += _greatest(Polynomials.join([rest, wide]), sign, scaling)
    objective = problem.variable(k, sign * float(ball.mid[0]))
    equality = family is problem.equalities
    return Consequence(
        problem, objective, outwards(-most, -1), centre, scale, equality, row, Fraction(sign), tuple(ends), ()
    )


def _beyond(end: float, side: int) -> float:
    """Return a centre whose cube of half width 1 begins at an end, or outside of it."""
    centre = end + side
    outside = Fraction(centre) * side - 1 <= Fraction(end) * side
    return centre if outside else float(np.nextafter(centre, -side * np.inf))


def _greatest(polynomials: Polynomials, sign: int, scaling: Scaling) -> Fraction:
    """Return an upper bound of ``sign`` times the sum of polynomials on the box of a scaling."""
    scaled = scaling.polynomials(polynomials)
    constant = scaled.term_degrees == 0
    own = scaled.coefficients
    middle = sum(map(Fraction, own.mid[constant].tolist()), Fraction(0)) * sign
    radius = sum(map(Fraction, own.rad[constant].tolist()), Fraction(0))
    return middle + radius + sum(map(Fraction, own.magnitude()[~constant].tolist()), Fraction(0))


# ---------------------------------------------------------------- ellipsoids


@dataclass(frozen=True)
class _Ellipsoid:
    """One side of a row: ``-x' A x + b' x + rest >= 0`` with A positive definite.

    ``sign`` is that of the row. ``variables`` are those of x.
    """

    equality: bool
    row: int
    sign: int
    variables: Index
    quadratic: Array
    linear: Array
    rest: Polynomials


def _sides(problem: PolynomialProblem) -> tuple[_Ellipsoid, ...]:
    """Return the sides of rows that are ellipsoids in some of their variables."""
    found = []
    for equality, family, signs in ((True, problem.equalities, (1, -1)), (False, problem.inequalities, (1,))):
        last = pad(family.factors, max(2, family.factors.shape[1]))[:, -2:]
        squares = (family.term_degrees == 2) & (last[:, 0] == last[:, 1])
        for row in np.unique(family.rows[squares]).tolist():
            one = family.take(np.array([row]))
            found += [side for sign in signs if (side := _side(equality, row, sign, one)) is not None]
    return tuple(found)


def _side(equality: bool, row: int, sign: int, one: Polynomials) -> _Ellipsoid | None:
    """Return one side of a row, if it is an ellipsoid in the variables of some of its squares."""
    # Variables that share a monomial belong together, and must have quadratic terms alone.
    groups: list[set[int]] = []
    for m in one.factors[one.term_degrees > 1]:
        together = set(m[m >= 0].tolist())
        groups = [g for g in groups if not g & together] + [together.union(*(g for g in groups if g & together))]
    variables: list[int] = []
    for group in map(sorted, groups):
        own = _terms_with(one, group)
        quadratic = _matrix(one, own, group, sign)
        exact = not one.coefficients.rad[own].any() and int(one.term_degrees[own].max()) == 2
        if exact and _factor(quadratic) is not None:
            variables += group
    if not variables:
        return None
    own = _terms_with(one, variables)
    linear = np.zeros(len(variables))
    place = {v: k for k, v in enumerate(variables)}
    for term in np.flatnonzero(own & (one.term_degrees == 1)).tolist():
        linear[place[int(one.factors[term, -1])]] = sign * one.coefficients.mid[term]
    rest = Polynomials(1, one.rows[~own], one.factors[~own], one.coefficients[~own])
    return _Ellipsoid(equality, row, sign, np.array(variables), _matrix(one, own, variables, sign), linear, rest)


def _terms_with(one: Polynomials, variables: list[int]) -> NDArray[np.bool_]:
    """Return which terms hold some variables."""
    return np.asarray(np.isin(one.factors, variables).any(axis=1), dtype=np.bool_)


def _matrix(one: Polynomials, own: NDArray[np.bool_], variables: list[int], sign: int) -> Array:
    """Return the matrix A of ``-x' A x``; halving a coefficient is exact."""
    place = {v: k for k, v in enumerate(variables)}
    found = np.zeros((len(variables), len(variables)))
    for term in np.flatnonzero(own & (one.term_degrees == 2)).tolist():
        i, j = (place[v] for v in one.factors[term, -2:].tolist())
        value = -sign * one.coefficients.mid[term]
        if i == j:
            found[i, i] = value
        else:
            found[i, j] = found[j, i] = 0.5 * value
    return found


def _factor(matrix: Array) -> Array | None:
    """Return F with ``F F'`` near a matrix less a small part of its diagonal; None if that is not positive definite."""
    size = np.sqrt(np.maximum(np.diag(matrix), 0.0))
    if not size.all() or not np.isfinite(matrix).all():
        return None
    correlation = matrix / np.outer(size, size)
    try:
        triangle = np.linalg.cholesky(correlation - EPSILON * np.eye(len(size)))
    except np.linalg.LinAlgError:
        return None
    return np.asarray(size[:, None] * triangle, dtype=np.float64)


def _from_ellipsoids(problem: PolynomialProblem, sides: tuple[_Ellipsoid, ...]) -> Iterator[Consequence]:
    """Yield the bounds of variables by rows that are ellipsoids."""
    scaling = Scaling.of_box(problem, np.ones(problem.n_variables))
    for side in sides:
        if not np.isfinite((problem.upper - problem.lower)[side.rest.occurring()]).all():
            continue
        most = _greatest(side.rest, side.sign, scaling)
        inverse = np.linalg.inv(side.quadratic)
        middle = 0.5 * inverse @ side.linear
        level = float(middle @ side.quadratic @ middle) + float(most)
        level = max(level, EPSILON * (float(middle @ side.quadratic @ middle) + abs(float(most))), 1e-200)
        for place, k in enumerate(side.variables.tolist()):
            reach = float(np.sqrt(level * inverse[place, place]))
            for sign in (1, -1):
                end = middle[place] - sign * reach
                if _worth(problem, k, end - problem.lower[k] if sign > 0 else problem.upper[k] - end):
                    found = _tangent(problem, scaling, side, most, place, sign, 0.5 * inverse[place, place] / reach)
                    if found is not None:
                        yield found


def _tangent(
    problem: PolynomialProblem, scaling: Scaling, side: _Ellipsoid, most: Fraction, place: int, sign: int, weight: float
) -> Consequence | None:
    """Return the bound of one variable by an ellipsoid, with lambda the weight, and its exact sum of squares."""
    # lambda (x - d)' A (x - d) as a matrix over (1, x), but for the constant; the constant a little larger than needed.
    linear = [Fraction(-weight) * Fraction(b) for b in side.linear.tolist()]
    linear[place] += sign
    n = len(linear)
    exact = [[Fraction(0)] * (n + 1) for _ in range(n + 1)]
    for i in range(n):
        exact[0][i + 1] = exact[i + 1][0] = linear[i] / 2
        for j in range(n):
            exact[i + 1][j + 1] = Fraction(weight) * Fraction(float(side.quadratic[i, j]))
    matrix = np.array([[float(value) for value in line] for line in exact])
    inner = matrix[1:, 1:]
    vertex = np.linalg.solve(inner, matrix[1:, 0])
    needed = float(matrix[1:, 0] @ vertex)
    slack = 4 * EPSILON * (n + 1) * (needed + float(np.diag(inner) @ vertex**2) + needed)
    matrix[0, 0] = needed + slack + np.finfo(float).tiny
    exact[0][0] = Fraction(matrix[0, 0])
    squares = _squares(matrix, exact, [(), *((int(v),) for v in side.variables)])
    if squares is None:
        return None
    centre, scale = scaling.centre.copy(), scaling.scale.copy()
    centre[side.variables], scale[side.variables] = 0.0, 1.0
    bound = -exact[0][0] - Fraction(weight) * most
    objective = problem.variable(int(side.variables[place]), float(sign))
    return Consequence(
        problem,
        objective,
        outwards(bound, -1),
        centre,
        scale,
        side.equality,
        side.row,
        Fraction(weight) * side.sign,
        (),
        squares,
    )


def _squares(matrix: Array, exact: list[list[Fraction]], basis: list[tuple[int, ...]]) -> tuple[Square, ...] | None:
    """Return squares whose sum is exactly the form of a matrix; None where floats do not show it to be positive."""
    factor = _factor(matrix)
    if factor is None:
        return None
    numbers = [[Fraction(value) for value in line] for line in factor.tolist()]
    size = len(basis)
    left = [
        [exact[i][j] - sum(a * b for a, b in zip(numbers[i], numbers[j], strict=True)) for j in range(size)]
        for i in range(size)
    ]
    found = [Square(Fraction(1), tuple(basis), tuple(map(tuple, numbers)))]
    one = Fraction(1)
    # Powers of two bring all entries to one size, so that the diagonal dominates whatever the units.
    unit = [Fraction(2) ** int(e) for e in np.frexp(np.sqrt(np.diag(matrix)))[1]]
    for i in range(size):
        for j in range(i):
            if left[i][j]:
                pair = ((unit[i],), (unit[j] if left[i][j] > 0 else -unit[j],))
                found.append(Square(abs(left[i][j]) / (unit[i] * unit[j]), (basis[i], basis[j]), pair))
        own = left[i][i] - sum(abs(left[i][j]) * unit[i] / unit[j] for j in range(size) if j != i)
        if own < 0:
            return None
        found.append(Square(own, (basis[i],), ((one,),)))
    return tuple(found)
