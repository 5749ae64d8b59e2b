"""The dynamic part of PTX: smoothed pressure, play operators, the effect of the temperature, and further effects.

    s = lag of P, with the time constant tau_s                          less noise
    g_k = place of s within the slack of play k, in [-1, 1]             hysteresis
    q = exp(c_1 (T - T_0)) (s - F sum_k w_k g_k) + c_2 (T - T_0)        pressure with the same effect at T_0
    z = f(q)                                                            static curve
    x = lag of z, with the time constant tau_0 exp(-c_3 (T - T_0))      slower oil when cold

F is 1. Each further effect changes one thing:

    flow          q passes a lag whose time constant depends on level and distance (`smid.sensors.flow`)
    temperature   slack and force of every play are multiplied by exp(-c_4 (T - T_0))
    backlash      the position passes a play
    level         F is multiplied by exp(c_5 (s - s_0))
    rate          F is multiplied by exp(c_6 tanh(d / d_0)^2), d = s - lag of s with the time constant tau_r

T_0 is the middle of the trained temperatures. A pressure minus a sum of plays of positive forces is a
Prandtl-Ishlinskii operator. A record starts at rest: pressure and position have been constant, and s is in the middle
of every slack.

Reference: Brokate, Sprekels, "Hysteresis and Phase Transitions" (1996); for plays that depend on rate and level: Ang,
Garmon, Khosla, Riviere, "Modeling rate-dependent hysteresis in piezoelectric actuators", IROS (2003), and Al Janaideh,
Rakheja, Su, "An analytical generalized Prandtl-Ishlinskii model inversion", IEEE/ASME Trans. Mechatronics 16 (2011).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeVar

import numpy as np

from relaxations.algebra.arrays import Array
from relaxations.algebra.ball_arithmetic import Balls
from smid.networks import TanhNetwork
from smid.sensors.c_ranges import c_ball
from smid.sensors.curve import NetworkBlock
from smid.sensors.flow import Flow, FlowLaw
from smid.sensors.lag import Lag
from smid.sensors.play import Pushed
from smid.sensors.program import Block, Code, Program
from smid.sensors.ranges import Range
from smid.sensors.tensor import Tensor

__all__ = ["EFFECTS", "Acting", "Dynamics", "LevelLaw", "RateLaw"]

T = TypeVar("T")

EFFECTS = ("flow", "temperature", "backlash", "level", "rate")


@dataclass(frozen=True)
class LevelLaw:
    """Relative rise of the friction per unit of the pressure, and the pressure where it is as trained."""

    slope: float
    reference: float


@dataclass(frozen=True)
class RateLaw:
    """Logarithm of the friction's change at high rates, the rate in units of the pressure, and its lag in seconds."""

    change: float
    scale: float
    time_constant: float


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
    friction_slope
        Relative fall of slack and friction per degree; None without the effect, as for the others.
    backlash
        Half the slack of the position, in its unit.
    """

    smoothing: float
    lag: float
    lag_slope: float
    gain_slope: float
    shift_slope: float
    thresholds: tuple[float, ...]
    forces: tuple[float, ...]
    reference: float
    friction_slope: float | None = None
    level: LevelLaw | None = None
    rate: RateLaw | None = None
    flow: FlowLaw | None = None
    backlash: float | None = None

    def program(self, network: TanhNetwork, interval: float, pressure: str, temperature: str | None) -> Program:
        """Return the steps from channels of these names, sampled with the interval in seconds."""
        warmth = () if temperature is None else (temperature,)
        program = Program().then(Lag(self.smoothing, interval), pressure)
        smoothed, pushed = program.output, list[str]()
        scheduled = () if self.friction_slope is None else warmth
        for threshold in self.thresholds:
            slack = Pushed(threshold, self.friction_slope or 0.0, self.reference)
            program = program.then(slack, smoothed, *scheduled)
            pushed.append(program.output)
        slower: tuple[str, ...] = ()
        if self.rate is not None:
            program = program.then(Lag(self.rate.time_constant, interval), smoothed)
            slower = (program.output,)
        program = program.then(Acting(self), smoothed, *pushed, *slower, *warmth)
        if self.flow is not None:
            program = program.then(Flow(self.flow, interval, self.reference), program.output, *warmth)
        program = program.then(NetworkBlock(network), program.output)
        falls = ((self.lag_slope, self.reference),) * len(warmth)
        program = program.then(Lag(self.lag, interval, falls), program.output, *warmth)
        return program if self.backlash is None else program.then(Pushed(self.backlash), program.output)


@dataclass(frozen=True)
class Acting(Block):
    """The pressure with the same effect at the reference temperature and without friction.

    It reads the smoothed pressure, each pushed part, the slower pressure if the friction depends on the rate, and the
    temperature if there is one.
    """

    dynamics: Dynamics

    def rest(self, first: Sequence[Array]) -> Array:  # noqa: ARG002
        """Return no memory; see `Block.rest`."""
        return np.zeros(0)

    def advance(self, signals: Sequence[Array], memory: Array) -> tuple[Array, Array]:
        """Return the pressures; see `Block.advance`."""
        numbers = self.dynamics
        smoothed, pushed, slower, temperature = self._named(signals)
        # The stiffness of a play does not depend on temperature: slack and force change in the same proportion.
        friction = np.zeros(smoothed.size)
        for w, r, h in zip(numbers.forces, numbers.thresholds, pushed, strict=True):
            friction = friction + w * ((smoothed - h) / r)
        if numbers.level is not None:
            friction = np.exp(numbers.level.slope * (smoothed - numbers.level.reference)) * friction
        if numbers.rate is not None and slower is not None:
            friction = np.exp(numbers.rate.change * np.tanh((smoothed - slower) / numbers.rate.scale) ** 2) * friction
        free = smoothed - friction
        if temperature is None:
            return np.asarray(free), memory
        warmth = temperature - numbers.reference
        return np.asarray(np.exp(numbers.gain_slope * warmth) * free + numbers.shift_slope * warmth), memory

    def _named(self, signals: Sequence[T]) -> tuple[T, Sequence[T], T | None, T | None]:
        """Return smoothed pressure, pushed parts, slower pressure and temperature."""
        smoothed, *others = signals
        count = len(self.dynamics.thresholds)
        rest = others[count:]
        slower = rest.pop(0) if self.dynamics.rate is not None else None
        return smoothed, others[:count], slower, rest[0] if rest else None

    def enclose(self, signals: Sequence[Range], memory: Range, cells: int) -> tuple[Range, Range]:  # noqa: ARG002
        """Return the range; without level and rate with each signal once: ``s (1 - sum_k w_k / r_k) + ...``."""
        numbers = self.dynamics
        smoothed, parts, slower, temperature = self._named(signals)
        s, pushed = smoothed.balls, Balls.exact(0.0)
        for stiffness, h in zip(self._stiffnesses(), parts, strict=True):
            pushed = pushed + stiffness * h.balls
        share, most = self._limits()
        warmth = None if temperature is None else temperature.balls - Balls.exact(numbers.reference)
        if warmth is not None and numbers.friction_slope is not None:
            most = most * Range.of(Balls.exact(-numbers.friction_slope) * warmth).exp().balls
        factor = self._factor(s, slower)
        if factor is None:
            free = (Balls.exact(1.0) - share) * s + pushed
        else:
            free, most = s - factor * (share * s - pushed), factor * most
        # The friction of a play does not exceed its force.
        limited = Range.of(free).meet(Range.of(s + Balls(np.asarray(0.0), Range.of(most).upper)))
        if warmth is None:
            return limited, memory
        gain = Range.of(Balls.exact(numbers.gain_slope) * warmth).exp().balls
        return Range.of(gain * limited.balls + Balls.exact(numbers.shift_slope) * warmth), memory

    def _stiffnesses(self) -> list[Balls]:
        """Return the force over the threshold of each play."""
        numbers = self.dynamics
        return [Balls.exact(w) / Balls.exact(r) for w, r in zip(numbers.forces, numbers.thresholds, strict=True)]

    def _limits(self) -> tuple[Balls, Balls]:
        """Return the sum of the stiffnesses, and an upper bound of the friction as trained."""
        share = Balls.exact(0.0)
        for stiffness in self._stiffnesses():
            share = share + stiffness
        return share, Balls.exact(sum(self.dynamics.forces) * (1.0 + 1e-14))

    def _factor(self, s: Balls, slower: Range | None) -> Balls | None:
        """Return the factor F of the friction; None where it is 1."""
        level, rate = self.dynamics.level, self.dynamics.rate
        factor = None
        if level is not None:
            factor = Range.of(Balls.exact(level.slope) * (s - Balls.exact(level.reference))).exp().balls
        if rate is not None and slower is not None:
            fast = Range.of((s - slower.balls) / Balls.exact(rate.scale)).tanh().square()
            change = Range.of(Balls.exact(rate.change) * fast.balls).exp().balls
            factor = change if factor is None else factor * change
        return factor

    def range_code(self, name: str, signals: Sequence[str]) -> Code:
        """Return the formula of `enclose`; see `Block.range_code`."""
        numbers = self.dynamics
        smoothed, parts, slower, temperature = self._named(signals)
        share, most = self._limits()
        lines = [f"const ball s = balls({smoothed}), share = {c_ball(share)};", f"ball most = {c_ball(most)};"]
        pushed, factors = "exact(0.0)", list[str]()
        for k, (stiffness, h) in enumerate(zip(self._stiffnesses(), parts, strict=True)):
            lines.append(f"const ball stiffness{k} = {c_ball(stiffness)};")
            pushed = f"plus({pushed}, times(stiffness{k}, balls({h})))"
        if temperature is not None:
            lines.append(f"const ball warmth = minus(balls({temperature}), exact({numbers.reference!r}));")
            if numbers.friction_slope is not None:
                lines.append(f"most = times(most, exp_ball(times(exact({-numbers.friction_slope!r}), warmth)));")
        if numbers.level is not None:
            level = f"minus(s, exact({numbers.level.reference!r}))"
            factors.append(f"exp_ball(times(exact({numbers.level.slope!r}), {level}))")
        if numbers.rate is not None and slower is not None:
            rate = f"over(minus(s, balls({slower})), exact({numbers.rate.scale!r}))"
            lines.append(f"const ball fast = balls(square_range(tanh_range(bounds({rate}))));")
            factors.append(f"exp_ball(times(exact({numbers.rate.change!r}), fast))")
        if factors:
            product = factors[0] if len(factors) == 1 else f"times({', '.join(factors)})"
            lines += [f"const ball factor = {product};", "most = times(factor, most);"]
            free = f"minus(s, times(factor, minus(times(share, s), {pushed})))"
        else:
            free = f"plus(times(minus(exact(1.0), share), s), {pushed})"
        lines += [
            "const ball friction = {0.0, bounds(most).upper};",
            f"{name} = meet(bounds({free}), bounds(plus(s, friction)));",
        ]
        if temperature is not None:
            gain = f"exp_ball(times(exact({numbers.gain_slope!r}), warmth))"
            shift = f"times(exact({numbers.shift_slope!r}), warmth)"
            lines.append(f"{name} = bounds(plus(times({gain}, balls({name})), {shift}));")
        return Code("{ " + "\n  ".join(lines) + " }")

    def onnx(self, signals: Sequence[Tensor], memory: Tensor) -> tuple[Tensor, Tensor]:
        """Return the formula; see `Block.onnx`."""
        numbers = self.dynamics
        smoothed, pushed, slower, temperature = self._named(signals)
        friction = memory.graph.tensor(0.0)
        for w, r, h in zip(numbers.forces, numbers.thresholds, pushed, strict=True):
            friction = friction + w * ((smoothed - h) / r)
        if numbers.level is not None:
            friction = (numbers.level.slope * (smoothed - numbers.level.reference)).exp() * friction
        if numbers.rate is not None and slower is not None:
            fast = ((smoothed - slower) / numbers.rate.scale).tanh()
            friction = (numbers.rate.change * (fast * fast)).exp() * friction
        free = smoothed - friction
        if temperature is None:
            return free, memory
        warmth = temperature - numbers.reference
        return (numbers.gain_slope * warmth).exp() * free + numbers.shift_slope * warmth, memory

    def code(self, name: str, signals: Sequence[str]) -> Code:
        """Return the formula; see `Block.code`."""
        numbers = self.dynamics
        s, pushed, slower, temperature = self._named(signals)
        friction = "0.0"
        for w, r, h in zip(numbers.forces, numbers.thresholds, pushed, strict=True):
            friction = f"{friction} + {w!r} * (({s} - {h}) / {r!r})"
        if numbers.level is not None:
            friction = f"exp({numbers.level.slope!r} * ({s} - ({numbers.level.reference!r}))) * ({friction})"
        before = ""
        if numbers.rate is not None and slower is not None:
            before = f"const double fast = tanh(({s} - {slower}) / {numbers.rate.scale!r});\n"
            friction = f"exp({numbers.rate.change!r} * (fast * fast)) * ({friction})"
        free = f"{s} - ({friction})"
        if temperature is not None:
            warmth = f"({temperature} - ({numbers.reference!r}))"
            free = f"exp({numbers.gain_slope!r} * {warmth}) * ({free}) + {numbers.shift_slope!r} * {warmth}"
        return Code(update=f"{{ {before}{name} = {free}; }}")
