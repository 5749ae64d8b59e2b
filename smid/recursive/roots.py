"""Square roots of covariances and of their inverses, triangular by QR, so that no rounding can make them indefinite.

A matrix that is known as ``U'U`` is symmetric and cannot have a negative eigenvalue, and U has half the digits to lose.
Rows put under U are added to the matrix: ``[U; A]' [U; A] = U'U + A'A``, and QR makes the stack triangular again.

Reference: Kailath, Sayed, Hassibi, Linear Estimation, 2000, chapter 12.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from scipy.linalg.lapack import dgeqrf

from relaxations.algebra.arrays import Array

__all__ = ["triangular"]


def triangular(stacked: Array) -> Array:
    """Give the triangular root with the same product with its own transpose.

    Parameters
    ----------
    stacked
        Shape (m, n). With m >= n.

    Returns
    -------
    ndarray, shape (n, n)
        Upper triangular; the signs of its rows are left as they come.

    Examples
    --------
    >>> root = triangular(np.array([[3.0, 1.0], [4.0, 0.0], [0.0, 2.0]]))
    >>> (root.T @ root).round(12)
    array([[25.,  3.],
           [ 3.,  5.]])
    """
    n = stacked.shape[1]
    # Through numpy.linalg.qr the same would take several times as long as all the rest of an update.
    upper: Array = dgeqrf(stacked)[0][:n]
    return upper * _triangle(n)


@lru_cache(maxsize=64)
def _triangle(n: int) -> Array:
    return np.triu(np.ones((n, n)))
