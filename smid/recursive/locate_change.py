"""When a certified change happened: the shortest stretch of samples that no constant parameters explain.

A set that becomes empty at sample s proves that the plant changed after the set was begun, which may be long ago.  Sets
begun later and later, over the same samples, prove it of shorter and shorter stretches; the latest start from which the
set still becomes empty is found by doubling and bisection.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from smid.data import DataError
from smid.recursive.set_history import Change
from smid.recursive.set_membership import RecursiveSet

__all__ = ["locate_change"]


def locate_change(estimator: RecursiveSet, change: Change, input: ArrayLike, output: ArrayLike) -> Change:
    """Prove a change of a shorter stretch of samples.

    Parameters
    ----------
    estimator
        That found the change; its settings are used again.
    input, output
        Shape (N,). The record that the estimator has seen, from its first sample on.

    Returns
    -------
    Change
        With `after` as late as was found: the first sample of the changed plant lies beyond it, and not beyond
        `sample`.

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
    if u.ndim != 1 or u.shape != y.shape or u.size <= change.sample:
        raise DataError(
            f"the record has shapes {u.shape} and {y.shape}: give input and output up to sample {change.sample}"
        )

    def proven(after: int) -> Change | None:
        fresh, first = estimator.anew(), after - estimator.arx.max_lag
        for k in range(first, change.sample + 1):
            if fresh.update(float(u[k]), float(y[k])) is not None:
                return Change(after, k)
        return None

    best, after, step = change, change.sample, 1
    while after > change.after:
        found = proven(after)
        if found is not None:
            best = found
            break
        after, step = max(after - step, change.after), 2 * step
    low, high = best.after, min(best.after + step // 2, change.sample)  # proven from low, not from high
    while high - low > 1:
        middle = (low + high) // 2
        found = proven(middle)
        if found is None:
            high = middle
        else:
            best, low = found, middle
    return best
