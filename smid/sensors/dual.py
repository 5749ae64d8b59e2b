"""Signals with their derivatives by the parameters of a sensor: forward differentiation of a few operations.

A `Dual` holds values, shape (n,), and derivatives, shape (p, n). A parameter is a Dual of shape (1,). Lag and play have
the rules of `lag` and `play`.

Reference: Griewank, Walther, "Evaluating Derivatives" (2008), chapter 3.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from relaxations.algebra.arrays import Array
from smid.sensors.flow import FlowLaw, flow
from smid.sensors.lag import lag, lag_derivatives
from smid.sensors.play import play

__all__ = ["Dual", "parameters"]


@dataclass(frozen=True, eq=False)
class Dual:
    """Values and their derivatives.

    Parameters
    ----------
    value
        Shape (n,), or (1,) for a parameter.
    slopes
        Shape (p, n), or (p, 1).

    Examples
    --------
    >>> a, b = parameters(np.array([2.0, 3.0]))
    >>> (a * b).slopes.tolist(), (a * b.exp()).slopes.round(1).tolist()
    ([[3.0], [2.0]], [[20.1], [40.2]])
    """

    value: Array
    slopes: Array

    def __add__(self, other: Dual | Array | float) -> Dual:
        if isinstance(other, Dual):
            return Dual(self.value + other.value, self.slopes + other.slopes)
        return Dual(self.value + other, self.slopes + np.zeros_like(other))

    def __mul__(self, other: Dual | Array | float) -> Dual:
        if isinstance(other, Dual):
            return Dual(self.value * other.value, self.slopes * other.value + self.value * other.slopes)
        return Dual(self.value * other, self.slopes * other)

    def __neg__(self) -> Dual:
        return Dual(-self.value, -self.slopes)

    def __sub__(self, other: Dual | Array | float) -> Dual:
        return self + -other

    def __truediv__(self, other: Dual) -> Dual:
        return self * Dual(1.0 / other.value, -other.slopes / other.value**2)

    def exp(self) -> Dual:
        """Return the exponentials."""
        value = np.exp(self.value)
        return Dual(value, self.slopes * value)

    def tanh(self) -> Dual:
        """Return the hyperbolic tangents."""
        value = np.tanh(self.value)
        return Dual(value, self.slopes * (1.0 - value**2))

    def lagged(self, decay: Dual) -> Dual:
        """Return the signal behind a lag with these poles, from rest at its first sample."""
        n = self.value.size
        poles = np.broadcast_to(decay.value, (n,))
        value = lag(self.value, poles, float(self.value[0]))
        behind = np.concatenate([self.value[:1], value[:-1]]) - self.value
        sources = (1.0 - poles) * self.slopes + behind * decay.slopes
        sources[:, 0] = self.slopes[:, 0]
        return Dual(value, lag_derivatives(sources, poles))

    def pushed(self, threshold: Dual) -> Dual:
        """Return the part that the signal pushes through a slack, from the middle of the slack."""
        n = self.value.size
        moved = play(self.value, np.broadcast_to(threshold.value, (n,)), float(self.value[0]))
        by_threshold = np.broadcast_to(threshold.slopes, (threshold.slopes.shape[0], n))
        slopes = self.slopes[:, moved.contact] + moved.side * by_threshold[:, moved.contact]
        return Dual(moved.position, slopes)

    def flowed(self, cold: Dual, stiffening: Dual, log_growth: Dual) -> Dual:
        """Return the signal behind a flow from rest, see `smid.sensors.flow`.

        ``cold`` is the time constant for short ways at the reference level, in samples.
        """
        b, growth = float(stiffening.value[0]), float(np.exp(log_growth.value[0]))
        law = FlowLaw(0.0, 0.0, 0.0, b, 0.0, growth)
        value, taus = flow(self.value, cold.value, law, 1.0, float(self.value[0]))
        before = np.concatenate([self.value[:1], value[:-1]])
        poles, way = np.exp(-1.0 / taus), self.value - before
        longer = cold.value + growth * np.abs(way)
        # The derivative of the output by log tau, and that of log tau by the input and by the output before.
        by_log = -way * poles / taus
        by_way = growth * np.sign(way) / longer
        known = cold.slopes / longer - stiffening.slopes * before + log_growth.slopes * (growth * np.abs(way) / longer)
        sources = by_log * known + (1.0 - poles + by_log * by_way) * self.slopes
        sources[:, 0] = self.slopes[:, 0]
        return Dual(value, lag_derivatives(sources, poles - by_log * (b + by_way)))


def parameters(theta: Array) -> list[Dual]:
    """Return each parameter with its own derivative."""
    return [Dual(theta[k : k + 1], row[:, None]) for k, row in enumerate(np.eye(theta.size))]
