"""One step of sequential linear programming.

If the equalities define most variables as functions of a few others, these variables are eliminated. Example: the
output noise of a record follows from the parameters and the initial state. So a linear program with thousands of
unknowns becomes one with few unknowns and many inequalities. If more than 30 unknowns remain, for example with input
noise, the sparse program is solved.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import spsolve_triangular

from relaxations.algebra.arrays import Array, Index
from relaxations.algebra.polynomial import Polynomials
from relaxations.deadline import check_time, remaining
from relaxations.points.linear_program import INFEASIBLE, minimum
from relaxations.problem.problem import PolynomialProblem

# The simplex method may cycle at the tolerances of `minimum`, so each program has a time limit. A program that exceeds
# it costs one candidate of the search.
_LONGEST = 5.0  # seconds
_FEW = 30  # unknowns of a dense program, at most


@dataclass(frozen=True)
class _Program:
    """Minimise ``cost @ d`` where ``equal @ d = right``, ``rows @ d <= limits`` and ``lower <= d <= upper``."""

    cost: Array
    equal: sparse.csr_matrix
    right: Array
    rows: sparse.csr_matrix | Array
    limits: Array
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
    cost = _linearised(objective, base)[0].toarray().ravel()
    equal, value = _linearised(problem.equalities, base)
    unequal, slack = _linearised(problem.inequalities, base)
    program = _Program(cost, equal, -value, -unequal, slack - margin, lower - base, upper - base)

    found = _condensed(program, order)
    smaller, whole = (program, np.eye(0)) if found is None else found
    solved = _solve(smaller)
    if solved is None:
        return None
    step, violation = solved
    moved = base + (step if found is None else whole @ np.r_[step, 1.0])
    return moved, violation, float(objective.evaluate(moved)[0])


def _condensed(program: _Program, order: list[tuple[int, int]] | None) -> tuple[_Program, Array] | None:
    """Return the program in the variables that no equality defines, and the map ``d = map @ (free, 1)``.

    None if more than 30 variables remain, or if the equalities do not define the others at this point.
    """
    n = len(program.cost)
    if not order or n - len(order) > _FEW:
        return None
    # Solve the triangular system of the equalities for the defined variables.
    rows, defined = (np.array(side) for side in zip(*order, strict=True))
    free = np.setdiff1d(np.arange(n), defined)
    ordered = program.equal[rows]
    columns = np.column_stack([-ordered[:, free].toarray(), program.right[rows]])
    if (np.abs(ordered[np.arange(len(rows)), defined]) < 1e-12).any():
        return None
    whole = np.zeros((n, free.size + 1))
    whole[free, np.arange(free.size)] = 1.0
    whole[defined] = spsolve_triangular(ordered[:, defined].tocsr(), columns, lower=True)
    if not np.isfinite(whole).all():
        return None
    # Bounds of the defined variables become inequalities in the free ones.
    below, above = np.isfinite(program.lower[defined]), np.isfinite(program.upper[defined])
    limited = [
        (whole[defined][above], program.upper[defined][above]),
        (-whole[defined][below], -program.lower[defined][below]),
        (program.rows @ whole, program.limits),
    ]
    affine = np.concatenate([matrix for matrix, _ in limited])
    limits = np.concatenate([limit for _, limit in limited]) - affine[:, -1]
    nothing = sparse.csr_matrix((0, free.size))
    smaller = _Program(
        (program.cost @ whole)[:-1],
        nothing,
        np.zeros(0),
        affine[:, :-1],
        limits,
        program.lower[free],
        program.upper[free],
    )
    return smaller, whole


def _solve(program: _Program) -> tuple[Array, float] | None:
    """Return the step and its violation, which is zero if the constraints can be satisfied."""
    check_time()
    seconds = min(_LONGEST, remaining())
    # First with the constraints as they are.
    rows = sparse.csr_array(sparse.vstack([program.equal, sparse.csr_matrix(program.rows)]))
    low = np.concatenate([program.right, np.full(len(program.limits), -np.inf)])
    high = np.concatenate([program.right, program.limits])
    found = minimum(program.cost, rows, (low, high), (program.lower, program.upper), seconds)
    if isinstance(found, np.ndarray):
        return found, 0.0
    if found != INFEASIBLE:
        return None
    # If infeasible, minimise one elastic variable that relaxes every constraint.
    every = sparse.vstack([program.equal, -program.equal, sparse.csr_matrix(program.rows)])
    elastic = sparse.csr_array(sparse.hstack([every, sparse.csr_matrix(-np.ones((every.shape[0], 1)))]))
    high = np.concatenate([program.right, -program.right, program.limits])
    box = np.append(program.lower, 0.0), np.append(program.upper, np.inf)
    cost = np.append(np.zeros(len(program.cost)), 1.0)
    found = minimum(cost, elastic, (np.full(len(high), -np.inf), high), box, seconds)
    return (found[:-1], float(found[-1])) if isinstance(found, np.ndarray) else None


def _linearised(polynomials: Polynomials, point: Array) -> tuple[sparse.csr_matrix, Array]:
    """Return the Jacobian and the values at a point."""
    rows, columns, values = polynomials.jacobian(point)
    matrix = sparse.csr_matrix((values, (rows, columns)), shape=(polynomials.n_rows, len(point)))
    return matrix, polynomials.evaluate(point)
