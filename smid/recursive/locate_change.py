"""Location of a certified change: a short interval of samples that no constant parameters explain.

A set that becomes empty at sample s proves a change after the start of the set, which may be long before s. Sets with a
later start prove it for a shorter interval. The latest such start is found by doubling and bisection.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from smid.data import DataError
from smid.recursive.set_history import Change
from smid.recursive.set_membership import RecursiveSet

__all__ = ["locate_change"]


def locate_change(estimator: RecursiveSet, change: Change, input: ArrayLike, output: ArrayLike) -> Change:
    """Return the same change, certified for a shorter interval of samples.

    Parameters
    ----------
    estimator
        The estimator that found the change. Its settings are used again.
    input, output
        Shape (N,), several inputs (N, inputs). The record from the estimator's first sample on.

    Raises
    ------
    DataError
        If the record ends before the change.

    Examples
    --------
    >>> from smid.recursive import Arx
    >>> u = np.tile([1.0, -1.0, -1.0, 1.0, 1.0], 20)
    >>> w = np.zeros(100)
    >>> for t in range(1, 100):
    ...     w[t] = 0.8 * w[t - 1] + u[t - 1] if t < 60 else 0.6 * w[t - 1] + u[t - 1]
    >>> estimator = RecursiveSet(Arx(), 0.01, {"b0": (-10.0, 10.0)})
    >>> changes = [estimator.update(*sample) for sample in zip(u, w)]
    >>> located = locate_change(estimator, estimator.history.changes[0], u, w)
    >>> estimator.history.changes[0].after, located.after < 60 <= located.sample < 65, located.after > 50
    (1, True, True)
    """
    u, y = np.asarray(input, dtype=np.float64), np.asarray(output, dtype=np.float64)
    if y.ndim != 1 or u.shape[:1] != y.shape or y.size <= change.sample:
        raise DataError(
            f"the record has shapes {u.shape} and {y.shape}: give input and output up to sample {change.sample}"
        )

    def proven(after: int) -> Change | None:
        fresh, first = estimator.anew(), after - estimator.arx.max_lag
        for k in range(first, change.sample + 1):
            if fresh.update(u[k].tolist(), float(y[k])) is not None:
                return Change(after, k)
        return None

    # Double the length of the interval until the change is proven.
    best, after, step = change, change.sample, 1
    while after > change.after:
        found = proven(after)
        if found is not None:
            best = found
            break
        after, step = max(after - step, change.after), 2 * step
    low, high = best.after, min(best.after + step // 2, change.sample)
    # Bisect: the change is proven from `low`, but not from `high`.
    while high - low > 1:
        middle = (low + high) // 2
        found = proven(middle)
        if found is None:
            high = middle
        else:
            best, low = found, middle
    return best
