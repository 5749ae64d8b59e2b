"""The dynamic part of PTX: smoothed pressure, play operators, and the effect of the temperature.

    s = lag of P, with the time constant tau_s                          less noise
    g_k = place of s within the slack of play k, in [-1, 1]             hysteresis
    q = exp(c_1 (T - T_0)) (s - sum_k w_k g_k) + c_2 (T - T_0)          pressure with the same effect at T_0
    tau(T) = tau_0 exp(-c_3 (T - T_0))                                  slower oil when cold

T_0 is the middle of the trained temperatures. A pressure minus a sum of plays of positive forces is a
Prandtl-Ishlinskii operator. A record starts at rest: pressure and position have been constant, and s is in the middle
of every slack.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from relaxations.algebra.arrays import Array
from relaxations.algebra.ball_arithmetic import Balls
from smid.sensors.c_ranges import c_ball
from smid.sensors.lag import Lag
from smid.sensors.program import Block, Code
from smid.sensors.ranges import Range
from smid.sensors.tensor import Tensor

__all__ = ["Acting", "Dynamics"]


@dataclass(frozen=True)
class Dynamics:
    """The parameters of a PTX outside its network.

    Parameters
    ----------
    smoothing
        Time constant of the pressure, in seconds.
    lag
        Time constant of the position at the reference temperature, in seconds.
    lag_slope
        Relative fall of the lag per degree.
    gain_slope
        Relative rise of the gain per degree.
    shift_slope
        Shift of the pressure per degree.
    thresholds
        Of the plays, in the unit of the pressure.
    forces
        Friction of each play while the pressure rises, in the unit of the pressure.
    reference
        The reference temperature; 0 without a temperature.
    """

    smoothing: float
    lag: float
    lag_slope: float
    gain_slope: float
    shift_slope: float
    thresholds: tuple[float, ...]
    forces: tuple[float, ...]
    reference: float

    def smoothed(self, sampling_time: float) -> Lag:
        """Return the lag of the pressure."""
        return Lag(self.smoothing, sampling_time)

    def lagged(self, sampling_time: float) -> Lag:
        """Return the lag of the position."""
        return Lag(self.lag, sampling_time, self.lag_slope, self.reference)

    def acting(self, smoothed: Array, pushed: Sequence[Array], temperature: Array) -> Array:
        """Return the pressure with the same effect at the reference and without friction, shape (n,)."""
        friction = np.zeros(smoothed.size)
        for w, g in zip(self.forces, self.states(smoothed, pushed), strict=True):
            friction = friction + w * g
        warmth = temperature - self.reference
        return np.asarray(self.gain(temperature) * (smoothed - friction) + self.shift_slope * warmth)

    def states(self, smoothed: Array, pushed: Sequence[Array]) -> list[Array]:
        """Return the place of the pressure within the slack of each play, from -1 to 1."""
        return [(smoothed - h) / r for h, r in zip(pushed, self.thresholds, strict=True)]

    def gain(self, temperature: Array) -> Array:
        """Return the factor of the pressure at each temperature."""
        return np.asarray(np.exp(self.gain_slope * (temperature - self.reference)))


@dataclass(frozen=True)
class Acting(Block):
    """The pressure with the same effect at the reference temperature and without friction.

    It reads the smoothed pressure, each pushed part, and the temperature if there is one.
    """

    dynamics: Dynamics

    def rest(self, first: Sequence[Array]) -> Array:  # noqa: ARG002
        """Return no memory; see `Block.rest`."""
        return np.zeros(0)

    def advance(self, signals: Sequence[Array], memory: Array) -> tuple[Array, Array]:
        """Return the pressures; see `Block.advance`."""
        smoothed, *others = signals
        pushed = others[: len(self.dynamics.thresholds)]
        warmth = others[-1] if len(others) > len(pushed) else np.full(smoothed.size, self.dynamics.reference)
        return self.dynamics.acting(smoothed, pushed, warmth), memory

    def enclose(self, signals: Sequence[Range], memory: Range, cells: int) -> tuple[Range, Range]:  # noqa: ARG002
        """Return the range, with each signal once: ``s (1 - sum_k w_k / r_k) + sum_k (w_k / r_k) h_k``."""
        numbers, (smoothed, *others) = self.dynamics, signals
        share, pushed = Balls.exact(1.0), Balls.exact(0.0)
        for part, h in zip(self._parts(), others, strict=False):
            share, pushed = share - part, pushed + part * h.balls
        free = Range.of(share * smoothed.balls + pushed)
        # The friction of a play does not exceed its force.
        most = sum(numbers.forces) * (1.0 + 1e-14)
        free = free.meet(Range.of(smoothed.balls + Balls(np.asarray(0.0), np.asarray(most))))
        if len(others) == len(numbers.thresholds):
            return free, memory
        warmth = others[-1].balls - Balls.exact(numbers.reference)
        gain = Range.of(Balls.exact(numbers.gain_slope) * warmth).exp().balls
        return Range.of(gain * free.balls + Balls.exact(numbers.shift_slope) * warmth), memory

    def _parts(self) -> list[Balls]:
        """Return the force over the threshold of each play."""
        numbers = self.dynamics
        return [Balls.exact(w) / Balls.exact(r) for w, r in zip(numbers.forces, numbers.thresholds, strict=True)]

    def range_code(self, name: str, signals: Sequence[str]) -> Code:
        """Return the formula of `enclose`; see `Block.range_code`."""
        numbers, (s, *others) = self.dynamics, signals
        share, pushed, lines = Balls.exact(1.0), "exact(0.0)", list[str]()
        for k, (part, h) in enumerate(zip(self._parts(), others, strict=False)):
            lines.append(f"const ball part{k} = {c_ball(part)};")
            share, pushed = share - part, f"plus({pushed}, times(part{k}, balls({h})))"
        most = sum(numbers.forces) * (1.0 + 1e-14)
        lines += [
            f"const ball share = {c_ball(share)}, friction = {{0.0, {float(most)!r}}};",
            f"{name} = meet(bounds(plus(times(share, balls({s})), {pushed})), bounds(plus(balls({s}), friction)));",
        ]
        if len(others) > len(numbers.thresholds):
            lines += [
                f"const ball warmth = minus(balls({others[-1]}), exact({numbers.reference!r}));",
                f"const range gain = exp_range(bounds(times(exact({numbers.gain_slope!r}), warmth)));",
                f"{name} = bounds(plus(times(balls(gain), balls({name})), "
                f"times(exact({numbers.shift_slope!r}), warmth)));",
            ]
        return Code("{ " + "\n  ".join(lines) + " }")

    def onnx(self, signals: Sequence[Tensor], memory: Tensor) -> tuple[Tensor, Tensor]:
        """Return the formula; see `Block.onnx`."""
        numbers, (smoothed, *others) = self.dynamics, signals
        free = smoothed
        for w, r, h in zip(numbers.forces, numbers.thresholds, others, strict=False):
            free = free - w * ((smoothed - h) / r)
        if len(others) == len(numbers.thresholds):
            return free, memory
        warmth = others[-1] - numbers.reference
        return (numbers.gain_slope * warmth).exp() * free + numbers.shift_slope * warmth, memory

    def code(self, name: str, signals: Sequence[str]) -> Code:
        """Return the formula; see `Block.code`."""
        numbers, (s, *others) = self.dynamics, signals
        friction = "0.0"
        for w, r, h in zip(numbers.forces, numbers.thresholds, others, strict=False):
            friction = f"{friction} + {w!r} * (({s} - {h}) / {r!r})"
        free = f"{s} - ({friction})"
        if len(others) == len(numbers.thresholds):
            return Code(update=f"{name} = {free};")
        warmth = f"({others[-1]} - ({numbers.reference!r}))"
        return Code(
            update=f"{name} = exp({numbers.gain_slope!r} * {warmth}) * ({free}) + {numbers.shift_slope!r} * {warmth};"
        )
