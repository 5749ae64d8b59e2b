"""One step of sequential linear programming.

If the equalities define most variables as functions of a few others, these variables are eliminated. Example: the
output noise of a record follows from the parameters and the initial state. So a linear program with thousands of
unknowns becomes one with few unknowns and many inequalities. If more than 30 unknowns remain, for example with input
noise, the sparse program is solved.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from relaxations.algebra.arrays import Array, Index
from relaxations.algebra.compiled import compiling
from relaxations.algebra.polynomial import Polynomials
from relaxations.deadline import check_time, remaining
from relaxations.points.linear_program import INFEASIBLE, minimum
from relaxations.problem.problem import PolynomialProblem

# The simplex method may cycle at the tolerances of `minimum`, so each program has a time limit. A program that exceeds
# it costs one candidate of the search.
_LONGEST = 5.0  # seconds
_FEW = 30  # unknowns of a dense program, at most
_LEAST = 1e-12  # divisor in a definition

compiled = compiling(__file__)


@dataclass(frozen=True)
class _Linearised:
    """Minimise ``cost @ d`` where ``equal @ d = right``, ``unequal @ d <= limits`` and ``lower <= d <= upper``."""

    cost: Array
    equal: sparse.csr_matrix
    right: Array
    unequal: sparse.csr_matrix
    limits: Array
    lower: Array
    upper: Array


@dataclass(frozen=True)
class _Program:
    """Minimise ``cost @ d`` where ``low <= rows @ d <= high`` and ``lower <= d <= upper``."""

    cost: Array
    rows: sparse.csr_array
    low: Array
    high: Array
    lower: Array
    upper: Array


def linear_step(
    problem: PolynomialProblem,
    objective: Polynomials,
    complicating: Index,
    point: Array,
    radius: float,
    margin: float,
    order: list[tuple[int, int]] | None = None,
) -> tuple[Array, float, float] | None:
    """Return the solution of the linear program at a point, with complicating variables within a radius.

    The result is the new point, the violation of the linearised constraints and the objective value; None without a
    solution. If the constraints cannot be satisfied, their largest violation is minimised instead of the objective.
    The problem is scaled to magnitudes near one, and ``margin`` is the distance from every limit. ``order`` comes from
    :func:`relaxations.points.witness.definition_order`.
    """
    # Bounds with a margin; complicating variables stay within the radius.
    base = np.clip(np.where(np.isfinite(point), point, 0.0), problem.lower, problem.upper)
    width = np.where(np.isfinite(problem.upper - problem.lower), problem.upper - problem.lower, 0.0)
    lower, upper = problem.lower + 0.5 * margin * width, problem.upper - 0.5 * margin * width
    lower[complicating] = np.maximum(lower[complicating], base[complicating] - radius)
    upper[complicating] = np.minimum(upper[complicating], base[complicating] + radius)
    lower[complicating] = np.minimum(lower[complicating], upper[complicating])
    # Linearise objective and constraints at the point.
    cost = objective.slopes(base).toarray()[0]
    equal, value = problem.equalities.slopes(base), problem.equalities.evaluate(base)
    unequal, slack = problem.inequalities.slopes(base), problem.inequalities.evaluate(base)
    linear = _Linearised(cost, equal, -value, -unequal, slack - margin, lower - base, upper - base)

    found = _condensed(linear, order)
    program, whole = (_sparse(linear), None) if found is None else found
    solved = _solve(program)
    if solved is None:
        return None
    step, violation = solved
    moved = base + (step if whole is None else whole @ np.r_[step, 1.0])
    return moved, violation, float(objective.evaluate(moved)[0])


def _sparse(linear: _Linearised) -> _Program:
    """Return the program in all variables."""
    rows = sparse.csr_array(sparse.vstack([linear.equal, linear.unequal]))
    low = np.concatenate([linear.right, np.full(len(linear.limits), -np.inf)])
    high = np.concatenate([linear.right, linear.limits])
    return _Program(linear.cost, rows, low, high, linear.lower, linear.upper)


def _condensed(linear: _Linearised, order: list[tuple[int, int]] | None) -> tuple[_Program, Array] | None:
    """Return the program in the variables that no equality defines, and the map ``d = map @ (free, 1)``.

    None if more than 30 variables remain, or if the equalities do not define the others at this point.
    """
    n = len(linear.cost)
    if not order or n - len(order) > _FEW:
        return None
    # Follow the definitions.
    places, defined = np.array(order).T
    is_free = np.ones(n, dtype=bool)
    is_free[defined] = False
    free = np.flatnonzero(is_free)
    whole = np.zeros((n, free.size + 1))
    whole[free, np.arange(free.size)] = 1.0
    equal = linear.equal
    if not _define(places, defined, equal.indptr, equal.indices, equal.data, linear.right, whole):
        return None
    # Bounds of the defined variables become rows in the free ones.
    lower, upper = linear.lower[defined], linear.upper[defined]
    bounded = np.isfinite(lower) | np.isfinite(upper)
    affine = np.concatenate([whole[defined[bounded]], linear.unequal @ whole])
    low = np.concatenate([lower[bounded], np.full(len(linear.limits), -np.inf)]) - affine[:, -1]
    high = np.concatenate([upper[bounded], linear.limits]) - affine[:, -1]
    rows = sparse.csr_array(affine[:, :-1])
    return _Program((linear.cost @ whole)[:-1], rows, low, high, linear.lower[free], linear.upper[free]), whole


@compiled
def _define(
    rows: Index,
    defined: Index,
    starts: NDArray[np.int32],
    columns: NDArray[np.int32],
    slopes: Array,
    right: Array,
    whole: Array,
) -> bool:
    """Write the row of each defined variable, in the order of definition; tell whether all are finite."""
    for k in range(len(rows)):
        row, variable = rows[k], defined[k]
        divisor = 0.0
        whole[variable, -1] = right[row]
        for place in range(starts[row], starts[row + 1]):
            if columns[place] == variable:
                divisor = slopes[place]
            else:
                for j in range(whole.shape[1]):
                    whole[variable, j] -= slopes[place] * whole[columns[place], j]
        if abs(divisor) < _LEAST:
            return False
        for j in range(whole.shape[1]):
            whole[variable, j] /= divisor
            if not math.isfinite(whole[variable, j]):
                return False
    return True


def _solve(program: _Program) -> tuple[Array, float] | None:
    """Return the step and its violation, which is zero if the constraints can be satisfied."""
    check_time()
    seconds = min(_LONGEST, remaining())
    # First with the constraints as they are.
    rows, low, high = program.rows, program.low, program.high
    found = minimum(program.cost, rows, (low, high), (program.lower, program.upper), seconds)
    if isinstance(found, np.ndarray):
        return found, 0.0
    if found != INFEASIBLE:
        return None
    # If infeasible, minimise one elastic variable that relaxes every constraint.
    above, below = np.isfinite(high), np.isfinite(low)
    every = sparse.vstack([rows[above], -rows[below]])
    elastic = sparse.csr_array(sparse.hstack([every, sparse.csr_matrix(-np.ones((every.shape[0], 1)))]))
    limits = np.concatenate([high[above], -low[below]])
    box = np.append(program.lower, 0.0), np.append(program.upper, np.inf)
    cost = np.append(np.zeros(len(program.cost)), 1.0)
    found = minimum(cost, elastic, (np.full(len(limits), -np.inf), limits), box, seconds)
    return (found[:-1], float(found[-1])) if isinstance(found, np.ndarray) else None
