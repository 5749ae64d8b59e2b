"""Feasible points on curved constraints, proven by Krawczyk's form of Newton's method.

If equalities are nonlinear in all variables, no equality defines a variable, and in general no float satisfies them.
The equalities and the nearly active inequalities become a square system ``f(x) = 0``. Variables near a bound are fixed
at the bound. The system is solved for as many variables as there are rows, and the others keep their values. With ``Y``
near the inverse of the derivative, and ``X`` a box around the point ``p``, if

    K(X) = p - Y f(p) + (I - Y f'(X)) (X - p)

lies in the interior of ``X``, then ``f`` has a zero in ``X``. All numbers are fractions, and an uncertain coefficient
is an interval. The other constraints must hold on the whole of ``X``.

References
----------
R. Krawczyk, "Newton-Algorithmen zur Bestimmung von Nullstellen mit Fehlerschranken", Computing 4 (1969) 187-201.
"""

from __future__ import annotations

from fractions import Fraction
from math import nextafter

import numpy as np
from scipy.linalg import qr

from relaxations.algebra.arrays import Array, Index
from relaxations.algebra.polynomial import Polynomials
from relaxations.points.exact_point import Row, bound_values, is_active, rows
from relaxations.points.witness import Witness
from relaxations.problem.problem import PolynomialProblem

LARGEST = 60  # variables; fractions are slow
_BITS = 160  # binary places of the point
_STEPS = 12  # of Newton's method, at most; each adds about ten digits
_DEPENDENT = 1e-6  # distance of a row from the span of others, below which it counts as dependent

Interval = tuple[Fraction, Fraction]


def newton_point(problem: PolynomialProblem, objective: Polynomials, point: Array) -> Witness | None:
    """Return a proven feasible point near ``point``; None if there is no proof. None also for more than 60 variables.

    Two circles intersect at a point without float coordinates:

    >>> from relaxations.formats.expressions import problem_of, variables
    >>> x, y = variables("x y")
    >>> problem, objective = problem_of(y, [x**2 + y**2 == 2, (x - 1)**2 + y**2 == 2, x <= 2, y >= 0, y <= 2])
    >>> found = newton_point(problem, objective, np.array([0.5, 1.3229]))
    >>> found.point.round(6), 0 <= found.value - 7**0.5 / 2 < 1e-15
    (array([0.5     , 1.322876]), True)
    """
    if problem.n_variables > LARGEST:
        return None
    # The system: equalities and active inequalities, in the variables away from their bounds.
    equalities, inequalities = rows(problem.equalities), rows(problem.inequalities)
    active = [k for k, row in enumerate(inequalities) if is_active(row, point)]
    held_values, _ = bound_values(problem, point)
    exact = [Fraction(x) if v is None else v for v, x in zip(held_values, point.tolist(), strict=True)]
    free = np.array([k for k, v in enumerate(held_values) if v is None], dtype=np.int64)
    width = np.where(problem.upper > problem.lower, problem.upper - problem.lower, 1.0)
    system = Polynomials.join([problem.equalities, problem.inequalities.take(np.array(active, dtype=np.int64))])
    chosen = _square(system, len(equalities), free, point, width)
    if chosen is None:
        return None
    solved, unknowns = chosen
    # Enclose a zero of the system.
    terms = [*equalities, *(inequalities[k] for k in active)]
    found = _solved([terms[k] for k in solved], unknowns, exact, width)
    if found is None:
        return None
    # Check bounds and all inequalities that are not in the system.
    zero = {active[k - len(equalities)] for k in solved if k >= len(equalities)}
    inside = all(
        low <= v[0] and v[1] <= high
        for v, low, high in zip(found, problem.lower.tolist(), problem.upper.tolist(), strict=True)
    )
    if not inside or any(_value(row, found)[0] < 0 for k, row in enumerate(inequalities) if k not in zero):
        return None
    value = _value(rows(objective)[0], found)[1]
    return Witness(np.array([float((low + high) / 2) for low, high in found]), nextafter(float(value), np.inf))


def _square(
    system: Polynomials, equalities: int, free: Index, point: Array, width: Array
) -> tuple[list[int], list[int]] | None:
    """Return independent rows and as many variables to solve for; None if an equality depends on other rows."""
    # Derivative with rows of length one, relative to the box.
    derivative = np.zeros((system.n_rows, len(point)))
    places, columns, slopes = system.jacobian(point)
    np.add.at(derivative, (places, columns), slopes)
    scaled = (derivative * width)[:, free]
    size = np.linalg.norm(scaled, axis=1, keepdims=True)
    scaled = scaled / np.where(size > 0, size, 1.0)
    solved: list[int] = []
    # Gram-Schmidt (twice, for accuracy) selects independent rows, QR with pivoting the columns.
    basis = np.zeros((0, free.size))
    for k, row in enumerate(scaled):
        rest = row - basis.T @ (basis @ row)
        rest -= basis.T @ (basis @ rest)
        length = float(np.linalg.norm(rest))
        if length > _DEPENDENT:
            solved.append(k)
            basis = np.vstack([basis, rest / length])
        elif k < equalities:
            return None
    if not solved:
        return [], []
    _, _, order = qr(scaled[solved], mode="economic", pivoting=True)
    return solved, free[order[: len(solved)]].tolist()


def _solved(system: list[Row], unknowns: list[int], start: list[Fraction], width: Array) -> list[Interval] | None:
    """Return every variable as an interval, such that the intervals of the unknowns contain a zero of the system."""
    if not unknowns:
        return [(x, x) for x in start]
    # Newton's method in fractions improves the point p.
    size = [Fraction(w) for w in width[unknowns].tolist()]
    point = list(start)
    for _ in range(_STEPS):
        inverse = _inverse(system, unknowns, point)
        if inverse is None:
            return None
        step = [(low + high) / 2 for low, high in _corrections(system, inverse, point)]
        for k, s in zip(unknowns, step, strict=True):
            point[k] = _rounded(point[k] - s)
        if max(abs(s) / w for s, w in zip(step, size, strict=True)) < Fraction(1, 1 << _BITS - 20):
            break
    inverse = _inverse(system, unknowns, point)
    if inverse is None:
        return None
    # The box X: twice as wide as the Newton correction.
    shift = _corrections(system, inverse, point)
    reach = 2 * max(max(abs(low), abs(high)) / w for (low, high), w in zip(shift, size, strict=True))
    reach = max(reach, Fraction(1, 1 << _BITS - 20))
    around = [(x, x) for x in point]
    for k, w in zip(unknowns, size, strict=True):
        around[k] = (point[k] - reach * w, point[k] + reach * w)
    # Check that K(X) lies in the interior of X.
    slopes = [[_slope(row, k, around) for k in unknowns] for row in system]
    for i, (r, (low, high)) in enumerate(zip(inverse, shift, strict=True)):
        moved = max(abs(low), abs(high))
        for j in range(len(unknowns)):
            low, high = _combined(r, [row[j] for row in slopes])
            moved += max(abs((i == j) - low), abs((i == j) - high)) * reach * size[j]
        if moved >= reach * size[i]:
            return None
    return around


def _inverse(system: list[Row], unknowns: list[int], point: list[Fraction]) -> list[list[Fraction]] | None:
    """Return an approximate inverse of the derivative, as fractions."""
    exact = [(x, x) for x in point]
    derivative = np.array([[float(sum(_slope(row, k, exact)) / 2) for k in unknowns] for row in system])
    try:
        inverse = np.linalg.inv(derivative)
    except np.linalg.LinAlgError:
        return None
    return [[Fraction(v) for v in row] for row in inverse.tolist()] if np.isfinite(inverse).all() else None


def _rounded(value: Fraction) -> Fraction:
    """Return the fraction rounded to 160 binary places."""
    return Fraction(round(value * (1 << _BITS)), 1 << _BITS)


def _corrections(system: list[Row], inverse: list[list[Fraction]], point: list[Fraction]) -> list[Interval]:
    """Return ``Y f(p)``."""
    values = [_value(row, [(x, x) for x in point]) for row in system]
    return [_combined(factors, values) for factors in inverse]


def _combined(factors: list[Fraction], values: list[Interval]) -> Interval:
    """Return the interval of ``sum_k factor_k value_k``."""
    products = [_times((f, f), value) for f, value in zip(factors, values, strict=True)]
    return sum((low for low, _ in products), Fraction(0)), sum((high for _, high in products), Fraction(0))


def _value(row: Row, values: list[Interval]) -> Interval:
    """Return the interval of a row on a box."""
    low = high = Fraction(0)
    for middle, radius, variables in row:
        product = (middle - radius, middle + radius)
        for v in variables:
            product = _times(product, values[v])
        low, high = low + product[0], high + product[1]
    return low, high


def _slope(row: Row, variable: int, values: list[Interval]) -> Interval:
    """Return the interval of a row's derivative on a box."""
    parts: Row = []
    for middle, radius, variables in row:
        count = variables.count(variable)
        if count:
            others = list(variables)
            others.remove(variable)
            parts.append((count * middle, count * radius, others))
    return _value(parts, values)


def _times(x: Interval, y: Interval) -> Interval:
    """Return the product of two intervals."""
    if x[0] == x[1] and y[0] == y[1]:
        return x[0] * y[0], x[0] * y[0]
    corners = (x[0] * y[0], x[0] * y[1], x[1] * y[0], x[1] * y[1])
    return min(corners), max(corners)
