"""Family of inputs: a few numbers define an input, and all inputs have the same amplitude limit."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from relaxations.algebra.arrays import Array
from smid.models import ModelError

__all__ = ["InputFamily"]


@dataclass(frozen=True)
class InputFamily:
    """Inputs defined by a few numbers.

    Parameters
    ----------
    build
        Function from a choice of the numbers, shape (count,), to the input, shape (n,).
    names, lower, upper
        Names and bounds of the numbers.
    amplitude
        Largest absolute value of an input. An input with a larger value is scaled down.

    Raises
    ------
    ModelError
        If the bounds or the amplitude are not valid.

    Examples
    --------
    >>> family = InputFamily("steps", lambda choice: np.repeat(choice, 2), ("first", "second"), (-2, -2), (2, 2), 1.0)
    >>> family.signal([2, -1])
    array([ 1. ,  1. , -0.5, -0.5])
    """

    name: str
    build: Callable[[Array], Array]
    names: tuple[str, ...]
    lower: tuple[float, ...]
    upper: tuple[float, ...]
    amplitude: float

    def __post_init__(self) -> None:
        if not len(self.names) == len(self.lower) == len(self.upper) or not self.names:
            raise ModelError(f"the family {self.name!r} needs as many lower and upper bounds as names, at least one")
        if not all(low < high for low, high in zip(self.lower, self.upper, strict=True)):
            raise ModelError(f"the family {self.name!r} has an empty box: give lower < upper for every number")
        if not (np.isfinite(self.amplitude) and self.amplitude > 0):
            raise ModelError(f"amplitude = {self.amplitude} is not valid: give a positive number in the input's unit")

    def signal(self, choice: ArrayLike) -> Array:
        """Return the input of a choice, shape (n,), scaled to the amplitude limit."""
        u = self.build(np.asarray(choice, dtype=np.float64))
        largest = float(np.abs(u).max())
        return u * (self.amplitude / largest) if largest > self.amplitude else u

    def told(self, choice: Array) -> str:
        """Return a choice as text."""
        return f"{self.name}: " + ", ".join(f"{name} = {x:.4g}" for name, x in zip(self.names, choice, strict=True))

    def draw(self, random: np.random.Generator) -> Array:
        """Return a random choice, uniform in the box."""
        return random.uniform(self.lower, self.upper)

    def near(self, choice: Array, share: float, random: np.random.Generator) -> Array:
        """Return a random choice near another: a normal step, as a share of the box, clipped to the box."""
        size = np.subtract(self.upper, self.lower)
        return np.clip(choice + share * size * random.standard_normal(len(choice)), self.lower, self.upper)
