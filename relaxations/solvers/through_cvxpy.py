"""Any conic solver of cvxpy, by name."""

from __future__ import annotations

import warnings
from typing import Any

import cvxpy as cp
import numpy as np

from relaxations.algebra.arrays import Array
from relaxations.deadline import remaining
from relaxations.moments.conic import ConicProgram
from relaxations.solvers.stop import Stop

_STOPS = {
    "optimal": Stop.SOLVED,
    "optimal_inaccurate": Stop.INEXACT,
    "infeasible": Stop.INFEASIBLE,
    "infeasible_inaccurate": Stop.INFEASIBLE,
    "unbounded": Stop.UNBOUNDED,
    "unbounded_inaccurate": Stop.UNBOUNDED,
    "user_limit": Stop.LIMIT,
}

# Option of each solver for its time limit; a solver that is not listed has none.
_LIMITS = {
    "CLARABEL": "time_limit",
    "HIGHS": "time_limit",
    "OSQP": "time_limit",
    "SCS": "time_limit_secs",
    "COPT": "TimeLimit",
    "GUROBI": "TimeLimit",
    "XPRESS": "timelimit",
}


def run(solver: str, program: ConicProgram, objective: Array) -> tuple[Stop, str, Array, Array]:
    """Return a solution by one of cvxpy's solvers; see :mod:`relaxations.solvers.interface`."""
    y = cp.Variable(program.matrix.shape[1])
    slack = program.rhs - program.matrix @ y
    # One cvxpy constraint for each cone, in the order of the rows.
    constraints: list[Any] = []
    position = 0
    for count, build in ((program.cones.zero, cp.Zero), (program.cones.nonnegative, cp.NonNeg)):
        if count:
            constraints.append(build(slack[position : position + count]))
            position += count
    for size in program.cones.second_order:
        constraints.append(cp.SOC(slack[position], slack[position + 1 : position + size]))
        position += size
    for width in program.cones.semidefinite:
        height = width * (width + 1) // 2
        constraints.append(cp.PSD(_matrix(slack[position : position + height], width)))
        position += height
    problem = cp.Problem(cp.Minimize(objective @ y), constraints)
    try:
        with warnings.catch_warnings():
            # The status reports an inaccurate solution, and the certificate bounds its error.
            warnings.filterwarnings("ignore", message="Solution may be inaccurate", category=UserWarning)
            problem.solve(solver=solver, **_limit(solver))
    except cp.SolverError as error:
        return Stop.FAILED, str(error), np.full(y.shape, np.nan), np.full(program.n_rows, np.nan)
    stop = _STOPS.get(str(problem.status), Stop.FAILED)
    x = np.full(y.shape, np.nan) if y.value is None else np.asarray(y.value)
    return stop, str(problem.status), x, _dual(constraints, program)


def _limit(solver: str) -> dict[str, float]:
    """Return the solver's own option for the remaining time."""
    left, name = remaining(), _LIMITS.get(solver.upper())
    return {} if name is None or np.isinf(left) else {name: left}


def _matrix(triangle: Any, width: int) -> Any:
    """Return the symmetric matrix of a scaled upper triangle, columns stacked."""
    spread = np.zeros((width * width, width * (width + 1) // 2))
    j, i = np.tril_indices(width)
    value = np.where(i == j, 1.0, np.sqrt(0.5))
    place = np.arange(len(i))
    spread[i * width + j, place] = value
    spread[j * width + i, place] = value
    return cp.reshape(spread @ triangle, (width, width), order="C")


def _dual(constraints: list[Any], program: ConicProgram) -> Array:
    """Return the duals in the order of the rows; NaN if the solver returned none."""
    parts = []
    for constraint in constraints:
        value = constraint.dual_value
        if value is None:
            return np.full(program.n_rows, np.nan)
        if isinstance(constraint, cp.Zero):
            # cvxpy's sign of an equality's dual is opposite to that of A y + s = b.
            parts.append(-np.asarray(value).ravel())
        elif isinstance(constraint, cp.PSD):
            matrix = np.asarray(value)
            j, i = np.tril_indices(matrix.shape[0])
            parts.append(matrix[i, j] * np.where(i == j, 1.0, np.sqrt(2.0)))
        elif isinstance(constraint, cp.SOC):
            parts.append(np.concatenate([np.ravel(v) for v in value]))
        else:
            parts.append(np.asarray(value).ravel())
    return np.concatenate(parts) if parts else np.zeros(0)
