"""The running median, over a window of samples that is kept sorted.

The centred filter of order n replaces sample t by the median of samples ``t - floor(n/2)`` to ``t + ceil(n/2) - 1``,
so it needs future samples. The causal filter takes the last n samples and delays a rise or fall by ``(n - 1) / 2``
samples. At the ends of a record the window is shorter.

Reference: clutch thesis, 5.2.4 (orders 50 and 250).
"""

from __future__ import annotations

from bisect import bisect_left, insort
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from relaxations.algebra.arrays import Array
from smid.data import DataError
from smid.models import ModelError
from smid.sensors.program import Block, Code, both_ends
from smid.sensors.ranges import Range, joined
from smid.sensors.tensor import Tensor

__all__ = ["Median", "RunningMedian", "centred_median", "check_order", "check_record"]


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


@dataclass(frozen=True)
class Median(Block):
    """The median of the last samples, or the centred one of a whole record.

    Parameters
    ----------
    order
        Samples in the window. The memory holds the last ones, and is shorter at the start of a record.
    causal
        Whether the window ends at the present sample; else each block of samples is taken to be a record.
    """

    order: int
    causal: bool = True

    def rest(self, first: Sequence[Array]) -> Array:  # noqa: ARG002
        """Return the empty window; see `Block.rest`."""
        return np.zeros(0)

    def advance(self, signals: Sequence[Array], memory: Array) -> tuple[Array, Array]:
        """Return the medians; see `Block.advance`."""
        if not self.causal:
            return centred_median(signals[0], self.order), memory
        median = RunningMedian(self.order)
        for sample in memory.tolist():
            median.update(sample)
        values = np.array([median.update(sample) for sample in signals[0].tolist()])
        return values, np.concatenate([memory, signals[0]])[-self.order :]

    def enclose(self, signals: Sequence[Range], memory: Range, cells: int) -> tuple[Range, Range]:  # noqa: ARG002
        """Return the medians of lower and upper bounds; see `Block.enclose`."""
        window = joined([memory, signals[0][None]])[-self.order :]
        return Range(*(np.asarray(np.median(end)) for end in (window.lower, window.upper))), window

    def onnx(self, signals: Sequence[Tensor], memory: Tensor) -> tuple[Tensor, Tensor]:  # noqa: ARG002
        """Refuse: the window grows until it is full; see `Block.onnx`."""
        raise ModelError("ONNX cannot hold the growing window of a median: export C, or a sensor without the filter")

    def code(self, name: str, signals: Sequence[str]) -> Code:
        """Return a ring of samples and their sorted copy; see `Block.code`."""
        if not self.causal:
            raise ModelError(
                "a centred median needs future samples, which C does not have: take causal=True, which has a delay"
            )
        n = self.order
        # m[0] counts the samples, m[1] is the place of the next, then the ring, then the sorted window.
        return Code(
            update=(
                f"{{ double *ring = m + 2, *sorted = m + {2 + n};\n"
                "  int n = (int) m[0], at = (int) m[1], k;\n"
                f"  if (n == {n}) {{\n"
                "    k = 0;\n"
                "    while (sorted[k] != ring[at]) k++;\n"
                "    n--;\n"
                "    for (; k < n; k++) sorted[k] = sorted[k + 1];\n"
                "  }\n"
                f"  for (k = n; k > 0 && sorted[k - 1] > {signals[0]}; k--) sorted[k] = sorted[k - 1];\n"
                f"  sorted[k] = ring[at] = {signals[0]};\n"
                "  n++;\n"
                f"  m[0] = n; m[1] = (at + 1) % {n};\n"
                f"  {name} = n % 2 ? sorted[n / 2] : 0.5 * (sorted[n / 2 - 1] + sorted[n / 2]); }}"
            ),
            size=2 + 2 * n,
            rest="m[0] = m[1] = 0.0;",
        )

    def range_code(self, name: str, signals: Sequence[str]) -> Code:
        """Return the medians of both ends; see `Block.range_code`."""
        return both_ends(self, name, signals)
