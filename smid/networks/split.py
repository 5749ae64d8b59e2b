"""Which samples train, which stop the training, and which only measure it: 70, 15 and 15 % at random.

Neighbouring samples of a record are alike, so the test part tells how well a network interpolates within its records,
not how it does on another one.

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
    """Sample numbers of each part.

    Parameters
    ----------
    training, validation, test
        Rising; together every sample once.
    """

    training: NDArray[np.intp]
    validation: NDArray[np.intp]
    test: NDArray[np.intp]


def random_split(n: int, seed: int | np.random.Generator) -> Split:
    """Draw 70 % of samples for training, 15 % for validation and 15 % for the test.

    Parameters
    ----------
    n
        Number of samples.
    seed
        Of the draw.

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
