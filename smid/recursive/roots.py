"""Triangular square roots of covariance and information matrices, by QR.

A matrix that is stored as ``U'U`` cannot become indefinite by rounding, and U needs half the digits. Rows below U are
added to the matrix: ``[U; A]' [U; A] = U'U + A'A``, and QR makes the stack triangular again.

Reference: Kailath, Sayed, Hassibi, Linear Estimation, 2000, chapter 12.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from scipy.linalg.lapack import dgeqrf

from relaxations.algebra.arrays import Array

__all__ = ["triangular"]


def triangular(stacked: Array) -> Array:
    """Return the upper triangular root, shape (n, n), with the same product with its own transpose.

    `stacked` has shape (m, n) with m >= n. The signs of the rows of the root are arbitrary.
    """
    n = stacked.shape[1]
    # numpy.linalg.qr takes several times as long as the rest of an update.
    upper: Array = dgeqrf(stacked)[0][:n]
    return upper * _triangle(n)


@lru_cache(maxsize=64)
def _triangle(n: int) -> Array:
    return np.triu(np.ones((n, n)))
