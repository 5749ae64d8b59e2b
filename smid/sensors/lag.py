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
    """Return ``d_t = a_t d_{t-1} + source_t`` from zero, for sources of shape (p, n) and factors of shape (n,).

    Examples
    --------
    >>> lag_derivatives(np.array([[1.0, 0.0, 0.0]]), np.array([0.5, 0.5, 0.5]))
    array([[1.  , 0.5 , 0.25]])
    """
    result, reach, shift = sources.copy(), decay, 1
    while shift < decay.size and np.abs(reach).max() > _FADED:
        result[:, shift:] += reach[shift:] * result[:, :-shift]
        reach = np.concatenate([np.zeros(shift), reach[shift:] * reach[:-shift]])
        shift *= 2
    return result


@dataclass(frozen=True)
class Lag(Block):
    """A lag of a signal; the time constant may fall with further signals, such as a temperature.

    Parameters
    ----------
    time_constant
        At the references, in seconds.
    sampling_time
        In seconds.
    falls
        Of each further signal: the relative fall of the time constant per unit of it, and its reference.
    """

    time_constant: float
    sampling_time: float
    falls: tuple[tuple[float, float], ...] = ()

    def pole(self, others: Sequence[Array]) -> Array:
        """Return the pole at each sample of the further signals."""
        exponent = np.asarray(0.0)
        for (slope, reference), other in zip(self.falls, others, strict=True):
            exponent = exponent - slope * (other - reference)
        return np.asarray(np.exp(-self.sampling_time / (self.time_constant * np.exp(exponent))))

    def rest(self, first: Sequence[Array]) -> Array:
        """Return the first sample; see `Block.rest`."""
        return np.atleast_1d(first[0])

    def advance(self, signals: Sequence[Array], memory: Array) -> tuple[Array, Array]:
        """Return the lagged signal; see `Block.advance`."""
        signal, *others = signals
        poles = np.broadcast_to(self.pole(others), signal.shape)
        lagged = lag(signal, poles, float(memory[0]))
        return lagged, lagged[-1:]

    def enclose(self, signals: Sequence[Range], memory: Range, cells: int) -> tuple[Range, Range]:  # noqa: ARG002
        """Return the range of a mean of signal and memory; see `Block.enclose`.

        It is linear in the pole, so its ends are at the least and the largest pole.
        """
        signal, *others = signals
        poles, ends = self.poles(others), []
        for pole in (poles.lower, poles.upper):
            a = Balls.exact(pole)
            ends.append(Range.of((Balls.exact(1.0) - a) * signal.balls + a * memory[0].balls))
        found = ends[0].hull(ends[1])
        return found, found[None]

    def poles(self, others: Sequence[Range]) -> Range:
        """Return the range of the pole over ranges of the further signals."""
        exponent = Balls.exact(0.0)
        for (slope, reference), other in zip(self.falls, others, strict=True):
            exponent = exponent - Balls.exact(slope) * (other.balls - Balls.exact(reference))
        tau = Balls.exact(self.time_constant) * Range.of(exponent).exp().balls
        return Range.of(Balls.exact(-self.sampling_time) / tau).exp()

    def onnx(self, signals: Sequence[Tensor], memory: Tensor) -> tuple[Tensor, Tensor]:
        """Return the lagged signal; see `Block.onnx`."""
        signal, *others = signals
        if others:
            exponent = memory.graph.tensor(0.0)
            for (slope, reference), other in zip(self.falls, others, strict=True):
                exponent = exponent - slope * (other - reference)
            pole = (-self.sampling_time / (self.time_constant * exponent.exp())).exp()
        else:
            pole = memory.graph.tensor(self.pole([]))
        lagged = signal + pole * (memory.begun(signal) - signal)
        return lagged, lagged

    def code(self, name: str, signals: Sequence[str]) -> Code:
        """Return the recursion; see `Block.code`."""
        g, *others = signals
        if not others:
            pole = repr(float(self.pole([])))
        else:
            terms = "".join(
                f" - {slope!r} * ({other} - ({reference!r}))"
                for (slope, reference), other in zip(self.falls, others, strict=True)
            )
            pole = f"exp(-{self.sampling_time!r} / ({self.time_constant!r} * exp(0.0{terms})))"
        return Code(
            update=f"{name} = {g} + {pole} * (m[0] - {g});\nm[0] = {name};",
            size=1,
            rest=f"m[0] = {g};",
        )

    def range_code(self, name: str, signals: Sequence[str]) -> Code:
        """Return the means with the least and the largest pole; see `Block.range_code`."""
        g, *others = signals
        if others:
            exponent = "exact(0.0)"
            for (slope, reference), other in zip(self.falls, others, strict=True):
                exponent = f"minus({exponent}, times(exact({slope!r}), minus(balls({other}), exact({reference!r}))))"
            poles = (
                f"const ball tau = times(exact({self.time_constant!r}), exp_ball({exponent}));\n"
                f"  const range poles = exp_range(bounds(over(exact({-self.sampling_time!r}), tau)));"
            )
        else:
            poles = c_range("poles", self.poles([]))
        return Code(
            f"{{ {poles}\n"
            "  const range memory = {low[0], high[0]};\n"
            f"  const range ends[] = {{mixed(poles.lower, {g}, memory), mixed(poles.upper, {g}, memory)}};\n"
            f"  low[0] = {name}.lower = smaller(ends[0].lower, ends[1].lower);\n"
            f"  high[0] = {name}.upper = larger(ends[0].upper, ends[1].upper); }}"
        )
