"""A first-order lag whose pole may change from sample to sample.

    y_t = g_t + a_t (y_{t-1} - g_t),    a_t = exp(-T_s / tau_t)

It is stable and has gain one for any tau. Its derivatives satisfy the same recursion,

    d_t = a_t d_{t-1} + source_t,    source_t = (1 - a_t) g_t' + (y_{t-1} - g_t) a_t',    d = y'

which is solved for all samples at once by recursive doubling: after k passes, d has the effect of the last 2^k sources.

Reference: Kogge, Stone, "A parallel algorithm for the efficient solution of a general class of recurrence equations",
IEEE Trans. Computers C-22 (1973).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from relaxations.algebra.arrays import Array
from relaxations.algebra.ball_arithmetic import Balls
from smid.sensors.c_ranges import c_range
from smid.sensors.program import Block, Code
from smid.sensors.ranges import Range
from smid.sensors.tensor import Tensor

__all__ = ["Lag", "lag", "lag_derivatives"]

_FADED = 1e-17


def lag(signal: Array, decay: Array, before: float) -> Array:
    """Return the lagged signal, shape (n,).

    Parameters
    ----------
    signal
        Shape (n,). The input g.
    decay
        Shape (n,). The pole a at each sample, from 0 to 1.
    before
        Output before the first sample.

    Examples
    --------
    >>> lag(np.array([1.0, 1.0, 1.0]), np.array([0.5, 0.5, 0.5]), 0.0)
    array([0.5  , 0.75 , 0.875])
    """
    y, result = before, []
    for g, a in zip(signal.tolist(), decay.tolist(), strict=True):
        y = g + a * (y - g)
        result.append(y)
    return np.array(result)


def lag_derivatives(sources: Array, decay: Array) -> Array:
    """Return ``d_t = a_t d_{t-1} + source_t`` from zero, for sources of shape (p, n) and poles of shape (n,).

    Examples
    --------
    >>> lag_derivatives(np.array([[1.0, 0.0, 0.0]]), np.array([0.5, 0.5, 0.5]))
    array([[1.  , 0.5 , 0.25]])
    """
    result, reach, shift = sources.copy(), decay, 1
    while shift < decay.size and reach.max() > _FADED:
        result[:, shift:] += reach[shift:] * result[:, :-shift]
        reach = np.concatenate([np.zeros(shift), reach[shift:] * reach[:-shift]])
        shift *= 2
    return result


@dataclass(frozen=True)
class Lag(Block):
    """A lag of a signal; it may read a temperature, from which the time constant depends.

    Parameters
    ----------
    time_constant
        At the reference temperature, in seconds.
    sampling_time
        In seconds.
    slope
        Relative fall of the time constant per unit of the temperature.
    reference
        In the unit of the temperature.
    """

    time_constant: float
    sampling_time: float
    slope: float = 0.0
    reference: float = 0.0

    def pole(self, temperature: Array) -> Array:
        """Return the pole at each temperature."""
        tau = self.time_constant * np.exp(-self.slope * (temperature - self.reference))
        return np.asarray(np.exp(-self.sampling_time / tau))

    def rest(self, first: Sequence[Array]) -> Array:
        """Return the first sample; see `Block.rest`."""
        return np.atleast_1d(first[0])

    def advance(self, signals: Sequence[Array], memory: Array) -> tuple[Array, Array]:
        """Return the lagged signal; see `Block.advance`."""
        signal = signals[0]
        warmth = signals[1] if len(signals) > 1 else np.full(signal.size, self.reference)
        lagged = lag(signal, self.pole(warmth), float(memory[0]))
        return lagged, lagged[-1:]

    def enclose(self, signals: Sequence[Range], memory: Range, cells: int) -> tuple[Range, Range]:  # noqa: ARG002
        """Return the range of a mean of signal and memory; see `Block.enclose`.

        It is linear in the pole, so its ends are at the least and the largest pole.
        """
        poles = self.poles(signals[1] if len(signals) > 1 else Range.exact(self.reference))
        ends = []
        for pole in (poles.lower, poles.upper):
            a = Balls.exact(pole)
            ends.append(Range.of((Balls.exact(1.0) - a) * signals[0].balls + a * memory[0].balls))
        found = ends[0].hull(ends[1])
        return found, found[None]

    def poles(self, warmth: Range) -> Range:
        """Return the range of the pole over a range of temperatures."""
        rate = -(Balls.exact(self.slope) * (warmth.balls - Balls.exact(self.reference)))
        tau = Balls.exact(self.time_constant) * Range.of(rate).exp().balls
        return Range.of(-(Balls.exact(self.sampling_time) / tau)).exp()

    def onnx(self, signals: Sequence[Tensor], memory: Tensor) -> tuple[Tensor, Tensor]:
        """Return the lagged signal; see `Block.onnx`."""
        signal, before = signals[0], memory.begun(signals[0])
        if len(signals) > 1:
            tau = self.time_constant * (-self.slope * (signals[1] - self.reference)).exp()
            lagged = signal + (tau.graph.tensor(-self.sampling_time) / tau).exp() * (before - signal)
        else:
            lagged = signal + float(self.pole(np.asarray(self.reference))) * (before - signal)
        return lagged, lagged

    def code(self, name: str, signals: Sequence[str]) -> Code:
        """Return the recursion; see `Block.code`."""
        if len(signals) > 1:
            tau = f"{self.time_constant!r} * exp({-self.slope!r} * ({signals[1]} - ({self.reference!r})))"
            pole = f"exp(-{self.sampling_time!r} / ({tau}))"
        else:
            pole = repr(float(self.pole(np.asarray(self.reference))))
        g = signals[0]
        return Code(
            update=f"{name} = {g} + {pole} * (m[0] - {g});\nm[0] = {name};",
            size=1,
            rest=f"m[0] = {g};",
        )

    def range_code(self, name: str, signals: Sequence[str]) -> Code:
        """Return the means with the least and the largest pole; see `Block.range_code`."""
        if len(signals) > 1:
            poles = (
                f"const ball warmth = minus(balls({signals[1]}), exact({self.reference!r}));\n"
                f"  const range rate = bounds(times(exact({-self.slope!r}), warmth));\n"
                f"  const ball tau = times(exact({self.time_constant!r}), balls(exp_range(rate)));\n"
                f"  const range poles = exp_range(bounds(over(exact({-self.sampling_time!r}), tau)));"
            )
        else:
            poles = c_range("poles", self.poles(Range.exact(self.reference)))
        return Code(
            f"{{ {poles}\n"
            "  const range memory = {low[0], high[0]};\n"
            f"  const range ends[] = {{mixed(poles.lower, {signals[0]}, memory), "
            f"mixed(poles.upper, {signals[0]}, memory)}};\n"
            f"  low[0] = {name}.lower = smaller(ends[0].lower, ends[1].lower);\n"
            f"  high[0] = {name}.upper = larger(ends[0].upper, ends[1].upper); }}"
        )
