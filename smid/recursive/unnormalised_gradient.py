"""Unnormalised gradient, also called least mean squares.

    K[t] = gamma phi[t]                                                                              (3.29), (3.34)

Stability: the error of sample t is multiplied by ``1 - gamma |phi[t]|^2``. With constant parameters and no noise the
parameter error never grows while ``gamma <= 2 / max |phi[t]|^2``. A gain for the largest regressors is too small for
all others, so the thesis found the method useless "for all possible values" of the gain. Gain 1, which suits the
normalised gradient, is far above this limit on the thesis's records.

Reference: clutch thesis, section 3.3.2; Ljung, System Identification, 2nd ed., section 11.4.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from relaxations.algebra.arrays import Array
from smid.recursive.gradient import check_gain, retake
from smid.recursive.method import Method

__all__ = ["UnnormalisedGradient"]


@dataclass(frozen=True)
class UnnormalisedGradient(Method):
    """The unnormalised gradient, (3.34).

    Parameters
    ----------
    gain
        Adaptation gain gamma, positive, in one per squared unit of the regressors; stable below `largest_gain`.

    Raises
    ------
    ModelError
        If the gain is not a positive number.

    Examples
    --------
    >>> print(UnnormalisedGradient(1e-3))
    unnormalised gradient, gain 0.001
    """

    gain: float

    def __post_init__(self) -> None:
        check_gain(self.gain)

    def largest_gain(self, regressors: Array) -> float:
        """Return the gain below which the parameter error cannot grow, from regressors of shape (N, n)."""
        largest = float(np.square(regressors).sum(axis=1).max())
        return 2 / largest if largest else math.inf

    def start(self, n: int) -> Array:  # noqa: ARG002
        """Return an empty state."""
        return np.empty(0)

    def correct(self, memory: Array, phi: Array) -> tuple[Array, Array]:
        """Return the gain and the state."""
        return self._gain(phi), memory

    def hold(self, memory: Array, phi: Array, error: float, change: Array, held: Array) -> Array:  # noqa: ARG002
        """Return the change of all parameters with the first ones fixed."""
        return retake(self._gain, phi, error, held)

    def _gain(self, phi: Array) -> Array:
        return phi * self.gain

    def __str__(self) -> str:
        return f"unnormalised gradient, gain {self.gain:.3g}"
