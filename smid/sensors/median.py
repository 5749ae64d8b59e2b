"""The running median, over a window of samples that is kept sorted.

The centred filter of order n replaces sample t by the median of samples ``t - floor(n/2)`` to ``t + ceil(n/2) - 1``,
so it needs future samples. The causal filter takes the last n samples and delays a rise or fall by ``(n - 1) / 2``
samples. At the ends of a record the window is shorter.

Reference: clutch thesis, 5.2.4 (orders 50 and 250).
"""

from __future__ import annotations

from bisect import bisect_left, insort
from collections import deque

import numpy as np

from relaxations.algebra.arrays import Array
from smid.data import DataError
from smid.models import ModelError

__all__ = ["RunningMedian", "causal_median", "centred_median", "check_order", "check_record"]


class RunningMedian:
    """The median of the last `order` samples.

    Examples
    --------
    >>> median = RunningMedian(3)
    >>> [median.update(x) for x in (5.0, 1.0, 2.0, 9.0)]
    [5.0, 3.0, 2.0, 2.0]
    """

    def __init__(self, order: int) -> None:
        self._order = order
        self._window: deque[float] = deque()
        self._sorted: list[float] = []

    def update(self, sample: float) -> float:
        """Take the next sample and return the median."""
        if len(self._window) == self._order:
            self.drop()
        self._window.append(sample)
        insort(self._sorted, sample)
        return self.value

    def drop(self) -> None:
        """Remove the oldest sample."""
        del self._sorted[bisect_left(self._sorted, self._window.popleft())]

    @property
    def value(self) -> float:
        """The median; of an even number of samples the mean of the middle two."""
        half = len(self._sorted) // 2
        return self._sorted[half] if len(self._sorted) % 2 else 0.5 * (self._sorted[half - 1] + self._sorted[half])


def check_order(order: int) -> None:
    """Raise a `ModelError` if the order is not a whole number of at least 1."""
    if not isinstance(order, int | np.integer) or order < 1:
        raise ModelError(f"order = {order} of the median: give a number of samples, such as 50")


def check_record(n: int, order: int) -> None:
    """Raise a `DataError` if the order exceeds the n samples of a record, a `ModelError` as `check_order` does."""
    check_order(order)
    if order > n:
        raise DataError(
            f"a median of order {order} is longer than the record of {n} samples: "
            "give a lower order, or a longer record"
        )


def centred_median(signal: Array, order: int) -> Array:
    """Return a record filtered by the centred median, shape (n,); raise as `check_record` does.

    Examples
    --------
    >>> centred_median(np.array([1.0, 9.0, 2.0, 3.0]), 3)
    array([5. , 2. , 3. , 2.5])
    """
    check_record(signal.size, order)
    ahead = order - order // 2 - 1
    median, result = RunningMedian(order), []
    for k, sample in enumerate(signal.tolist()):
        value = median.update(sample)
        if k >= ahead:
            result.append(value)
    for _ in range(ahead):
        median.drop()
        result.append(median.value)
    return np.array(result)


def causal_median(signal: Array, order: int) -> Array:
    """Return a record filtered by the median of the last samples, shape (n,); raise as `check_record` does.

    Examples
    --------
    >>> causal_median(np.array([1.0, 9.0, 2.0, 3.0]), 3)
    array([1., 5., 2., 3.])
    """
    check_record(signal.size, order)
    median = RunningMedian(order)
    return np.array([median.update(sample) for sample in signal.tolist()])
