"""Normalised gradient, also called normalised least mean squares or projection algorithm.

    K[t] = gamma phi[t] / (|phi[t]|^2 + bias)                                                        (3.29), (3.35)

The a posteriori error is e[t] multiplied by ``1 - gamma |phi[t]|^2 / (|phi[t]|^2 + bias)``. With gain 1 and the
thesis's bias of 2.2e-16 this factor is zero in floating point for every record. The thesis's 2e-14 is therefore
rounding, not a measure of a model.

Stability: with constant parameters and no noise the parameter error theta~ obeys

    |theta~[t]|^2 - |theta~[t-1]|^2 <= -gamma (2 - gamma) e[t]^2 / (|phi[t]|^2 + bias)

so it never grows for ``0 < gamma <= 2``, and falls for gamma below 2.

Reference: clutch thesis, section 3.3.2; Goodwin and Sin, Adaptive Filtering, Prediction and Control, 1984, section 3.3.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from relaxations.algebra.arrays import Array
from smid.models import ModelError
from smid.recursive.gradient import check_gain, retake
from smid.recursive.method import Method

__all__ = ["NormalisedGradient"]

_VANISHED = 1e-200
"""Regressors with a smaller squared norm are ignored; possible only without bias."""


@dataclass(frozen=True)
class NormalisedGradient(Method):
    """The normalised gradient, (3.35).

    Parameters
    ----------
    gain
        Adaptation gain gamma, positive; stable below 2.
    bias
        Added to the squared norm to avoid division by zero; not negative, in the squared units of the regressors.

    Raises
    ------
    ModelError
        If a setting is out of range.

    Examples
    --------
    >>> print(NormalisedGradient(0.5))
    normalised gradient, gain 0.5
    """

    gain: float = 1.0
    bias: float = 2.220446049250313e-16

    def __post_init__(self) -> None:
        check_gain(self.gain)
        if not (self.bias >= 0 and math.isfinite(self.bias)):
            raise ModelError(f"bias = {self.bias} is refused: give a number that is not negative")

    def largest_gain(self, regressors: Array) -> float:  # noqa: ARG002
        """Return 2, the gain below which the parameter error cannot grow."""
        return 2.0

    def start(self, n: int) -> Array:  # noqa: ARG002
        """Return an empty state."""
        return np.empty(0)

    def correct(self, memory: Array, phi: Array) -> tuple[Array, Array]:
        """Return the gain (zero for zero regressors) and the state."""
        return self._gain(phi), memory

    def hold(self, memory: Array, phi: Array, error: float, change: Array, held: Array) -> Array:  # noqa: ARG002
        """Return the change of all parameters with the first ones fixed."""
        return retake(self._gain, phi, error, held)

    def _gain(self, phi: Array) -> Array:
        norm = float(phi.dot(phi)) + self.bias
        return phi * (self.gain / norm) if norm > _VANISHED else np.zeros_like(phi)

    @property
    def remark(self) -> str:
        """Return how gain 1 sets the a posteriori error."""
        if self.gain != 1:
            return ""
        return (
            "with gain 1 the updated model fits the present sample exactly, for any data, "
            "so this error is rounding, like the thesis's 2e-14, and does not measure the model"
        )

    def __str__(self) -> str:
        return f"normalised gradient, gain {self.gain:.3g}"
