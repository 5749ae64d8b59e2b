"""Feasible points in exact fractions, for optima where no interval around the point is feasible.

At many optima at least as many constraints are active as there are variables. Then :func:`relaxations.points.verify`
fails, because it needs an interval around the point. Here the point is computed exactly:

1. variables near a bound get the value of the bound;
2. equalities and nearly active inequalities are solved in fractions, where they are affine in the other variables;
3. all constraints are compared without rounding.
"""

from __future__ import annotations

from collections import Counter
from fractions import Fraction
from math import ceil, floor, nextafter, prod

import numpy as np

from relaxations.algebra.arrays import Array
from relaxations.algebra.polynomial import Polynomials
from relaxations.deadline import check_time
from relaxations.points.witness import Witness
from relaxations.problem.problem import PolynomialProblem

LARGEST = 200  # variables; fractions grow during the elimination
_NEAR = 1e-7  # "near" a bound or a constraint: relative to the box, or to the terms of the constraint

# If the feasible set is a single point or a curve, only exact coordinates are feasible. These are often simple
# fractions. The search finds them with these errors, relative to the box.
_SIMPLE = (1e-9, 1e-6, 1e-4)

Row = list[tuple[Fraction, Fraction, list[int]]]  # (coefficient, its radius, variables) of each term
_Definition = tuple[int, dict[int, Fraction], Fraction]


def exact_point(problem: PolynomialProblem, objective: Polynomials, point: Array) -> Witness | None:
    """Return a proven feasible point near ``point``, computed in fractions; None if there is no proof.

    None also for more than 200 variables.

    Three equalities, of which each follows from the others, at a vertex:

    >>> from relaxations.formats.expressions import problem_of, variables
    >>> x, y, z = variables("x y z")
    >>> equal = [x + y == 1, y + z == 1, x - z == 0]
    >>> problem, objective = problem_of(z, [*equal, x >= 0, x <= 1, y >= 0, y <= 1, z >= 0, z <= 1])
    >>> found = exact_point(problem, objective, np.array([1e-9, 1.0, 0.0]))
    >>> found.point, 0 <= found.value < 1e-300
    (array([0., 1., 0.]), True)
    """
    if problem.n_variables > LARGEST:
        return None
    equalities, inequalities = rows(problem.equalities), rows(problem.inequalities)
    if any(radius for row in equalities for _, radius, _ in row):
        return None
    width = np.where(np.isfinite(problem.upper - problem.lower), problem.upper - problem.lower, 1.0)
    for share in (0.0, *_SIMPLE):
        near = [simplest(x, Fraction(share * w)) for x, w in zip(point.tolist(), width.tolist(), strict=True)]
        found = _defined_point(problem, objective, point, near, equalities, inequalities)
        if found is not None:
            return found
    return None


def _defined_point(
    problem: PolynomialProblem,
    objective: Polynomials,
    point: Array,
    near: list[Fraction],
    equalities: list[Row],
    inequalities: list[Row],
) -> Witness | None:
    """Return the point that the constraints define, with free variables at ``near``; None if it is infeasible."""
    values, distance = bound_values(problem, point)
    active = [row for row in inequalities if is_active(row, point)]
    _fix_products([*equalities, *active], values, near)
    echelon = _eliminated(equalities, active, values, distance)
    if echelon is None:
        return None
    exact = [x if v is None else v for v, x in zip(values, near, strict=True)]
    for pivot, slope, constant in reversed(echelon):
        exact[pivot] = -constant - sum((s * exact[v] for v, s in slope.items()), start=Fraction(0))
    inside = all(
        low <= v <= high for v, low, high in zip(exact, problem.lower.tolist(), problem.upper.tolist(), strict=True)
    )
    if not inside or any(_range(row, exact)[0] < 0 for row in inequalities):
        return None
    value = _range(rows(objective)[0], exact)[1]
    try:
        return Witness(np.array([float(v) for v in exact]), nextafter(float(value), np.inf))
    except OverflowError:  # the value exceeds the range of floats
        return None


def rows(polynomials: Polynomials) -> list[Row]:
    """Return the terms of each polynomial in fractions."""
    return [[(Fraction(mid), Fraction(rad), factor) for mid, rad, factor in row] for row in polynomials.terms()]


def simplest(value: float, reach: Fraction) -> Fraction:
    """Return the fraction of least denominator at a distance of at most ``reach`` from a number.

    >>> simplest(0.6000001, Fraction(1, 1000)), simplest(0.5, Fraction(0))
    (Fraction(3, 5), Fraction(1, 2))
    """
    low, high = Fraction(value) - reach, Fraction(value) + reach
    if low == high:
        return low
    # Continued fraction: take the integer part, then continue with the reciprocal of the remainder.
    wholes = []
    while True:
        whole = ceil(low)
        if whole <= high:
            found = Fraction(min(max(0, whole), floor(high)))
            break
        wholes.append(whole - 1)
        low, high = 1 / (high - whole + 1), 1 / (low - whole + 1)
    for whole in reversed(wholes):
        found = whole + 1 / found
    return found


def bound_values(problem: PolynomialProblem, point: Array) -> tuple[list[Fraction | None], list[float]]:
    """Return the bound of each variable near one, None for the others, and all distances from the bounds.

    The distances are relative to the width of the box.
    """
    width = np.where(np.isfinite(problem.upper - problem.lower), problem.upper - problem.lower, 1.0)
    to_lower, to_upper = np.abs(point - problem.lower), np.abs(problem.upper - point)
    ends = np.where(to_lower <= to_upper, problem.lower, problem.upper)
    distance = np.minimum(to_lower, to_upper) / np.maximum(width, 1e-300)
    values = [Fraction(e) if d <= _NEAR else None for e, d in zip(ends.tolist(), distance.tolist(), strict=True)]
    return values, distance.tolist()


def is_active(row: Row, point: Array) -> bool:
    """Return whether an inequality with exact coefficients is nearly zero at a point."""
    terms = [float(c) * prod(float(point[v]) for v in variables) for c, _, variables in row]
    return not any(r for _, r, _ in row) and abs(sum(terms)) <= _NEAR * sum(map(abs, terms))


def _fix_products(family: list[Row], values: list[Fraction | None], near: list[Fraction]) -> None:
    """Fix variables at ``near`` until every row is affine in the others; the variable in most products is first."""
    while True:
        free = [[v for v in variables if values[v] is None] for row in family for _, _, variables in row]
        count = Counter(v for term in free if len(term) > 1 for v in term)
        if not count:
            return
        most = max(count, key=lambda v: (count[v], -v))
        values[most] = near[most]


def _eliminated(
    equalities: list[Row], active: list[Row], values: list[Fraction | None], distance: list[float]
) -> list[_Definition] | None:
    """Return the variables that the rows define, by Gaussian elimination; None if an equality is violated.

    A definition ``(pivot, slope, constant)`` means ``pivot + slope @ others + constant = 0``, where the others are free
    or defined later. Nearly active rows may be violated here, because all constraints are compared at the end.
    """
    echelon: list[_Definition] = []
    for place, row in enumerate([*equalities, *active]):
        check_time()
        slope, constant = _affine(row, values)
        for pivot, others, rest in echelon:
            share = slope.pop(pivot, Fraction(0))
            if share:
                slope = {v: slope.get(v, 0) - share * others.get(v, 0) for v in {*slope, *others}}
                constant -= share * rest
        slope = {v: s for v, s in slope.items() if s}
        if slope:
            pivot = max(slope, key=lambda v: distance[v])  # the variable farthest from its bounds
            lead = slope.pop(pivot)
            echelon.append((pivot, {v: s / lead for v, s in slope.items()}, constant / lead))
        elif constant and place < len(equalities):
            return None
    return echelon


def _affine(row: Row, values: list[Fraction | None]) -> tuple[dict[int, Fraction], Fraction]:
    """Return slopes and constant of a row in the variables without a value."""
    slope: dict[int, Fraction] = {}
    constant = Fraction(0)
    for coefficient, _, variables in row:
        known = [values[v] for v in variables]
        product = prod((k for k in known if k is not None), start=coefficient)
        free = [v for v, k in zip(variables, known, strict=True) if k is None]
        if free:
            slope[free[0]] = slope.get(free[0], Fraction(0)) + product
        else:
            constant += product
    return slope, constant


def _range(row: Row, exact: list[Fraction]) -> tuple[Fraction, Fraction]:
    """Return the bounds of a row at an exact point."""
    products = [(c, r, prod((exact[v] for v in variables), start=Fraction(1))) for c, r, variables in row]
    middle = sum((c * p for c, _, p in products), start=Fraction(0))
    radius = sum((r * abs(p) for _, r, p in products), start=Fraction(0))
    return middle - radius, middle + radius
