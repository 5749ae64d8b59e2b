"""Time limits in processor time, so that what is measured does not depend on what else the computer does."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from unittest import mock

__all__ = ["in_processor_time"]

_APART = 0.02  # seconds between two questions to the system, which may take a millisecond each


@contextmanager
def in_processor_time() -> Iterator[None]:
    """Let the time limits of a ``with`` block count the processor time of this process.

    Examples
    --------
    >>> from relaxations.deadline import remaining, time_limit
    >>> with in_processor_time(), time_limit(60):
    ...     time.sleep(0.2)
    ...     print(remaining() > 59.9)
    True
    """
    with mock.patch.object(time, "monotonic", _seldom_asked(time.monotonic)):
        yield


def _seldom_asked(clock: Callable[[], float]) -> Callable[[], float]:
    """Return the processor time as a function, which asks the system only where the clock has moved on."""
    asked, answer = clock(), time.process_time()

    def processor_time() -> float:
        nonlocal asked, answer
        if (now := clock()) > asked + _APART:
            asked, answer = now, time.process_time()
        return answer

    return processor_time
