"""Ctrl-C in the middle of a study ends it: its parts only make sense together."""

from __future__ import annotations

from typing import Protocol, TypeVar

from relaxations.search.hierarchy import Reason

__all__ = ["finished"]


class Computed(Protocol):
    """What says why its computation stopped."""

    @property
    def reason(self) -> Reason:
        """Why it stopped."""
        ...


T = TypeVar("T", bound=Computed)


def finished(result: T) -> T:
    """Return a result, unless the user interrupted it.

    Raises
    ------
    KeyboardInterrupt
        Where it was; identification on its own swallows it to save what is proven.
    """
    if result.reason is Reason.INTERRUPTED:
        raise KeyboardInterrupt
    return result
