"""SDPA, called through ``sdpa-python`` below its modelling layer; optional, because its licence is the GPL.

The program has SeDuMi's form, ``minimise b'z : A'z = -q``, where z is the dual vector. Multipliers of equalities are
differences of two nonnegative variables. Second-order cones of size 3 are blocks of width 2. Semidefinite blocks are
full matrices.

References
----------
M. Yamashita, K. Fujisawa and M. Kojima, "Implementation and evaluation of SDPA 6.0", Optimization Methods and Software
18 (2003) 491-505.
"""

from __future__ import annotations

import numpy as np
from scipy import sparse

from relaxations.algebra.arrays import Array
from relaxations.moments.conic import Cones, ConicProgram
from relaxations.solvers.capture import captured
from relaxations.solvers.stop import Stop

TOLERANCE = 1e-7  # of gap and feasibility: the default; a smaller one makes SDPA stop early more often

_STOPS = {
    "pdOPT": Stop.SOLVED,
    "pdFEAS": Stop.INEXACT,
    "pFEAS": Stop.INEXACT,
    "dFEAS": Stop.INEXACT,
    "noINFO": Stop.INEXACT,
    # Its primal problem is the dual of ours.
    "pUNBD": Stop.INFEASIBLE,
    "pFEAS_dINF": Stop.INFEASIBLE,
    "dUNBD": Stop.UNBOUNDED,
    "pINF_dFEAS": Stop.UNBOUNDED,
    "pdINF": Stop.INFEASIBLE,  # primal or dual; the certificate decides
}


def run(_solver: str, program: ConicProgram, objective: Array) -> tuple[Stop, str, Array, Array]:
    """Return a solution; see :mod:`relaxations.solvers.interface`."""
    # Imported here, because the package is optional.
    from sdpap.param import param
    from sdpap.sdpacall import sdpacall
    from sdpap.symcone import SymCone

    full, widths = _in_full(program.cones)
    columns = sparse.csc_matrix((full @ program.matrix).T)
    cost = full @ program.rhs
    free = program.cones.zero
    columns = sparse.csc_matrix(sparse.hstack([columns[:, :free], -columns[:, :free], columns[:, free:]]))
    cost = np.concatenate([cost[:free], -cost[:free], cost[free:]])
    options = {"print": "no", "numThreads": 1, "epsilonStar": TOLERANCE, "epsilonDash": TOLERANCE}
    with captured(1) as drop:  # the library prints in spite of its option
        drop.append("its log")
        z, y, _, info = sdpacall.solve_sdpa(
            columns,
            sparse.csc_matrix(-objective.reshape(-1, 1)),
            sparse.csc_matrix(cost.reshape(-1, 1)),
            SymCone(l=2 * free + program.cones.nonnegative, s=widths),
            param(options, sdpacall.get_backend_info()["gmp"]),
        )
    z, y = z.toarray().ravel(), y.toarray().ravel()
    dual = full.T @ np.concatenate([z[:free] - z[free : 2 * free], z[2 * free :]])
    status = str(info["phasevalue"])
    return _STOPS.get(status, Stop.FAILED), status, y, dual


def _in_full(cones: Cones) -> tuple[sparse.csr_matrix, tuple[int, ...]]:
    """Return the matrix from our rows to those of SDPA, and the block widths; its transpose maps a dual back."""
    from_lorentz = sparse.csr_matrix([[0.5, 0.5, 0.0], [0.0, 0.0, 0.5], [0.0, 0.0, 0.5], [0.5, -0.5, 0.0]])
    parts = [sparse.identity(cones.zero + cones.nonnegative), *[from_lorentz] * len(cones.second_order)]
    for width in cones.semidefinite:
        j, i = np.tril_indices(width)
        place, off = np.arange(len(i)), i != j
        rows = np.concatenate([i * width + j, (j * width + i)[off]])
        values = np.where(off, np.sqrt(0.5), 1.0)
        entries = (np.concatenate([values, values[off]]), (rows, np.concatenate([place, place[off]])))
        parts.append(sparse.csr_matrix(entries, shape=(width * width, len(i))))
    return sparse.csr_matrix(sparse.block_diag(parts)), (*[2] * len(cones.second_order), *cones.semidefinite)
