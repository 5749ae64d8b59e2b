"""Witnesses: points that are proven to be feasible, and a local search for points with a small objective.

*Verification.* No float satisfies an equality exactly in general. So some variables keep their float values, and each
equality *defines* one further variable. The order is found by elimination: a variable that occurs in one remaining
equality only, linearly, is defined by this equality. For the models of :mod:`smid` this is simulation: parameters,
initial state and input noise are given, and the output noise of each sample follows.

The defined variables are computed as intervals. The precision is raised until the intervals are narrow, because
rounding errors grow along an oscillating recursion. If all bounds and inequalities hold for the intervals, a feasible
point exists. The upper end of the objective's interval is an upper bound of the optimum.

*Search.* Sequential linear programming: linearise, solve with a trust region on the complicating variables, and restore
feasibility by a linear program in the other variables. This restoration is exact if they occur linearly.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from relaxations.algebra import fixed_point
from relaxations.algebra.arrays import Array, Index
from relaxations.algebra.fixed_point import Interval
from relaxations.algebra.polynomial import Polynomials
from relaxations.deadline import check_time
from relaxations.points.linear_step import linear_step
from relaxations.problem.problem import PolynomialProblem
from relaxations.reductions.scaling import Scaling

_BITS, _MOST_BITS = 80, 1 << 15  # first and largest precision
_NARROW = 200  # binary places: if a constraint fails for intervals this narrow, the proof fails
# Scaled distances of the search from every limit, tried in turn. They keep the verified point feasible in spite of
# rounding errors and of the tolerances of the linear programs.
MARGINS = (1e-9, 1e-7, 1e-5)
STEPS = 25


@dataclass(frozen=True)
class Witness:
    """A point near which a feasible point is proven to exist.

    Parameters
    ----------
    point
        Shape (n_variables,). Midpoints of narrow intervals that contain the feasible point.
    value
        Upper bound, rounded up, of the objective at the feasible point.
    """

    point: Array
    value: float


def verify(problem: PolynomialProblem, objective: Polynomials, point: Array) -> Witness | None:
    """Return a witness near ``point``: a proof that a feasible point exists; None if there is no proof.

    Parameters
    ----------
    objective
        One row.
    point
        Shape (n_variables,). The entries of variables that equalities define are ignored.

    Examples
    --------
    >>> from relaxations.formats.expressions import problem_of, variables
    >>> x, y = variables("x y")
    >>> problem, objective = problem_of(y, [3 * y == x**2, x >= 0, x <= 1, y >= 0, y <= 1])
    >>> found = verify(problem, objective, np.array([1.0, 0.0]))  # y = 1/3 follows from x = 1
    >>> found.point.round(4), 1 / 3 <= found.value < 1 / 3 + 1e-12
    (array([1.    , 0.3333]), True)
    >>> verify(problem, objective, np.array([2.0, 0.0])) is None  # x = 2 is outside the box
    True
    """
    return Verifier(problem)(objective, point)


class Verifier:
    """Verifies points of one problem, see :func:`verify`; the preparation is done once."""

    def __init__(self, problem: PolynomialProblem) -> None:
        self._problem = problem
        equalities = problem.exact() if problem.exact is not None else problem.equalities
        self._order = definition_order(equalities)
        self._terms = equalities.terms()
        self._bits = _BITS

    def __call__(self, objective: Polynomials, point: Array) -> Witness | None:
        """Return a witness near a point, or None."""
        if self._order is None:
            return None
        bits, last = self._bits, None
        while bits <= _MOST_BITS:
            values = _define(self._terms, self._order, point, bits)
            if values is None:
                return None
            if _holds(self._problem, values, bits):
                self._bits = bits  # the next point is likely to need as many
                middles = np.array([fixed_point.middle(v, bits) for v in values])
                value = fixed_point.to_floats(_evaluate(objective, values, bits)[0], bits)[1]
                return Witness(middles, value)
            # The number of bits lost by rounding does not depend on the precision: it gives the precision needed.
            lost = max((high - low for low, high in values), default=0).bit_length()
            width = lost - bits
            # Intervals that more precision does not narrow come from the radii of the coefficients.
            if width <= -_NARROW or (last is not None and width >= last):
                return None
            bits, last = lost + _NARROW, width
        return None


def definition_order(equalities: Polynomials) -> list[tuple[int, int]] | None:
    """Return the pairs (equality, variable that it defines) in order of evaluation; None if there is no such order.

    >>> import sympy; from relaxations.problem.problem import from_sympy
    >>> a, *y = sympy.symbols("a y0:3")
    >>> problem, _ = from_sympy(None, [], [y[2] - a * y[1], y[1] - a * y[0]], [a, *y])
    >>> definition_order(problem.equalities)  # a simulation: the second gives y1, then the first y2
    [(1, 2), (0, 3)]
    """
    # For each equality: variables with a linear term, in a product, and squared; for each variable its equalities.
    linear = equalities.term_degrees == 1
    own = equalities.factors.max(axis=1, initial=-1)
    in_row: list[set[int]] = [set() for _ in range(equalities.n_rows)]
    plain: list[set[int]] = [set() for _ in range(equalities.n_rows)]
    twice: list[set[int]] = [set() for _ in range(equalities.n_rows)]
    bilinear: list[set[int]] = [set() for _ in range(equalities.n_rows)]
    for row, factor, is_linear, variable in zip(
        equalities.rows.tolist(), equalities.factors.tolist(), linear.tolist(), own.tolist(), strict=True
    ):
        if is_linear:
            plain[row].add(variable)
        real = [v for v in factor if v >= 0]
        in_row[row].update(real)
        if not is_linear:
            bilinear[row].update(real)
        twice[row].update(v for v in real if real.count(v) > 1)
    rows_of: dict[int, set[int]] = {}
    for row, variables in enumerate(in_row):
        for v in variables:
            rows_of.setdefault(v, set()).add(row)

    # Eliminate from the end: a variable of one remaining equality is defined by it.
    order: list[tuple[int, int]] = []
    queue = [v for v, rows in rows_of.items() if len(rows) == 1]
    remaining = equalities.n_rows
    while remaining:
        check_time()
        # Prefer a constant divisor, which cannot be zero. Otherwise accept a divisor that depends on variables.
        pick = next((v for v in reversed(queue) if _defines(v, rows_of, plain, bilinear)), None)
        if pick is None:
            pick = next((v for v in queue if len(rows_of[v]) == 1 and v not in twice[next(iter(rows_of[v]))]), None)
        if pick is None:
            return None
        # Remove the equality, and queue the variables that now occur in one equality only.
        row = next(iter(rows_of[pick]))
        order.append((row, pick))
        remaining -= 1
        queue = [v for v in queue if v != pick]
        for v in in_row[row]:
            rows_of[v].discard(row)
            if len(rows_of[v]) == 1:
                queue.append(v)
            elif not rows_of[v] and v in queue:
                queue.remove(v)
    return order[::-1]


def _defines(v: int, rows_of: dict[int, set[int]], plain: list[set[int]], bilinear: list[set[int]]) -> bool:
    """Return whether a variable occurs in one remaining equality only, with a constant coefficient."""
    if len(rows_of[v]) != 1:
        return False
    row = next(iter(rows_of[v]))
    return v in plain[row] and v not in bilinear[row]


def _product(term: tuple[float, float, list[int]], values: list[Interval], bits: int) -> Interval:
    """Return the interval of a term."""
    mid, rad, variables = term
    result = fixed_point.from_float(mid, bits)
    if rad:
        result = fixed_point.widened(result, rad, bits)
    for v in variables:
        result = fixed_point.multiply(result, values[v], bits)
    return result


def _define(
    terms: list[list[tuple[float, float, list[int]]]], order: list[tuple[int, int]], point: Array, bits: int
) -> list[Interval] | None:
    """Return every variable as an interval: a point if it is free, computed if an equality defines it."""
    values = [fixed_point.from_float(x, bits) for x in point.tolist()]
    for row, variable in order:
        check_time()
        rest_low = rest_high = divisor_low = divisor_high = 0
        for mid, rad, variables in terms[row]:
            if variable in variables:
                others = [v for v in variables if v != variable]
                low, high = _product((mid, rad, others), values, bits)
                divisor_low, divisor_high = divisor_low + low, divisor_high + high
            else:
                low, high = _product((mid, rad, variables), values, bits)
                rest_low, rest_high = rest_low + low, rest_high + high
        quotient = fixed_point.divide((-rest_high, -rest_low), (divisor_low, divisor_high), bits)
        if quotient is None:
            return None
        values[variable] = quotient
    return values


def _evaluate(polynomials: Polynomials, values: list[Interval], bits: int) -> list[Interval]:
    """Return the interval of each polynomial."""
    sums = []
    for member in polynomials.terms():
        check_time()
        products = [_product(term, values, bits) for term in member]
        sums.append((sum(low for low, _ in products), sum(high for _, high in products)))
    return sums


def _holds(problem: PolynomialProblem, values: list[Interval], bits: int) -> bool:
    """Return whether all bounds and inequalities hold for the intervals."""
    for (low, high), lower, upper in zip(values, problem.lower.tolist(), problem.upper.tolist(), strict=True):
        # Bounds are rounded to the inside, so that the comparison is rigorous.
        if np.isfinite(lower) and low < fixed_point.from_float(lower, bits)[1]:
            return False
        if np.isfinite(upper) and high > fixed_point.from_float(upper, bits)[0]:
            return False
    return all(low >= 0 for low, _ in _evaluate(problem.inequalities, values, bits))


def find_witness(
    box: PolynomialProblem,
    problem: PolynomialProblem,
    objective: Polynomials,
    complicating: Index,
    start: Array,
    magnitude: Array | None = None,
    steps: int = STEPS,
) -> Witness | None:
    """Return a witness with a small objective: search on ``box``, verify on ``problem``; None if no point is verified.

    Parameters
    ----------
    box
        The problem with the bounds of the search.
    objective
        One row, to be minimised.
    complicating
        Variables in the trust region; the constraints are affine in the others.
    start
        Shape (n_variables,).
    magnitude
        Shape (n_variables,). Size of the variables without finite bounds.
    steps
        Largest number of linearisations: few suffice near the optimum.

    Raises
    ------
    ProblemError
        When a bound is infinite and no magnitudes are given.

    Examples
    --------
    >>> from relaxations.formats.expressions import problem_of, variables
    >>> x, y = variables("x y")
    >>> problem, objective = problem_of(y, [x * y == 1, x >= 0, x <= 2, y >= 0, y <= 4])
    >>> found = find_witness(problem, problem, objective, np.array([0]), np.array([1.0, 1.0]))
    >>> found.point.round(4), round(found.value, 4)
    (array([2. , 0.5]), 0.5)
    """
    scaling = Scaling.of_box(box, magnitude)
    scaled = scaling.apply(box)
    cost = scaling.polynomials(objective)
    with np.errstate(invalid="ignore", divide="ignore"):
        begin = np.nan_to_num(np.clip((start - scaling.centre) / scaling.scale, scaled.lower, scaled.upper))
    for margin in MARGINS:
        point = search(scaled, cost, complicating, begin, margin, steps=steps)
        if point is None:  # a wider margin is infeasible too
            return None
        witness = verify(problem, objective, scaling.recover(point))
        if witness is not None:
            return witness
    return None


def search(
    problem: PolynomialProblem,
    objective: Polynomials,
    complicating: Index,
    start: Array,
    margin: float,
    radius: float = 0.1,
    steps: int = STEPS,
) -> Array | None:
    """Return a point improved by sequential linear programming; None if no feasible point was found.

    The point is feasible within the tolerances of the linear programs, without a proof. The problem is scaled to
    magnitudes near one, and its constraints are affine in all variables but the ``complicating`` ones. Only the
    complicating entries of ``start`` are used. ``margin`` is the distance from every limit, ``radius`` the first radius
    of the trust region, ``steps`` the largest number of linearisations.
    """
    order = definition_order(problem.equalities)

    def step(point: Array, radius: float) -> tuple[Array, float, float] | None:
        return linear_step(problem, objective, complicating, point, radius, margin, order)

    # Start: restore feasibility with the complicating variables fixed.
    best = step(start, 0.0)
    if best is None:
        return None
    point, violation, value = best
    for _ in range(steps):
        if radius < 1e-9:
            break
        # Move within the trust region, then restore feasibility.
        trial = step(point, radius)
        restored = None if trial is None else step(trial[0], 0.0)
        if restored is None:
            radius *= 0.25
            continue
        # Accept less violation first, then a smaller objective.
        feasible = restored[1] <= 0.0
        better = restored[1] < violation if violation > 0.0 else feasible and restored[2] < value
        if not better:
            radius *= 0.25
            continue
        gain = value - restored[2] if violation <= 0.0 else np.inf
        point, violation, value = restored
        radius *= 2.0
        if gain < 1e-10:
            break
    return point if violation <= 0.0 else None
