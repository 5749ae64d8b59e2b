"""SCS, called directly: a first-order method for large programs, less accurate than interior-point methods."""

from __future__ import annotations

import numpy as np
from scipy import sparse

from relaxations.algebra.arrays import Array, Index
from relaxations.deadline import remaining
from relaxations.moments.conic import ConicProgram
from relaxations.solvers.stop import Stop

TOLERANCE = 1e-7  # absolute and relative; with the default of 1e-4 a bound loses one or two more digits
ITERATIONS = 20_000

_STOPS = {
    1: Stop.SOLVED,
    2: Stop.INEXACT,
    -1: Stop.UNBOUNDED,
    -2: Stop.INFEASIBLE,
    -6: Stop.UNBOUNDED,
    -7: Stop.INFEASIBLE,
}


def run(_solver: str, program: ConicProgram, objective: Array) -> tuple[Stop, str, Array, Array]:
    """Return a solution; see :mod:`relaxations.solvers.interface`."""
    import scs  # imported here, because the package is optional

    order = _rows(program)
    cones = program.cones
    left = remaining()
    solver = scs.SCS(
        {"A": sparse.csc_matrix(program.matrix)[order], "b": program.rhs[order], "c": objective},
        {"z": cones.zero, "l": cones.nonnegative, "q": list(cones.second_order), "s": list(cones.semidefinite)},
        eps_abs=TOLERANCE,
        eps_rel=TOLERANCE,
        max_iters=ITERATIONS,
        verbose=False,
        time_limit_secs=0.0 if np.isinf(left) else left,  # zero means no limit
    )
    found = solver.solve()
    dual = np.empty(program.n_rows)
    dual[order] = found["y"]
    info = found["info"]
    return _STOPS.get(info["status_val"], Stop.FAILED), str(info["status"]), np.asarray(found["x"]), dual


def _rows(program: ConicProgram) -> Index:
    """Return our row number of each row of SCS, which stacks the lower triangle instead of the upper one."""
    cones = program.cones
    position = cones.zero + cones.nonnegative + sum(cones.second_order)
    parts = [np.arange(position)]
    for width in cones.semidefinite:
        j, i = np.triu_indices(width)  # the lower triangle (i, j), column by column
        parts.append(position + i * (i + 1) // 2 + j)
        position += width * (width + 1) // 2
    return np.concatenate(parts)
