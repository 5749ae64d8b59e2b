"""A random split of samples: 70 % for training, 15 % for validation and 15 % for the test.

Neighbouring samples are similar, so the test error measures interpolation within the records, not another record.

Reference: clutch thesis, 5.2.2.1.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

__all__ = ["Split", "random_split"]

VALIDATION = TEST = 0.15


@dataclass(frozen=True, eq=False)
class Split:
    """Sample numbers of each part, rising; together every sample once."""

    training: NDArray[np.intp]
    validation: NDArray[np.intp]
    test: NDArray[np.intp]


def random_split(n: int, seed: int | np.random.Generator) -> Split:
    """Return a random split of n samples.

    Examples
    --------
    >>> split = random_split(200, seed=1)
    >>> split.training.size, split.validation.size, split.test.size
    (140, 30, 30)
    """
    order = np.random.default_rng(seed).permutation(n)
    first, second = round(VALIDATION * n), round((VALIDATION + TEST) * n)
    validation, test, training = np.split(order, [first, second])
    return Split(np.sort(training), np.sort(validation), np.sort(test))
