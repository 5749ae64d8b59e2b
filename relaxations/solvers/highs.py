"""HiGHS, called through scipy, for linear programs only.

Every moment is bounded by [-1, 1], as in :mod:`relaxations.solvers.boxed`, so every program is bounded. If the program
is infeasible, a second program minimises the sum of all violations. Its dual vector is the Farkas ray.

References
----------
Q. Huangfu and J. A. J. Hall, "Parallelizing the dual revised simplex method", Mathematical Programming Computation 10
(2018) 119-142.
"""

from __future__ import annotations

import numpy as np
from scipy import sparse
from scipy.optimize import linprog

from relaxations.algebra.arrays import Array
from relaxations.deadline import remaining
from relaxations.moments.conic import ConicProgram
from relaxations.solvers.stop import Stop

_STOPS = {0: Stop.SOLVED, 1: Stop.LIMIT, 2: Stop.INFEASIBLE, 3: Stop.UNBOUNDED, 4: Stop.FAILED}


def run(_solver: str, program: ConicProgram, objective: Array) -> tuple[Stop, str, Array, Array]:
    """Return a solution of a linear program; see :mod:`relaxations.solvers.interface`."""
    zero, n = program.cones.zero, program.matrix.shape[1]
    rows = sparse.csr_matrix(program.matrix)
    code, words, moments, dual = _solve(rows, program.rhs, zero, objective, np.full((n, 2), [-1.0, 1.0]))
    if _STOPS[code] is Stop.INFEASIBLE:
        # Columns: y, slacks of all rows, and slacks of the other sign for equalities.
        slack = sparse.identity(program.n_rows, format="csr")
        wider = sparse.hstack([rows, -slack, slack[:, :zero]], format="csr")
        cost = np.concatenate([np.zeros(n), np.ones(program.n_rows + zero)])
        box = np.concatenate([np.full((n, 2), [-1.0, 1.0]), np.full((program.n_rows + zero, 2), [0.0, np.inf])])
        *_, dual = _solve(wider, program.rhs, zero, cost, box)
    return _STOPS[code], words, moments, dual


def _solve(rows: sparse.csr_matrix, rhs: Array, zero: int, cost: Array, box: Array) -> tuple[int, str, Array, Array]:
    """Return status, message, primal and dual vector; NaN for vectors that HiGHS does not return."""
    found = linprog(  # type: ignore[call-overload]
        cost,
        A_eq=rows[:zero],
        b_eq=rhs[:zero],
        A_ub=rows[zero:],
        b_ub=rhs[zero:],
        bounds=box,
        method="highs",
        # HiGHS's presolve (1.12 to 1.15) crashes the process on some programs.
        options={"presolve": False, "time_limit": remaining()},
    )
    if found.x is None or found.status not in (0, 1):
        return found.status, found.message, np.full(len(cost), np.nan), np.full(len(rhs), np.nan)
    dual = -np.concatenate([found.eqlin.marginals, found.ineqlin.marginals])
    return found.status, found.message, found.x, dual
