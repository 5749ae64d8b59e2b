"""Clarabel, called directly with the matrices of the conic program."""

from __future__ import annotations

import time
from dataclasses import dataclass

import clarabel
import numpy as np
from scipy import sparse

from relaxations.algebra.arrays import Array
from relaxations.deadline import check_time, remaining
from relaxations.moments.conic import Cones, ConicProgram
from relaxations.solvers.capture import captured
from relaxations.solvers.stop import Stop

TOLERANCE = 1e-11  # tight, for an accurate certificate; Clarabel often stops slightly above it

_STOPS = {
    "Solved": Stop.SOLVED,
    "AlmostSolved": Stop.INEXACT,
    "InsufficientProgress": Stop.INEXACT,
    "NumericalError": Stop.INEXACT,
    "PrimalInfeasible": Stop.INFEASIBLE,
    "AlmostPrimalInfeasible": Stop.INFEASIBLE,
    "DualInfeasible": Stop.UNBOUNDED,
    "AlmostDualInfeasible": Stop.UNBOUNDED,
    "MaxIterations": Stop.LIMIT,
    "MaxTime": Stop.LIMIT,
    "CallbackTerminated": Stop.LIMIT,
}

# Ten times Clarabel's default: the linear systems are less accurate, and do not fail near a degenerate optimum.
REGULARISATION = 1e-7

# Seconds per cube of a block's number of entries: set-up and each iteration factorise a dense matrix over them.
_EACH = 1e-10


def run(_solver: str, program: ConicProgram, objective: Array, setting: str = "") -> tuple[Stop, str, Array, Array]:
    """Return a solution; see :mod:`relaxations.solvers.interface`. Settings: ``"regularised"``.

    Raises
    ------
    TimeIsUp
        When set-up and first iteration, which cannot be interrupted, would take longer than the remaining time.
    """
    check_time(2 * _iteration(program.cones))
    settings = clarabel.DefaultSettings()
    if setting == "regularised":
        settings.static_regularization_constant = REGULARISATION
    settings.verbose = False
    settings.max_threads = 1
    settings.time_limit = remaining()
    settings.tol_gap_abs = settings.tol_gap_rel = settings.tol_feas = TOLERANCE
    # faer factorises the dense corners of semidefinite problems tens of times faster than qdldl.
    settings.direct_solve_method = "faer" if program.cones.semidefinite else "qdldl"
    # The cones are in Clarabel's order, and so are the rows of each.
    cones = [clarabel.ZeroConeT(program.cones.zero), clarabel.NonnegativeConeT(program.cones.nonnegative)]
    cones += [clarabel.SecondOrderConeT(size) for size in program.cones.second_order]
    cones += [clarabel.PSDTriangleConeT(width) for width in program.cones.semidefinite]
    n = program.matrix.shape[1]
    watch = _Watch()
    with captured(2) as drop:
        try:
            solver = clarabel.DefaultSolver(
                sparse.csc_matrix((n, n)), objective, sparse.csc_matrix(program.matrix), program.rhs, cones, settings
            )
            solver.set_termination_callback(watch)
            solution = solver.solve()
        except BaseException as failure:
            # Clarabel panics if it cannot decompose a block. The exception has no importable class. Its message on
            # standard error is meant for developers, and is dropped.
            if type(failure).__name__ != "PanicException":
                raise
            drop.append("panic")
            return Stop.FAILED, "Panic", np.full(n, np.nan), np.full(program.n_rows, np.nan)
    if watch.stop is not None:
        raise watch.stop
    status = str(solution.status)
    return _STOPS.get(status, Stop.FAILED), status, np.array(solution.x), np.array(solution.z)


def _iteration(cones: Cones) -> float:
    """Return a rough estimate of the seconds of one iteration."""
    return _EACH / 3 * sum((width * (width + 1) // 2) ** 3 for width in cones.semidefinite)


@dataclass
class _Watch:
    """Callback between iterations: stops the solver if the next iteration would be late, or after Ctrl-C."""

    last: float = np.inf
    stop: BaseException | None = None

    def __call__(self, _info: object) -> bool:
        try:
            now = time.monotonic()
            took, self.last = now - self.last, now
            return remaining() < took
        except BaseException as stop:  # Clarabel prints an exception of a callback and continues
            self.stop = stop
            return True
