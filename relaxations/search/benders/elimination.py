"""The linear program at fixed outer variables, where the equalities give all but a few inner variables.

Along a recursion each equality is the first to read one inner variable. So the matrix of these variables is lower
triangular, and they are affine functions of the few that are left, as a free run is of its initial state and its gains.
The linear program has as many unknowns then, and two rows for each sample. Few rows matter: it is solved on some of
them, and the most violated ones join until none is left. Its multipliers give those of the equalities by one more
triangular system. So the time is proportional to the length of a record, however slow the poles.
"""

from __future__ import annotations

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import splu

from relaxations.algebra.arrays import Array, Index
from relaxations.search.benders.master import least

FEWEST = 500  # equalities: below, a solver of all rows is as fast
MOST_LEFT = 30  # inner variables beside those that the equalities give
LARGE = 1e6  # a larger response to an inner variable leaves too few digits
FIRST, MORE, ROUNDS = 200, 50, 40  # rows of the first program, rows that join, and programs
CLOSE = 1e-9


def eliminated(constant: Array, matrix: sparse.csc_matrix, slack: Array) -> tuple[float, Array, Array] | None:
    """Return the least s with ``constant + matrix z = 0``, ``|z| <= 1 + s`` and ``slack + s >= 0``.

    With it come z, and the multipliers of the equalities and of the inequalities. None where the equalities do not
    give all but a few z, or the numbers are too large.
    """
    pivots = _pivots(matrix)
    if pivots is None:
        return None
    left = np.setdiff1d(np.arange(matrix.shape[1]), pivots)
    block = splu(sparse.csc_matrix(matrix[:, pivots]), permc_spec="NATURAL", diag_pivot_thresh=0.0)
    response = -block.solve(np.column_stack([constant, matrix[:, left].toarray()]))
    if not np.abs(response).max(initial=0.0) < LARGE:
        return None
    # All z as affine functions of those that are left, x.
    n, r = matrix.shape[1], len(left)
    begin, slope = np.zeros(n), np.zeros((n, r))
    begin[pivots], slope[pivots] = response[:, 0], response[:, 1:]
    slope[left] = np.eye(r)
    # Minimise s over x on some rows: 1 + s - z >= 0 and 1 + s + z >= 0.
    rows = np.unique(np.concatenate([left, np.linspace(0, n - 1, FIRST).astype(np.int64)]))
    cost = np.append(np.zeros(r), 1.0)
    floor = np.append(np.full(r, -LARGE), max(-1.0, float(-slack.min(initial=1.0))))
    for _ in range(ROUNDS):
        value = np.concatenate([1.0 - begin[rows], 1.0 + begin[rows]])
        gradient = np.column_stack([np.concatenate([-slope[rows], slope[rows]]), np.ones(len(value))])
        found = least(cost, value, gradient, floor, np.full(r + 1, LARGE))
        if found is None:
            return None
        x, s = found.point[:-1], float(found.point[-1])
        z = begin + slope @ x
        beyond = np.abs(z) - 1.0 - s
        if beyond.max() <= CLOSE * (1.0 + abs(s)):
            break
        worst = np.argpartition(beyond, -MORE)[-MORE:]
        rows = np.union1d(rows, worst[beyond[worst] > 0])
    else:
        return None
    # Multipliers of the bounds of z, and by the transposed system those of the equalities.
    weights = np.zeros(n)
    np.add.at(weights, rows, found.weights[: len(rows)] - found.weights[len(rows) :])
    of_slack = np.zeros(len(slack))
    if len(slack) and (rest := 1.0 - float(found.weights.sum())) > CLOSE:
        of_slack[np.argmin(slack)] = rest
    of_equalities = block.solve(weights[pivots], trans="T")  # type: ignore[call-overload]
    return s, z, np.concatenate([of_equalities, of_slack])


def _pivots(matrix: sparse.csc_matrix) -> Index | None:
    """Return for each row a variable that no row before it reads; None where there is none, or too many are left."""
    count, n = matrix.shape
    if not (count >= FEWEST and n - count <= MOST_LEFT):
        return None
    sorted_matrix = matrix.sorted_indices()
    sorted_matrix.eliminate_zeros()
    used = np.flatnonzero(np.diff(sorted_matrix.indptr))
    first = sorted_matrix.indices[sorted_matrix.indptr[used]]
    size = np.abs(sorted_matrix.data[sorted_matrix.indptr[used]])
    # The largest one of those that a row reads first.
    order = np.lexsort((size, first))
    rows, last = np.unique(first[order][::-1], return_index=True)
    return used[order[::-1][last]] if len(rows) == count else None
