"""Time limits in processor time, so that what is measured does not depend on what else the computer does."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager
from unittest import mock

__all__ = ["in_processor_time"]


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
    with mock.patch.object(time, "monotonic", time.process_time):
        yield
