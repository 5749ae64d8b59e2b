"""Clarabel, called without a modelling layer: the matrices are already in its form."""

from __future__ import annotations

import clarabel
import numpy as np
from scipy import sparse

from relaxations.balls import Array
from relaxations.conic import ConicProgram
from relaxations.solvers.stop import Stop

TOLERANCE = 1e-11  # asked for so that little is lost to the certificate; mostly Clarabel stops a little short of it

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
}

# Ten times its own: a worse linear system, refined as usual, that does not break down near a degenerate optimum.
REGULARISATION = 1e-7


def run(_solver: str, program: ConicProgram, objective: Array, setting: str = "") -> tuple[Stop, str, Array, Array]:
    """Solve; see :func:`relaxations.solvers.solve`.

    Parameters
    ----------
    _solver : str
        Its own name.
    program : ConicProgram
    objective : ndarray, shape (n_moments - 1,)
        Without the constant.
    setting : {"", "regularised"}

    Returns
    -------
    stop : Stop
    status : str
        The solver's own word.
    moments : ndarray, shape (n_moments - 1,)
    dual : ndarray, shape (n_rows,)

    Examples
    --------
    >>> from relaxations.conic import Cones
    >>> program = ConicProgram(sparse.csc_matrix([[-1.0]]), np.array([1.0]), Cones(0, 1, (), ()), ())  # 1 + y >= 0
    >>> stop, status, moments, dual = run("clarabel", program, np.array([1.0]))
    >>> stop.name, moments.round(4), dual.round(4)
    ('SOLVED', array([-1.]), array([1.]))
    """
    settings = clarabel.DefaultSettings()
    if setting == "regularised":
        settings.static_regularization_constant = REGULARISATION
    settings.verbose = False
    settings.max_threads = 1
    settings.tol_gap_abs = settings.tol_gap_rel = settings.tol_feas = TOLERANCE
    # faer factorises the dense corners of semidefinite problems tens of times faster than qdldl.
    settings.direct_solve_method = "faer" if program.cones.semidefinite else "qdldl"
    cones = [clarabel.ZeroConeT(program.cones.zero), clarabel.NonnegativeConeT(program.cones.nonnegative)]
    cones += [clarabel.SecondOrderConeT(size) for size in program.cones.second_order]
    cones += [clarabel.PSDTriangleConeT(width) for width in program.cones.semidefinite]
    n = program.matrix.shape[1]
    solver = clarabel.DefaultSolver(
        sparse.csc_matrix((n, n)), objective, sparse.csc_matrix(program.matrix), program.rhs, cones, settings
    )
    try:
        solution = solver.solve()
    except BaseException as failure:
        # Clarabel panics where it cannot decompose a block; no class that could be imported stands for that.
        if type(failure).__name__ != "PanicException":
            raise
        return Stop.FAILED, "Panic", np.full(n, np.nan), np.full(program.n_rows, np.nan)
    status = str(solution.status)
    return _STOPS.get(status, Stop.FAILED), status, np.array(solution.x), np.array(solution.z)
