"""A family of inputs: finitely many numbers to choose, and a limit on the amplitude that every member keeps."""

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
    """Inputs that depend on a few numbers.

    Parameters
    ----------
    build
        Gives the input, shape (n,), for a choice, shape (count,).
    names
        What is chosen.
    lower, upper
        Between which values.
    amplitude
        Largest absolute value of a member; a larger one is scaled down as a whole.

    Raises
    ------
    ModelError
        Where the boxes or the amplitude make no sense.

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
            raise ModelError(f"the family {self.name!r} needs as many lower and upper ends as names, at least one")
        if not all(low < high for low, high in zip(self.lower, self.upper, strict=True)):
            raise ModelError(f"the family {self.name!r} leaves no choice: every lower end must lie below its upper one")
        if not (np.isfinite(self.amplitude) and self.amplitude > 0):
            raise ModelError(f"amplitude = {self.amplitude} is refused: give a positive number in the input's unit")

    def signal(self, choice: ArrayLike) -> Array:
        """Return the input of a choice, within the amplitude.

        Parameters
        ----------
        choice
            Shape (count,).

        Returns
        -------
        ndarray, shape (n,)
        """
        u = self.build(np.asarray(choice, dtype=np.float64))
        largest = float(np.abs(u).max())
        return u * (self.amplitude / largest) if largest > self.amplitude else u

    def told(self, choice: Array) -> str:
        """Return a choice in words."""
        return f"{self.name}: " + ", ".join(f"{name} = {x:.4g}" for name, x in zip(self.names, choice, strict=True))

    def draw(self, random: np.random.Generator) -> Array:
        """Return a choice, uniform in the box."""
        return random.uniform(self.lower, self.upper)

    def near(self, choice: Array, share: float, random: np.random.Generator) -> Array:
        """Return a choice not far from another: a normal step of that share of the box, kept inside."""
        size = np.subtract(self.upper, self.lower)
        return np.clip(choice + share * size * random.standard_normal(len(choice)), self.lower, self.upper)
