"""Ctrl-C during a study ends the whole study, because its parts are only useful together."""

from __future__ import annotations

from typing import Protocol, TypeVar

from relaxations.search.enclosure import Reason

__all__ = ["finished"]


class Computed(Protocol):
    """A result with the reason why its computation stopped."""

    @property
    def reason(self) -> Reason:
        """Return why it stopped."""
        ...


T = TypeVar("T", bound=Computed)


def finished(result: T) -> T:
    """Return a result; raise KeyboardInterrupt if the user interrupted it.

    Identification alone returns what is proven so far.
    """
    if result.reason is Reason.INTERRUPTED:
        raise KeyboardInterrupt
    return result
