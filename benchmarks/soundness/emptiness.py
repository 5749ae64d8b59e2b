"""An oracle for emptiness that shares nothing with smid: linear programs over cells of the poles.

Within a cell ``|p - p_0| <= h`` of the complicating parameters (the poles; with errors in variables the gain too)

    y_t - e_t + sum_i p_i (y_{t-i} - e_{t-i}) = b (u_t - z_t) + sum_j c_j drive_{t,j}

is relaxed: with ``p_0`` for ``p`` both sides differ by at most ``sum_i h_i (|y_{t-i}| + D) + h_b (|u_t| + D_u)``. That
is linear in the noises, the free coefficients c and D, so the least D over a cell is a linear program, and the least
over all cells is a lower bound of the least noise bound. The cell with the least value is cut in two, again and again.
"""

from __future__ import annotations

import heapq
from dataclasses import dataclass

import numpy as np
from scipy import sparse
from scipy.optimize import linprog


@dataclass(frozen=True)
class Record:
    """What the oracle needs.

    Parameters
    ----------
    y : ndarray, shape (n,)
    drives : ndarray, shape (n, n_drives)
        Row t acts on y_t with free coefficients.
    poles : int
    input, input_bound : ndarray, shape (n,), and float
        Measured input with noise, for errors in variables; empty without.
    gain : float
        Then the gain lies within [-gain, gain].
    """

    y: np.ndarray
    drives: np.ndarray
    poles: int = 1
    input: np.ndarray | None = None
    input_bound: float = 0.0
    gain: float = 0.0


def least_noise_bound(record: Record, programs: int = 150) -> float:
    """Return a lower bound of the least noise bound that any stable parameters allow."""
    reach = np.array([1.0]) if record.poles == 1 else np.array([2.0, 1.0])
    if record.input is not None:
        reach = np.append(reach, record.gain)
    start = (np.zeros(len(reach)), reach)
    heap = [(_least(record, *start), 0, *start)]
    used = 1
    while used + 2 <= programs:
        value, _, centre, half = heapq.heappop(heap)
        cut = int(np.argmax(half / reach))
        for sign in (-1, 1):
            smaller, moved = half.copy(), centre.copy()
            smaller[cut] *= 0.5
            moved[cut] += sign * smaller[cut]
            used += 1
            heapq.heappush(heap, (max(value, _least(record, moved, smaller)), used, moved, smaller))
    return heap[0][0]


def _least(record: Record, centre: np.ndarray, half: np.ndarray) -> float:
    """Return the least D over one cell; columns D, e, z, c."""
    y, n, poles = record.y, len(record.y), record.poles
    rows = np.arange(poles, n)
    noisy = record.input is not None
    residual = sparse.lil_matrix((len(rows), n))
    constant, slack = y[rows].copy(), np.zeros(len(rows))
    residual[np.arange(len(rows)), rows] = -1.0
    for i in range(1, poles + 1):
        residual[np.arange(len(rows)), rows - i] = -centre[i - 1]
        constant += centre[i - 1] * y[rows - i]
        slack += half[i - 1] * np.abs(y[rows - i])
    parts = [residual]
    if record.input is not None:
        inputs = sparse.lil_matrix((len(rows), n))
        inputs[np.arange(len(rows)), rows] = centre[-1]
        constant -= centre[-1] * record.input[rows]
        slack += half[-1] * (np.abs(record.input[rows]) + record.input_bound)
        parts.append(inputs)
    parts.append(sparse.csr_matrix(-record.drives[rows]))
    linear = sparse.hstack(parts)
    widening = sparse.csr_matrix(np.full((len(rows), 1), -half[:poles].sum()))
    one, identity = sparse.csr_matrix(-np.ones((n, 1))), sparse.identity(n)
    rest = linear.shape[1] - n
    empty = sparse.csr_matrix((n, rest))
    found = linprog(
        np.r_[1.0, np.zeros(linear.shape[1])],
        A_ub=sparse.vstack(
            [
                sparse.hstack([widening, linear]),
                sparse.hstack([widening, -linear]),
                sparse.hstack([one, identity, empty]),
                sparse.hstack([one, -identity, empty]),
            ]
        ),
        b_ub=np.concatenate([slack - constant, slack + constant, np.zeros(2 * n)]),
        bounds=[(0, None), *[(None, None)] * n]
        + [(-record.input_bound, record.input_bound)] * (n if noisy else 0)
        + [(None, None)] * record.drives.shape[1],
    )
    return float(found.fun) if found.status == 0 else 0.0
