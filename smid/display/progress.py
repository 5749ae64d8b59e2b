"""Progress of long work: lines that know how much is done, and a bar for terminals and notebooks.

Long work calls a function with a line of text now and then. A `Step` is a line that also knows how many pieces are done
of how many; what is left is estimated from them. Of other lines nobody knows how many follow: the bar shows the line
and the time, and no invented share.
"""

from __future__ import annotations

import shutil
import time
import warnings
from collections.abc import Callable
from functools import wraps
from math import isfinite
from types import TracebackType
from typing import Any, ParamSpec, Self, TypeAlias, TypeVar, cast

from relaxations.deadline import Progress, remaining

Arguments = ParamSpec("Arguments")
Result = TypeVar("Result")

Shows: TypeAlias = Progress | bool | None
"""A function that is called with lines of text, True for a bar, or None (False) for no progress."""

_PAUSE = 0.1  # seconds between two pictures of the bar
_BAR = 12  # letters of the bar itself, and around it, at least


class Step(str):
    """A line of progress that knows how many pieces are done.

    Parameters
    ----------
    what
        What the pieces are, and which one was done.
    left
        Seconds, where the work itself can estimate them; NaN elsewhere.

    Examples
    --------
    >>> Step("runs", 3, 7, left=90.0)
    '3 of 7 runs, about 1.5 min left'
    """

    what: str
    done: int
    total: int
    left: float

    def __new__(cls, what: str, done: int, total: int, left: float = float("nan")) -> Self:
        """Keep the numbers beside the text."""
        step = super().__new__(cls, f"{done} of {total} {what}{_left(left)}")
        step.what, step.done, step.total, step.left = what, done, total, left
        return step


def counted(progress: Progress, what: str, total: int) -> Progress:
    """Return a function that takes a line for each piece, and tells how many are done.

    Examples
    --------
    >>> say = counted(print, "fits", 2)
    0 of 2 fits
    >>> say("gain")
    1 of 2 fits: gain
    """
    done = 0

    def say(line: str) -> None:
        nonlocal done
        done += 1
        progress(Step(f"{what}: {line}", done, total))

    progress(Step(what, 0, total))
    return say


class Bar:
    """A progress bar in a terminal or a notebook. It is gone when the work is done.

    Examples
    --------
    >>> with Bar() as bar:
    ...     bar("fitting the base model")
    ...     bar(Step("runs", 1, 4))
    """

    def __enter__(self) -> Self:
        with warnings.catch_warnings():
            # Without ipywidgets a notebook has a bar of text, and tqdm warns.
            warnings.filterwarnings("ignore", "IProgress not found")
            from tqdm.auto import tqdm
        tqdm.monitor_interval = 0  # its thread would be copied into the processes of a diagnosis
        self._bar: Any = tqdm(total=None, leave=False, bar_format="{desc}", nrows=20)  # some terminals tell no size
        self._began = time.monotonic()
        self._shown = self._began - _PAUSE
        self._first = Step("", 0, 0), self._began  # the first step of a series, and when it came
        self._last = 0
        return self

    def __call__(self, line: str) -> None:
        """Show a line."""
        now = time.monotonic()
        if isinstance(line, Step):
            if line.total != self._first[0].total or line.done < max(self._last, 1):
                self._first = line, now
            self._last = line.done
        if now - self._shown < _PAUSE:
            return
        self._shown = now
        self._bar.ncols = width = shutil.get_terminal_size().columns - 1
        spent = duration(now - self._began)
        if isinstance(line, Step):
            self._bar.total, self._bar.n = line.total, line.done
            tail = f"| {line.done}/{line.total}, {spent}{_left(self._estimate(line, now))}"
            self._bar.bar_format = "{desc} |{bar}" + tail
            self._bar.set_description_str(line.what[: max(width - len(tail) - _BAR, 0)])
            return
        self._bar.total, self._bar.n, self._bar.bar_format = None, 0, "{desc}"
        allowed = f", at most {duration(remaining())} left" if isfinite(remaining()) else ""
        tail = f" ({spent}{allowed})"
        self._bar.set_description_str(line[: max(width - len(tail), 0)] + tail)

    def _estimate(self, step: Step, now: float) -> float:
        """Return the seconds left: the estimate of the work itself, or in proportion to the pieces left."""
        first, began = self._first
        if isfinite(step.left) or step.done == first.done:
            return step.left
        return (now - began) / (step.done - first.done) * (step.total - step.done)

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._bar.close()


def with_bar(function: Callable[Arguments, Result]) -> Callable[Arguments, Result]:
    """Return a function that takes ``progress=True`` for a bar of its own, and False for none.

    Examples
    --------
    >>> @with_bar
    ... def work(*, progress=None):
    ...     return type(progress).__name__
    >>> work(progress=True), work(progress=False), work()
    ('Bar', 'NoneType', 'NoneType')
    """

    @wraps(function)
    def shown(*arguments: Arguments.args, **keywords: Arguments.kwargs) -> Result:
        given = cast(dict[str, Any], keywords)
        if not isinstance(given.get("progress"), bool):
            return function(*arguments, **keywords)
        if not given["progress"]:
            given["progress"] = None
            return function(*arguments, **keywords)
        with Bar() as bar:
            given["progress"] = bar
            return function(*arguments, **keywords)

    return shown


def spoken(progress: Shows) -> Progress | None:
    """Return the function to call inside a function that `with_bar` decorates: no bool is left there."""
    return None if isinstance(progress, bool) else progress


def duration(seconds: float) -> str:
    """Return a time in a unit of its size.

    Examples
    --------
    >>> duration(0.2), duration(90), duration(7200)
    ('1 s', '1.5 min', '2 h')
    """
    if seconds < 60:
        return f"{max(seconds, 1.0):.0f} s"
    return f"{seconds / 60:.2g} min" if seconds < 5400 else f"{seconds / 3600:.2g} h"


def _left(seconds: float) -> str:
    return f", about {duration(seconds)} left" if isfinite(seconds) else ""
