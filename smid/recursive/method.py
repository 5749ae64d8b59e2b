"""Interface of a recursive estimation method: its initial state, and its gain at each sample.

    theta[t] = theta[t-1] + K[t] e[t],   e[t] = y[t] - phi[t]' theta[t-1]                        (3.25), (3.27)

Methods differ only in the gain K. A method holds settings only; its state is passed in and returned.
"""

from __future__ import annotations

from abc import ABC, abstractmethod

from relaxations.algebra.arrays import Array
from smid.models import ModelError

__all__ = ["DivergenceError", "Method"]


class DivergenceError(ModelError):
    """The parameters of a recursive estimator grow without bound.

    Examples
    --------
    >>> issubclass(DivergenceError, ModelError)
    True
    """


class Method(ABC):
    """Rule that corrects the parameters by a new sample.

    Examples
    --------
    >>> from smid.recursive import ForgettingFactor
    >>> isinstance(ForgettingFactor(0.99), Method)
    True
    """

    @abstractmethod
    def start(self, n: int) -> Array:
        """Return the state (`memory`) before the first sample, for n parameters."""

    @abstractmethod
    def correct(self, memory: Array, phi: Array) -> tuple[Array, Array]:
        """Return K[t], shape (n,), and the next state, from the regressors, shape (n,)."""

    @abstractmethod
    def hold(self, memory: Array, phi: Array, error: float, change: Array, held: Array) -> Array:
        """Return the change of the parameters, shape (n,), with fixed first ones, section 3.3.2.1.

        The stability rule rejects `change`, which is K[t] e[t]. It requires the change `held`, shape (m,), of the
        first m parameters. `memory` is the state after the sample; `error` is e[t].
        """

    @property
    def remark(self) -> str:
        """Return how this method sets the a posteriori error for any data; empty if it does not."""
        return ""
