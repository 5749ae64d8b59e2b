"""Searches on top of relaxations: contraction, cuts and branching for intervals and for minima."""

from relaxations.search.boxes import DerivedBox, derive_box
from relaxations.search.branching import branch_and_bound
from relaxations.search.enclosure import Enclosure, Interval, Proof, Reason
from relaxations.search.hierarchy import intervals
from relaxations.search.minimum import Minimum, minimise

__all__ = [
    "DerivedBox",
    "Enclosure",
    "Interval",
    "Minimum",
    "Proof",
    "Reason",
    "branch_and_bound",
    "derive_box",
    "intervals",
    "minimise",
]
