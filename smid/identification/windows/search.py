"""What windows need to know of a record: which samples hold the ends of the intervals, and which parameters fit all."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Protocol

from relaxations.algebra.arrays import Array, Index


@dataclass(frozen=True, eq=False)
class Held:
    """What holds the ends.

    Parameters
    ----------
    places
        Shape (n, 2). Experiment and sample.
    length
        So many samples before each of them count.
    fitting
        Parameters that are verified to fit all samples, some of them near each end.
    """

    places: Index
    length: int
    fitting: tuple[Array, ...]


class Search(Protocol):
    """A search without proof through the parameters that fit a whole record.

    A DataError says that it does not work on this record.
    """

    def held(self, tolerance: float) -> Held:
        """Return what holds the ends, so that windows leave open at most this share of each width."""

    def near(self, values: Mapping[str, float], tolerance: float) -> tuple[tuple[Array, ...], Index]:
        """Return verified parameters within this share of the way from given ones, or else places that object.

        The places have shape (n, 2).
        """

    def fits(self, values: Mapping[str, float]) -> bool:
        """Return whether parameters are verified to fit all samples."""
