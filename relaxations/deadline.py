"""A time limit that code at any depth sees without a parameter: one clock, one check, one exception.

A public call sets the limit with :func:`limited` or :func:`time_limit`. Loops and long steps below it call
:func:`check_time`, and every solver gets :func:`remaining` as its own limit. :class:`TimeIsUp` then travels the way of
a ``KeyboardInterrupt``: the public call catches both, and returns what is proven. Limits nest, and the earliest counts.
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


class TimeIsUp(Exception):
    """The time that the caller allowed is used up.

    Examples
    --------
    >>> try:
    ...     with time_limit(1e-9):
    ...         check_time()
    ... except TimeIsUp as stop:
    ...     print(stop)
    the time allowed is used up
    """

    def __init__(self, message: str = "the time allowed is used up") -> None:
        super().__init__(message)  # with the message as argument, so that it can be pickled


STOPS = (TimeIsUp, KeyboardInterrupt, MemoryError)
"""What ends a computation early. Who catches them returns what is proven so far."""


@dataclass(frozen=True)
class _Deadline:
    """An instant of ``time.monotonic()``."""

    at: float

    def __reduce__(self) -> tuple[Callable[[float], _Deadline], tuple[float]]:
        # A process on another machine has a monotonic clock of its own. The wall clocks agree.
        return _from_wall_clock, (time.time() + self.at - time.monotonic(),)


def _from_wall_clock(instant: float) -> _Deadline:
    return _Deadline(time.monotonic() + instant - time.time())


_NO_LIMIT = _Deadline(inf)
_current: ContextVar[_Deadline] = ContextVar("deadline", default=_NO_LIMIT)


def check_seconds(seconds: float) -> None:
    """Refuse a time limit that is not a positive number, before any work.

    Parameters
    ----------
    seconds
        Infinite for no limit.

    Raises
    ------
    ProblemError
        For anything else, NaN included.

    Examples
    --------
    >>> check_seconds(60)
    >>> try:
    ...     check_seconds(0)
    ... except ProblemError as error:
    ...     print(error)
    seconds = 0 is refused: give a positive number of seconds, or leave it out for no time limit
    """
    if not (isinstance(seconds, Real) and seconds > 0):  # refused where it is NaN, too
        raise ProblemError(
            f"seconds = {seconds} is refused: give a positive number of seconds, or leave it out for no time limit"
        )


@contextmanager
def time_limit(seconds: float) -> Iterator[None]:
    """Limit the time of a ``with`` block; an earlier limit around it stays.

    Parameters
    ----------
    seconds
        Positive; infinite for no limit.

    Yields
    ------
    None

    Raises
    ------
    ProblemError
        For zero, a negative number or NaN.

    Examples
    --------
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
    """Return a function that runs under the time limit that its keyword ``seconds`` states.

    Examples
    --------
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
    """Return the seconds that are left; infinite without a limit, and never negative.

    Examples
    --------
    >>> remaining()
    inf
    """
    return max(_current.get().at - time.monotonic(), 0.0)


def check_time(needed: float = 0.0) -> None:
    """Raise :class:`TimeIsUp` where less time is left than the next step needs.

    Parameters
    ----------
    needed
        Estimate, in seconds, for a step that nothing can end early.

    Raises
    ------
    TimeIsUp

    Examples
    --------
    >>> with time_limit(60):
    ...     check_time()
    """
    if remaining() <= needed:
        raise TimeIsUp


def stopped_by(stop: BaseException) -> str:
    """Return ``"TIME"``, ``"MEMORY"`` or ``"INTERRUPTED"``: the name of the reason that one of `STOPS` stands for.

    Examples
    --------
    >>> stopped_by(TimeIsUp()), stopped_by(KeyboardInterrupt())
    ('TIME', 'INTERRUPTED')
    """
    return "TIME" if isinstance(stop, TimeIsUp) else "MEMORY" if isinstance(stop, MemoryError) else "INTERRUPTED"


def map_in_time(
    executor: Executor | None, function: Callable[[Given], Result], items: Iterable[Given]
) -> Iterator[Result]:
    """Yield ``function(item)`` for each item, on an executor's workers where one is given, within the time limit.

    Parameters
    ----------
    executor
        None computes each result here, when it is asked for.

    Yields
    ------
    object
        In the order of the items.

    Raises
    ------
    TimeIsUp
        As soon as the time is used up. What has not begun is cancelled; what runs sees the same limit.

    Examples
    --------
    >>> from concurrent.futures import ThreadPoolExecutor
    >>> with time_limit(60), ThreadPoolExecutor(2) as pool:
    ...     list(map_in_time(pool, abs, [-1, 2, -3]))
    [1, 2, 3]
    """
    if executor is None:
        yield from map(function, items)
        return
    deadline = _current.get()
    left = None if deadline.at == inf else remaining()  # an executor takes no infinite one
    try:
        yield from executor.map(_Carried(function, deadline), items, timeout=left)
    except TimeoutError:
        raise TimeIsUp from None


@dataclass(frozen=True)
class _Carried:
    """A function that runs elsewhere under the limit of the thread that asked for it."""

    function: Callable[[Any], Any]
    deadline: _Deadline

    def __call__(self, item: Any) -> Any:
        token = _current.set(self.deadline)
        try:
            return self.function(item)
        finally:
            _current.reset(token)
