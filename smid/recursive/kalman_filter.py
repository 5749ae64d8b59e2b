"""Kalman filter for parameters that follow a random walk.

    theta[t] = theta[t-1] + w[t],   cov w = R1;      y[t] = phi[t]' theta[t] + e[t],   var e = R2
    K[t] = P[t-1] phi[t] / (R2 + phi[t]' P[t-1] phi[t])                                              (3.29), (3.32)
    P[t] = P[t-1] + R1 - P[t-1] phi[t] phi[t]' P[t-1] / (R2 + phi[t]' P[t-1] phi[t])                 (3.33)

Without drift the parameters are the mean of the Bayes posterior (regularised least squares).

The thesis scales R1 and P[0] "such that R2 is equal to zero". With R2 = 0 the updated model fits every sample exactly
for any data (``phi[t]' K[t] = 1``), so the a posteriori error is useless. Scaling makes R2 one, not zero. Here the
settings are standard deviations in the units of parameters and output. The noise is positive, or zero as printed.

Safeguard against wind-up: without excitation in a direction, the drift makes P grow there without bound, and the next
excitation causes a large parameter error. The update ``P <- A P A + R1`` with ``A^2 = 1 - R1 / P[0]`` maps P[0] to
itself. Hence ``P <= P[0]`` at every sample and in every direction. With a wide spread the update is close to (3.33).
``stabilised=False`` is (3.33) as printed: A is one.

Safeguard against rounding: the triangular root U of ``P = U'U`` is stored, so P is positive definite. One QR
factorisation includes the sample and the drift (A and D are diagonal):

    | r      0   |         | s   s K' A |        s^2   = R2 + phi' P phi,   r^2 = R2
    | U phi  U A |  =  Q   | 0   U+     |        K     = P phi / s^2
    | 0      D   |         | 0   0      |        U+'U+ = A (P - P phi phi' P / s^2) A + R1,   D^2 = R1

Reference: clutch thesis, section 3.3.2; Ljung, System Identification, 2nd ed., section 11.2; Kailath, Sayed, Hassibi,
Linear Estimation, 2000, chapter 12 (array form).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from relaxations.algebra.arrays import Array
from smid.models import ModelError
from smid.recursive.deviations import Deviation, check_deviation, deviations
from smid.recursive.method import Method
from smid.recursive.roots import triangular

__all__ = ["KalmanFilter"]


@dataclass(frozen=True)
class KalmanFilter(Method):
    """The Kalman filter for parameters that follow a random walk, (3.32)-(3.33).

    Parameters
    ----------
    drift
        Standard deviation of a parameter's change from sample to sample, ``R1 = drift^2``; one for all or one for each.
        Zero for a constant parameter.
    noise
        Standard deviation of the noise, ``R2 = noise^2``, in the output's unit.
    spread
        Standard deviation of the parameters at the start, ``P[0] = spread^2``; one for all or one for each. P never
        exceeds ``P[0]`` if the filter is stabilised.
    stabilised
        Whether P is bounded; if not, (3.33) as printed, which winds up without excitation, and takes noise 0.

    Raises
    ------
    ModelError
        If a setting is out of range.

    Examples
    --------
    >>> print(KalmanFilter(drift=0.01))
    Kalman filter, drift 0.01, noise 1
    """

    drift: Deviation
    noise: float = 1.0
    spread: Deviation = 100.0
    stabilised: bool = True

    def __post_init__(self) -> None:
        if not (0 <= self.noise < math.inf) or (self.stabilised and self.noise == 0):
            raise ModelError(
                f"noise = {self.noise} is refused: give a positive standard deviation; without noise the updated model "
                "fits every sample exactly, for any data (stabilised=False takes 0, as the thesis)"
            )
        object.__setattr__(self, "drift", check_deviation("drift", self.drift, zero=True))
        object.__setattr__(self, "spread", check_deviation("spread", self.spread))

    def start(self, n: int) -> Array:
        """Return the root of P[0], shape (n, n)."""
        drift, spread = deviations("drift", self.drift, n), deviations("spread", self.spread, n)
        if self.stabilised and not (drift < spread).all():
            raise ModelError("a drift is not below its spread: give a larger spread or a smaller drift")
        return np.diag(spread)

    def correct(self, memory: Array, phi: Array) -> tuple[Array, Array]:
        """Return K[t] and the root of P[t]."""
        n = phi.size
        stacked = np.zeros((2 * n + 1, n + 1), order="F")
        stacked[0, 0] = self.noise
        stacked[1 : n + 1, 0] = memory.dot(phi)
        drift, drawn_back = _drift(self.drift, self.spread, n, self.stabilised)
        stacked[1 : n + 1, 1:] = memory * drawn_back
        stacked[n + 1 :, 1:] = drift
        root = triangular(stacked)
        if root[0, 0] == 0:  # no noise, and nothing is uncertain along phi
            return np.zeros(n), root[1:, 1:]
        return root[0, 1:] / (root[0, 0] * drawn_back), root[1:, 1:]

    def hold(self, memory: Array, phi: Array, error: float, change: Array, held: Array) -> Array:  # noqa: ARG002
        """Return the change of all parameters with the first ones fixed, by their covariance."""
        m = held.size
        slope = np.linalg.lstsq(memory[:, :m], memory[:, m:], rcond=None)[0]
        return np.concatenate([held, change[m:] + (held - change[:m]) @ slope])

    def __str__(self) -> str:
        drift = f", drift {self.drift:.3g}" if isinstance(self.drift, float) else ""
        return f"Kalman filter{drift}, noise {self.noise:.3g}{'' if self.stabilised else ', as printed'}"


@lru_cache(maxsize=64)
def _drift(drift: Deviation, spread: Deviation, n: int, stabilised: bool) -> tuple[Array, Array]:
    """Return D and the diagonal of A, which are the same at every sample."""
    steps = deviations("drift", drift, n)
    if not stabilised:
        return np.diag(steps), np.ones(n)
    return np.diag(steps), np.asarray(np.sqrt(1 - np.square(steps / deviations("spread", spread, n))))
