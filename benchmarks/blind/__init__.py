"""A blind generator: it hides effects in simulated records, and the diagnosis has to name them."""

from benchmarks.blind.cases import Case, draw
from benchmarks.blind.effects import EFFECTS

__all__ = ["EFFECTS", "Case", "draw"]
