"""The error for an invalid model."""

from __future__ import annotations

from collections.abc import Iterable
from difflib import get_close_matches

from relaxations.errors import UserError

__all__ = ["ModelError", "refuse_unknown"]


class ModelError(UserError):
    """A model or a request to it is invalid; the message names the cause and the cure.

    Examples
    --------
    >>> raise ModelError("signal 'w' is defined twice: remove one of its lines")
    Traceback (most recent call last):
        ...
    smid.models.errors.ModelError: signal 'w' is defined twice: remove one of its lines
    """


def refuse_unknown(kind: str, given: Iterable[str], valid: Iterable[str]) -> None:
    """Refuse names that are not among the valid ones, and propose the nearest.

    Examples
    --------
    >>> refuse_unknown("option", ["stabel"], ["stable", "bounds"])
    Traceback (most recent call last):
        ...
    smid.models.errors.ModelError: unknown option 'stabel', did you mean 'stable'? Choose from: stable, bounds
    """
    allowed = list(valid)
    for name in given:
        if name not in allowed:
            near = get_close_matches(name, allowed, n=1)
            hint = f", did you mean {near[0]!r}?" if near else "."
            raise ModelError(f"unknown {kind} {name!r}{hint} Choose from: {', '.join(allowed)}")
