"""Calls into an effect that may fail: an effect of a user's own costs only itself, never the diagnosis."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, TypeVar

from relaxations.deadline import STOPS

Result = TypeVar("Result")


@dataclass(frozen=True)
class Failure:
    """Why an effect could not be used.

    Parameters
    ----------
    effect
        Its name.
    reason
        Type and message of the exception, in one line.
    """

    effect: str
    reason: str


def guarded(effect: str, function: Callable[..., Result], *arguments: Any) -> Result | Failure:
    """Return what a function that calls an effect returns, or the failure of the effect.

    Examples
    --------
    >>> guarded("leak", float, "1.5")
    1.5
    >>> guarded("leak", float, "much").reason
    "ValueError: could not convert string to float: 'much'"
    """
    try:
        return function(*arguments)
    except STOPS:
        raise
    except Exception as error:  # an effect may raise anything
        return Failure(effect, f"{type(error).__name__}: {' '.join(str(error).split())}".removesuffix(": "))
