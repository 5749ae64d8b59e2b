"""A lag whose time constant depends on its own output, and on the distance to it.

    y_t = g_t + a_t (y_{t-1} - g_t),    a_t = exp(-T_s / tau_t)
    tau_t = exp(-b (y_{t-1} - y_0)) (tau exp(-c w + k w^2) + growth |g_t - y_{t-1}|)

with ``w = T - T_0``. A piston that displaces oil against a spring moves in this way, in units of pressure: it is faster
where the spring is stiffer, viscous oil is slower when cold, and turbulent oil makes long ways slower. With
``c = k = b = growth = 0`` it is a first-order lag. Its derivatives satisfy
``d_t = (a_t + (y_{t-1} - g_t) da/dy) d_{t-1} + source_t``.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from relaxations.algebra.arrays import Array
from relaxations.algebra.ball_arithmetic import Balls
from smid.sensors.c_ranges import c_range
from smid.sensors.program import Block, Code
from smid.sensors.ranges import Range
from smid.sensors.tensor import Tensor

__all__ = ["Flow", "FlowLaw", "flow"]

SLACK = 1e-14  # of a few products and sums


@dataclass(frozen=True)
class FlowLaw:
    """The time constant of a flow.

    Parameters
    ----------
    time_constant
        At the reference temperature and level for short ways, in seconds.
    cooling
        Relative fall of the time constant per degree.
    curvature
        Of its logarithm, per square degree.
    stiffening
        Relative fall of the time constant per unit of the output.
    reference
        Level, in the unit of the output.
    growth
        Rise of the time constant per unit of the distance, in seconds.
    """

    time_constant: float
    cooling: float
    curvature: float
    stiffening: float
    reference: float
    growth: float


def flow(signal: Array, cold: Array, law: FlowLaw, interval: float, before: float) -> tuple[Array, Array]:
    """Return the output and the time constants, shape (n,) each.

    Parameters
    ----------
    signal
        Shape (n,). The input g.
    cold
        Shape (n,). Time constant at each sample for short ways at the reference level, in seconds.
    before
        Output before the first sample.

    Examples
    --------
    >>> law = FlowLaw(1.0, 0.0, 0.0, 0.0, 0.0, 1.0)
    >>> flow(np.array([1.0, 1.0]), np.array([1.0, 1.0]), law, 1.0, 0.0)[0].round(3)
    array([0.393, 0.675])
    """
    y, result, taus = before, [], []
    b, reference, growth = law.stiffening, law.reference, law.growth
    for g, tau in zip(signal.tolist(), cold.tolist(), strict=True):
        # Beyond 50 the time constant is far outside any use; the cap avoids an overflow after a too long step.
        exponent = max(-50.0, min(50.0, -b * (y - reference)))
        taus.append(math.exp(exponent) * (tau + growth * abs(g - y)))
        y = g + math.exp(-interval / taus[-1]) * (y - g)
        result.append(y)
    return np.array(result), np.array(taus)


@dataclass(frozen=True)
class Flow(Block):
    """A flow of a signal; it may read a temperature."""

    law: FlowLaw
    sampling_time: float
    reference: float = 0.0

    def rest(self, first: Sequence[Array]) -> Array:
        """Return the first sample; see `Block.rest`."""
        return np.atleast_1d(first[0])

    def advance(self, signals: Sequence[Array], memory: Array) -> tuple[Array, Array]:
        """Return the output; see `Block.advance`."""
        signal = signals[0]
        warmth = signals[1] - self.reference if len(signals) > 1 else np.zeros(signal.size)
        cold = self.law.time_constant * np.exp(-self.law.cooling * warmth + self.law.curvature * warmth**2)
        moved, _ = flow(signal, cold, self.law, self.sampling_time, float(memory[0]))
        return moved, moved[-1:]

    def enclose(self, signals: Sequence[Range], memory: Range, cells: int) -> tuple[Range, Range]:  # noqa: ARG002
        """Return the range of a mean of signal and memory; see `Block.enclose`.

        For given signal and memory it is linear in the pole, so its ends are at the least and the largest pole.
        """
        law, signal, before = self.law, signals[0].balls, memory[0].balls
        exponent = Range.of(Balls.exact(-law.stiffening) * (before - Balls.exact(law.reference)))
        factor = exponent.meet(Range(np.asarray(-50.0), np.asarray(50.0))).exp()
        cold = Range.exact(law.time_constant)
        if len(signals) > 1:
            warmth = Range.of(signals[1].balls - Balls.exact(self.reference))
            slower = Balls.exact(law.curvature) * warmth.square().balls - Balls.exact(law.cooling) * warmth.balls
            cold = Range.of(cold.balls * Range.of(slower).exp().balls)
        way = Range.of(signal - before)
        longest = np.maximum(np.abs(way.lower), np.abs(way.upper))
        shortest = np.maximum(0.0, np.maximum(way.lower, -way.upper))
        # All factors are positive, so the ends are those of the factors: a ball around a wide range would contain zero.
        least, most = (
            f * (c + law.growth * d) * (1.0 + slack)
            for f, c, d, slack in (
                (factor.lower, cold.lower, shortest, -SLACK),
                (factor.upper, cold.upper, longest, SLACK),
            )
        )
        h = self.sampling_time
        poles = Range(np.asarray(-h / least * (1.0 + SLACK)), np.asarray(-h / most * (1.0 - SLACK))).exp()
        ends = []
        for pole in (poles.lower, poles.upper):
            a = Balls.exact(pole)
            ends.append(Range.of((Balls.exact(1.0) - a) * signal + a * before))
        # A mean lies between what it is the mean of, also where the enclosure of the pole is wide.
        found = ends[0].hull(ends[1]).meet(signals[0].hull(memory[0]))
        return found, found[None]

    def onnx(self, signals: Sequence[Tensor], memory: Tensor) -> tuple[Tensor, Tensor]:
        """Return the output; see `Block.onnx`."""
        law, (signal, *others) = self.law, signals
        before = memory.begun(signal)
        cold: Tensor | float = law.time_constant
        if others:
            warmth = others[0] - self.reference
            cold = law.time_constant * (-law.cooling * warmth + law.curvature * (warmth * warmth)).exp()
        factor = (-law.stiffening * (before - law.reference)).clip(-50.0, 50.0).exp()
        tau = factor * (law.growth * abs(signal - before) + cold)
        moved = signal + (-self.sampling_time / tau).exp() * (before - signal)
        return moved, moved

    def code(self, name: str, signals: Sequence[str]) -> Code:
        """Return the recursion; see `Block.code`."""
        law, g = self.law, signals[0]
        cold = repr(law.time_constant)
        if len(signals) > 1:
            warmth = f"({signals[1]} - ({self.reference!r}))"
            cold = f"{cold} * exp({-law.cooling!r} * {warmth} + {law.curvature!r} * ({warmth} * {warmth}))"
        return Code(
            update=(
                f"{{ double e = {-law.stiffening!r} * (m[0] - ({law.reference!r}));\n"
                "  e = e > 50.0 ? 50.0 : e < -50.0 ? -50.0 : e;\n"
                f"  const double tau = exp(e) * ({cold} + {law.growth!r} * fabs({g} - m[0]));\n"
                f"  {name} = {g} + exp(-{self.sampling_time!r} / tau) * (m[0] - {g}); }}\n"
                f"m[0] = {name};"
            ),
            size=1,
            rest=f"m[0] = {g};",
        )

    def range_code(self, name: str, signals: Sequence[str]) -> Code:
        """Return the means with the least and the largest pole; see `Block.range_code`."""
        law, (g, *others) = self.law, signals
        cold = c_range("cold", Range.exact(law.time_constant))
        if others:
            square = f"times(exact({law.curvature!r}), balls(square_range(warmth)))"
            slower = f"minus({square}, times(exact({law.cooling!r}), balls(warmth)))"
            cold = (
                f"const range warmth = bounds(minus(balls({others[0]}), exact({self.reference!r})));\n"
                f"  const range cold = bounds(times(exact({law.time_constant!r}), exp_ball({slower})));"
            )
        down, up, h = 1.0 - SLACK, 1.0 + SLACK, -self.sampling_time
        level = f"minus(balls(before), exact({law.reference!r}))"
        return Code(
            f"{{ {cold}\n"
            "  const range before = {low[0], high[0]}, most = {-50.0, 50.0};\n"
            f"  const range factor = exp_range(meet(bounds(times(exact({-law.stiffening!r}), {level})), most));\n"
            f"  const range way = bounds(minus(balls({g}), balls(before)));\n"
            "  const double longest = larger(fabs(way.lower), fabs(way.upper));\n"
            "  const double shortest = larger(0.0, larger(way.lower, -way.upper));\n"
            f"  const double fast = factor.lower * (cold.lower + {law.growth!r} * shortest) * {down!r};\n"
            f"  const double slow = factor.upper * (cold.upper + {law.growth!r} * longest) * {up!r};\n"
            f"  const range exponents = {{{h!r} / fast * {up!r}, {h!r} / slow * {down!r}}};\n"
            "  const range poles = exp_range(exponents);\n"
            f"  const range ends[] = {{mixed(poles.lower, {g}, before), mixed(poles.upper, {g}, before)}};\n"
            "  const range mean = {smaller(ends[0].lower, ends[1].lower), larger(ends[0].upper, ends[1].upper)};\n"
            f"  const range hull = {{smaller({g}.lower, before.lower), larger({g}.upper, before.upper)}};\n"
            f"  {name} = meet(mean, hull);\n"
            f"  low[0] = {name}.lower;\n"
            f"  high[0] = {name}.upper; }}"
        )
