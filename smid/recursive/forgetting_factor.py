"""Recursive least squares with exponential forgetting.

    K[t] = P[t-1] phi[t] / (lambda + phi[t]' P[t-1] phi[t])                                          (3.29), (3.30)
    P[t] = (P[t-1] - P[t-1] phi[t] phi[t]' P[t-1] / (lambda + phi[t]' P[t-1] phi[t])) / lambda       (3.31)

With the information matrix R = P^-1: ``R[t] = lambda R[t-1] + phi[t] phi[t]'``, ``K[t] = R[t]^-1 phi[t]``.
The memory is about ``1 / (1 - lambda)`` samples.

Safeguard against wind-up: without excitation in a direction, R falls to zero there, P grows without bound, and the next
excitation causes a large parameter error. The forgotten information is therefore replaced by the initial information:

    R[t] = lambda R[t-1] + (1 - lambda) R[0] + phi[t] phi[t]',   R[0] = spread^-2

Hence ``P <= P[0]`` at every sample and in every direction. Excited directions are forgotten as in (3.31), which a bound
on the trace of P would not ensure. ``stabilised=False`` is (3.31) as printed. The parameters after sample t minimise

    sum_k lambda^(t-k) ((y[k] - phi[k]' theta)^2 + (1 - lambda) |theta - theta[k-1]|^2_R[0])
        + lambda^t |theta - theta[0]|^2_R[0]

Safeguard against rounding: the triangular root U of ``R = U'U`` is stored, so R is positive definite.

Reference: clutch thesis, section 3.3.2; Ljung, System Identification, 2nd ed., section 11.2; Kulhavy and Zarrop, "On a
general concept of forgetting", Int. J. Control 58 (1993) (stabilised forgetting); Gunnarsson, "Combining tracking and
regularization in recursive least squares identification", 35th IEEE Conf. on Decision and Control (1996).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from scipy.linalg.lapack import dpotrs

from relaxations.algebra.arrays import Array
from smid.models import ModelError
from smid.recursive.deviations import Deviation, check_deviation, deviations
from smid.recursive.method import Method
from smid.recursive.roots import triangular

__all__ = ["ForgettingFactor"]


@dataclass(frozen=True)
class ForgettingFactor(Method):
    """Recursive least squares with exponential forgetting, (3.30)-(3.31).

    Parameters
    ----------
    factor
        lambda, in (0, 1]. With 1 nothing is forgotten, and the result equals batch least squares.
    spread
        Standard deviation of the parameters at the start, for noise of standard deviation one; one for all or one for
        each.  ``P[0]`` is its square, and P never exceeds ``P[0]`` if it is stabilised.
    stabilised
        Whether forgotten information is replaced; if not, (3.31) as printed, which winds up without excitation.

    Raises
    ------
    ModelError
        If a setting is out of range.

    Examples
    --------
    >>> print(ForgettingFactor(0.99))
    forgetting factor 0.99
    """

    factor: float = 0.995
    spread: Deviation = 100.0
    stabilised: bool = True

    def __post_init__(self) -> None:
        if not 0 < self.factor <= 1:
            raise ModelError(f"factor = {self.factor} is not a forgetting factor: give a number above 0, at most 1")
        object.__setattr__(self, "spread", check_deviation("spread", self.spread))

    def start(self, n: int) -> Array:
        """Return the root of R[0], shape (n, n)."""
        return np.diag(1 / deviations("spread", self.spread, n))

    def correct(self, memory: Array, phi: Array) -> tuple[Array, Array]:
        """Return K[t] and the root of R[t]."""
        rows = [math.sqrt(self.factor) * memory, phi[None]]
        if self.stabilised:
            rows.append(_replaced(self.factor, self.spread, phi.size))
        root = triangular(np.concatenate(rows))
        return dpotrs(root, phi)[0], root

    def hold(self, memory: Array, phi: Array, error: float, change: Array, held: Array) -> Array:  # noqa: ARG002
        """Return the change of all parameters that minimises the same cost with the first ones fixed."""
        m = held.size
        slope = np.linalg.lstsq(memory[:, m:], memory[:, :m], rcond=None)[0]
        return np.concatenate([held, change[m:] - slope @ (held - change[:m])])

    def __str__(self) -> str:
        return f"forgetting factor {self.factor:g}{'' if self.stabilised else ', as printed'}"


@lru_cache(maxsize=64)
def _replaced(factor: float, spread: Deviation, n: int) -> Array:
    """Return the root of (1 - lambda) R[0], which is the same at every sample."""
    return math.sqrt(1 - factor) * np.diag(1 / deviations("spread", spread, n))
