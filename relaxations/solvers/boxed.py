"""A conic program with the additional bounds -1 <= y_i <= 1 for every moment.

The moments of points in the scaled box satisfy these bounds, so no feasible point is lost. The dual program becomes::

    maximise  -b'z - sum_i |r_i|,    r = q + A'z,    z in K*.

Its objective is the bound of the certificate (:mod:`relaxations.proof.certificate`), and it always has interior points.
The original dual program may have no feasible point, or its optimum may not be attained. A solver that fails on the
original program often solves the bounded one. The cost is two rows for each moment.

References
----------
C. Jansson, D. Chaykin and C. Keil, "Rigorous error bounds for the optimal value in semidefinite programming", SIAM J.
Numer. Anal. 46 (2007) 180-200: bounds on the primal variables make any dual vector useful.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy import sparse

from relaxations.algebra.arrays import Index
from relaxations.moments.conic import ConicProgram


def boxed(program: ConicProgram) -> tuple[ConicProgram, Index]:
    """Return the program with bounds of the moments, and the position of each original row in it."""
    n, before = program.matrix.shape[1], program.cones.zero + program.cones.nonnegative
    matrix, identity = sparse.csr_matrix(program.matrix), sparse.identity(n, format="csr")
    wider = replace(
        program,
        matrix=sparse.csc_matrix(sparse.vstack([matrix[:before], identity, -identity, matrix[before:]])),
        rhs=np.concatenate([program.rhs[:before], np.ones(2 * n), program.rhs[before:]]),
        cones=replace(program.cones, nonnegative=program.cones.nonnegative + 2 * n),
    )
    rows = np.arange(program.n_rows)
    return wider, rows + np.where(rows < before, 0, 2 * n)
