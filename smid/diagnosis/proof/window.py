"""The window of a record that proofs are about: where the base model errs most.

If a part of a record is infeasible, the whole is. A short window keeps the relaxations small.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from relaxations.algebra.arrays import Array
from smid.data.window import Window

SIZES = (40, 100, 250)
"""Samples of the windows, tried in turn."""


def windows(residual: Sequence[Array], sizes: Sequence[int] = SIZES) -> Iterator[Window]:
    """Yield windows where the errors are largest, small ones first, each the part of the next with the largest squares.

    Parameters
    ----------
    residual
        Shape (n,). Of the base model, per experiment, over the samples that may be used; NaN counts as no error.

    Examples
    --------
    >>> [(w.first, w.last) for w in windows([np.eye(1, 100, 50)[0]], (10, 1000))]
    [(41, 50), (0, 99)]
    """
    errors = [np.nan_to_num(r) for r in residual]
    number = int(np.argmax([np.abs(e).max(initial=0.0) for e in errors]))
    squares = errors[number] ** 2
    found, first, last = list[Window](), 0, squares.size - 1
    for size in sorted({min(size, squares.size) for size in sizes}, reverse=True):
        first += int(np.argmax(np.convolve(squares[first : last + 1], np.ones(size), "valid")))
        last = first + size - 1
        found.append(Window(number, first, last))
    yield from reversed(found)


def longer(window: Window, n: int, sizes: Sequence[int]) -> Iterator[Window]:
    """Yield windows of the first n samples around a shorter one, each within the next.

    Examples
    --------
    >>> [(w.first, w.last) for w in longer(Window(0, 80, 89), 100, (50, 200))]
    [(50, 99), (0, 99)]
    """
    for size in sizes:
        if min(size, n) > len(window):
            size = min(size, n)
            first = min(max(window.first - (size - len(window)) // 2, 0), n - size)
            window = Window(window.experiment, first, first + size - 1)
            yield window
