"""Certified intervals of the constants of any plant."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from smid.display.result import Tabular

__all__ = ["CertifiedConstants"]


@dataclass(frozen=True, eq=False, repr=False)
class CertifiedConstants(Tabular):
    """Intervals, by name, that contain the constants of every plant that explains the data."""

    intervals: Mapping[str, tuple[float, float]]

    def centre(self, name: str) -> float:
        """Return the centre of a constant's interval."""
        low, high = self.intervals[name]
        return 0.5 * (low + high)

    def relative_width(self, name: str) -> float:
        """Return the width of a constant's interval relative to its centre."""
        low, high = self.intervals[name]
        return (high - low) / self.centre(name)

    def holds(self, values: Mapping[str, float]) -> bool:
        """Tell whether all the given constants lie inside."""
        return all(low <= values[name] <= high for name, (low, high) in self.intervals.items())
