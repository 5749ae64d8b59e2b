"""Stability of a polynomial as polynomial inequalities, for any degree.

The Schur-Cohn test: with ``c(z) = c_0 z^n + ... + c_n`` and the reversed polynomial ``c*(z) = z^n c(1/z)``,
all roots of c lie inside the unit circle exactly when ``c_0^2 - c_n^2 > 0`` and all roots of
``(c_0 c - c_n c*) / z``, of degree n - 1, do.  Where ``c_0 > 0`` is known, which holds from the second step
on, ``c_0^2 - c_n^2 > 0`` splits into the two lower-degree conditions ``c_0 - c_n > 0`` and
``c_0 + c_n > 0``.  Factors known to be positive are divided out, so degrees 1 and 2 give the plain linear
conditions (the stability triangle).

Reference: E. I. Jury, Theory and Application of the z-Transform Method, 1964, chapter 3.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache

import sympy

from relaxations.problem.problem import with_fractions
from smid.models.symbols import number

__all__ = ["schur_cohn"]


def schur_cohn(
    coefficients: Sequence[sympy.Expr], radius: float = 1.0, *, positive_leading: bool = False
) -> tuple[sympy.Expr, ...]:
    """Return expressions that are all > 0 exactly when every root lies strictly inside a circle.

    Intervals are closed, so a model takes them as >= 0, the closure.

    Parameters
    ----------
    coefficients
        ``c_0, ..., c_n``, highest power first; polynomials in the parameters.
    radius
        Radius of the circle.
    positive_leading
        Whether ``c_0 > 0`` is known; it then counts as given, and the conditions have lower degrees.  A
        positive number ``c_0`` is recognised without it.

    Examples
    --------
    >>> a1, a2 = sympy.symbols("a1 a2", real=True)
    >>> schur_cohn([1, a1, a2])
    (a1 + a2 + 1, -a1 + a2 + 1, 1 - a2)
    """
    # The coefficients of c(r z), whose roots are those of c over r.
    degree, scale = len(coefficients) - 1, number(radius)
    scaled = [with_fractions(sympy.sympify(c)) * scale ** (degree - i) for i, c in enumerate(coefficients)]
    free = sympy.symbols(f"c:{degree + 1}", real=True)
    values = dict(zip(free, scaled, strict=True))
    conditions = _conditions(free, positive_leading or bool(scaled[0].is_positive))
    found = dict.fromkeys(sympy.expand(condition.xreplace(values)) for condition in conditions)
    return tuple(condition for condition in found if not condition.is_positive)


# The coefficients are independent symbols here. A factor of one condition that divides another one vanishes only on the
# border then, and the closure keeps the border. A factor that is zero because of what a user has fixed must not be
# divided out: poles at +-r have a_1 = 0, and a_1 >= 0, -1 >= 0 would be left of a_1 >= 0, -a_1 >= 0.
@lru_cache(maxsize=128)
def _conditions(coefficients: tuple[sympy.Symbol, ...], leading_positive: bool) -> tuple[sympy.Expr, ...]:
    row = [sympy.Poly(item, *coefficients, domain="QQ") for item in coefficients]
    # Conditions so far, each positive wherever the later ones are read.
    found: list[sympy.Poly] = []
    positive = [row[0]] if leading_positive else []

    def add(condition: sympy.Poly) -> None:
        (cleaned,) = _divided([condition], [*positive, *found])
        if not (cleaned.is_ground and cleaned.LC() > 0) and cleaned not in found:
            found.append(cleaned)

    if len(row) > 1 and leading_positive:
        # Necessary at once, linear, and factors of what follows.
        add(sum(row))
        add(_alternating(row))
    while len(row) > 1:
        head, tail = row[0], row[-1]
        if leading_positive and len(row) <= 3:
            # One root: an interval; two roots: the stability triangle. Linear in the row.
            add(sum(row))
            add(_alternating(row))
            add(head - tail)
            break
        if leading_positive:
            add(head - tail)
            add(head + tail)
        else:
            add(head**2 - tail**2)
        following = [head * row[i] - tail * row[-1 - i] for i in range(len(row) - 1)]
        row = _divided(following, [*positive, *found])
        leading_positive = True
    return tuple(condition.as_expr() for condition in found)


def _alternating(row: Sequence[sympy.Poly]) -> sympy.Poly:
    """Evaluate the polynomial at -1, with the sign that makes its leading term positive."""
    return sum((-1) ** i * item for i, item in enumerate(row))


def _divided(row: Sequence[sympy.Poly], positive: Sequence[sympy.Poly]) -> list[sympy.Poly]:
    """Divide polynomials by positive common factors; otherwise the degree doubles at each step.

    By trial division: sympy's multivariate factorisation sometimes takes minutes at degree five.
    """
    divided = list(row)
    for divisor in positive:
        while not divisor.is_ground and any(divided):
            pairs = [item.div(divisor) for item in divided]
            if any(remainder for _, remainder in pairs):
                break
            divided = [quotient for quotient, _ in pairs]
    return divided
