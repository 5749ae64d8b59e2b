"""A time limit for code at any depth, without a parameter: one clock, one check, one exception.

A public function sets the limit with :func:`limited` or :func:`time_limit`. Loops and long steps inside it call
:func:`check_time`, and every solver gets :func:`remaining` as its own limit. At the limit, :class:`TimeIsUp` is raised.
The public function catches this exception and ``KeyboardInterrupt``, and returns what is proven. If limits are nested,
the earliest applies.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Executor
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass
from functools import wraps
from math import inf
from numbers import Real
from typing import Any, ParamSpec, TypeVar, cast

from relaxations.errors import ProblemError

Given = TypeVar("Given")
Result = TypeVar("Result")
Arguments = ParamSpec("Arguments")

Progress = Callable[[str], None]
"""What long work calls with a line of text now and then."""


class TimeIsUp(Exception):
    """Raised when the time limit is reached."""

    def __init__(self, message: str = "the time allowed is used up") -> None:
        super().__init__(message)  # the argument makes the exception picklable


STOPS = (TimeIsUp, KeyboardInterrupt, MemoryError)
"""What ends a computation early. Who catches them returns what is proven so far."""


@dataclass(frozen=True)
class _Deadline:
    """An instant of ``time.monotonic()``."""

    at: float

    def __reduce__(self) -> tuple[Callable[[float], _Deadline], tuple[float]]:
        """Return the deadline as wall-clock time, because the monotonic clock of another machine differs."""
        return _from_wall_clock, (time.time() + self.at - time.monotonic(),)


def _from_wall_clock(instant: float) -> _Deadline:
    """Return the deadline on this machine's monotonic clock."""
    return _Deadline(time.monotonic() + instant - time.time())


_NO_LIMIT = _Deadline(inf)
_current: ContextVar[_Deadline] = ContextVar("deadline", default=_NO_LIMIT)


def check_seconds(seconds: float) -> None:
    """Refuse a time limit that is not a positive number, by a ProblemError; infinity means no limit."""
    if not (isinstance(seconds, Real) and seconds > 0):  # NaN is refused, too
        raise ProblemError(
            f"seconds = {seconds} is refused: give a positive number of seconds, or leave it out for no time limit"
        )


@contextmanager
def time_limit(seconds: float) -> Iterator[None]:
    """Limit the time of a ``with`` block; an earlier limit outside the block remains.

    >>> with time_limit(60):
    ...     with time_limit(3600):
    ...         print(remaining() <= 60)
    True
    """
    check_seconds(seconds)
    token = _current.set(_Deadline(min(time.monotonic() + seconds, _current.get().at)))
    try:
        yield
    finally:
        _current.reset(token)


def limited(function: Callable[Arguments, Result]) -> Callable[Arguments, Result]:
    """Return a function that runs under the time limit of its keyword argument ``seconds``.

    >>> @limited
    ... def left(*, seconds=inf):
    ...     return remaining()
    >>> left(), left(seconds=60) <= 60
    (inf, True)
    """

    @wraps(function)
    def in_time(*arguments: Arguments.args, **keywords: Arguments.kwargs) -> Result:
        with time_limit(cast(float, keywords.get("seconds", inf))):
            return function(*arguments, **keywords)

    return in_time


def remaining() -> float:
    """Return the remaining seconds; infinite without a limit, and never negative."""
    return max(_current.get().at - time.monotonic(), 0.0)


def check_time(needed: float = 0.0) -> None:
    """Raise :class:`TimeIsUp` if less time remains than ``needed`` seconds, for a step without interruption."""
    if remaining() <= needed:
        raise TimeIsUp


def stopped_by(stop: BaseException) -> str:
    """Return ``"TIME"``, ``"MEMORY"`` or ``"INTERRUPTED"`` for one of the exceptions in `STOPS`."""
    return "TIME" if isinstance(stop, TimeIsUp) else "MEMORY" if isinstance(stop, MemoryError) else "INTERRUPTED"


def map_in_time(
    executor: Executor | None, function: Callable[[Given], Result], items: Iterable[Given]
) -> Iterator[Result]:
    """Yield ``function(item)`` for each item in order, on an executor if one is given, within the time limit.

    At the limit, tasks that have not started are cancelled, and TimeIsUp is raised. Running tasks have the same limit.
    Without an executor, each result is computed when it is requested.

    >>> from concurrent.futures import ThreadPoolExecutor
    >>> with time_limit(60), ThreadPoolExecutor(2) as pool:
    ...     list(map_in_time(pool, abs, [-1, 2, -3]))
    [1, 2, 3]
    """
    if executor is None:
        yield from map(function, items)
        return
    deadline = _current.get()
    left = None if deadline.at == inf else remaining()  # an executor does not accept infinity
    try:
        yield from executor.map(_Carried(function, deadline), items, timeout=left)
    except TimeoutError:
        raise TimeIsUp from None


@dataclass(frozen=True)
class _Carried:
    """A function that runs in another thread or process under the time limit of the caller."""

    function: Callable[[Any], Any]
    deadline: _Deadline

    def __call__(self, item: Any) -> Any:
        token = _current.set(self.deadline)
        try:
            return self.function(item)
        finally:
            _current.reset(token)
