"""What a recursive estimation method is: where it starts, and its gain at each sample.

    theta[t] = theta[t-1] + K[t] e[t],   e[t] = y[t] - phi[t]' theta[t-1]                        (3.25), (3.27)

Methods differ in the gain K only.  They hold settings and no data: what a method remembers from sample to sample is
passed in and handed back.
"""

from __future__ import annotations

from abc import ABC, abstractmethod

from relaxations.algebra.arrays import Array
from smid.models import ModelError

__all__ = ["DivergenceError", "Method"]


class DivergenceError(ModelError):
    """The parameters of a recursive estimator grow without bound; the message names the sample and the cure.

    Examples
    --------
    >>> raise DivergenceError("the parameters are not finite after sample 7: take a smaller gain")
    Traceback (most recent call last):
        ...
    smid.recursive.method.DivergenceError: the parameters are not finite after sample 7: take a smaller gain
    """


class Method(ABC):
    """One way to correct the parameters by a new sample.

    Examples
    --------
    >>> from smid.recursive import ForgettingFactor
    >>> isinstance(ForgettingFactor(0.99), Method)
    True
    """

    @abstractmethod
    def start(self, n: int) -> Array:
        """Give what is remembered before the first sample, for n parameters."""

    @abstractmethod
    def correct(self, memory: Array, phi: Array) -> tuple[Array, Array]:
        """Give K[t], shape (n,), and what is remembered next, from the regressors, shape (n,)."""

    @abstractmethod
    def hold(self, memory: Array, phi: Array, error: float, change: Array, held: Array) -> Array:
        """Give the change of the parameters when the first ones must change by `held`, section 3.3.2.1.

        Parameters
        ----------
        memory
            After the sample.
        phi
            Shape (n,).
        error
            e[t].
        change
            Shape (n,). K[t] e[t], which the rule forbids.
        held
            Shape (m,). What the first m parameters change by instead.

        Returns
        -------
        ndarray, shape (n,)
        """

    @property
    def remark(self) -> str:
        """What this method makes of the a posteriori error whatever the data are; empty where it makes nothing."""
        return ""
