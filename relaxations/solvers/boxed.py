"""A conic program with every moment held within [-1, 1], as the moments of points of the scaled box are.

Nothing changes for a feasible point, and much for a solver: the dual of the wider program is::

    maximise  -b'z - sum_i |r_i|,    r = q + A'z,    z in K*,

the certificate's own bound (:mod:`relaxations.proof.certificate`), and it has interior points whatever the relaxation
looks like. So a solver that diverges on the program itself, for no dual point is feasible or the optimum is not
attained, maximises what will be certified. The price is two rows for each moment.

References
----------
C. Jansson, D. Chaykin and C. Keil, "Rigorous error bounds for the optimal value in semidefinite programming", SIAM J.
Numer. Anal. 46 (2007) 180-200: bounds on the primal variables make any dual vector useful.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy import sparse

from relaxations.algebra.ball_arithmetic import Index
from relaxations.moments.conic import ConicProgram


def boxed(program: ConicProgram) -> tuple[ConicProgram, Index]:
    """Return the wider program, and where the rows of the given one stand in it.

    Returns
    -------
    wider : ConicProgram
        With two nonnegative rows more for each moment; its slices are those of the given one.
    rows : ndarray of int, shape (n_rows,)

    Examples
    --------
    >>> from relaxations.moments.conic import Cones
    >>> program = ConicProgram(sparse.csc_matrix([[-1.0]]), np.array([2.0]), Cones(0, 1, (), ()), ())  # 2 + y >= 0
    >>> wider, rows = boxed(program)
    >>> wider.rhs - wider.matrix @ np.array([0.5])  # and 1 - y >= 0, 1 + y >= 0
    array([2.5, 0.5, 1.5])
    >>> rows
    array([0])
    """
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
