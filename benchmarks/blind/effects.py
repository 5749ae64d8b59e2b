"""The effects of DIAGNOSIS.md, section 3, each as a change of the plant's physics.

An entry of `EFFECTS` tells on which plants an effect is drawn, which signals cannot show it, and how it is built. Left
out are combinations in which the effect does not exist (friction of a reactor) or is another one under a second name:
behind a signal of two levels every static curve is a straight line; the free static curve of the clutch model swallows
input and output curves; an integrator's initial state swallows a sensor's bias; where a plant settles, a bias of the
input is one of the sensor.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from math import exp, sin

import numpy as np

from benchmarks.blind import memory
from benchmarks.blind.plants import REACTION, SUBSTEPS, THETA, TORQUE, Coupling, Friction, Map, Plant, Twist
from benchmarks.blind.signals import BINARY, SIGNALS, SMOOTH, make_signal
from relaxations.algebra.arrays import Array

__all__ = ["EFFECTS", "Effect", "slow_channel"]

Rng = np.random.Generator
Build = Callable[[Rng, Plant, Array, Array, Twist], Twist]

FLOWS = ("cstr", "linear1", "linear2", "clutch")  # no force against motion in them
STABLE = (*FLOWS, "arm_speed")
EVERY = (*STABLE, "arm_angle")
ARM = ("arm_speed", "arm_free")


@dataclass(frozen=True)
class Effect:
    """How an effect is drawn.

    Attributes
    ----------
    name : str
        Its name in DIAGNOSIS.md.
    build : callable
        ``build(rng, plant, u, y, twist)`` with the base output y; returns the twist with the effect in it.
    plants : tuple of str
        Where it is drawn.
    hidden_in : tuple of str
        Signals that cannot show it.
    needs : {"", "positive", "signed"}
        What it asks of the input's range.
    fixes : tuple of str
        What the base model must hold fixed.
    """

    name: str
    build: Build
    plants: tuple[str, ...]
    hidden_in: tuple[str, ...] = ()
    needs: str = ""
    fixes: tuple[str, ...] = ()

    @property
    def signals(self) -> tuple[str, ...]:
        """Signals that can show the effect."""
        return tuple(name for name in SIGNALS if name not in self.hidden_in)


def _between(rng: Rng, low: float, high: float) -> float:
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))


def _factor(rng: Rng, low: float, high: float) -> float:
    """Draw a factor or its reciprocal."""
    return float(_between(rng, low, high) ** rng.choice([-1, 1]))


def _after_input(twist: Twist, change: Map) -> Twist:
    return replace(twist, input=(*twist.input, change))


def _after_drive(twist: Twist, change: Map) -> Twist:
    return replace(twist, drive=(*twist.drive, change))


def _after_output(twist: Twist, change: Map) -> Twist:
    return replace(twist, output=(*twist.output, change))


def _scaled(twist: Twist, which: str, factor: Array) -> Twist:
    if which == "gain":
        return replace(twist, gain=factor if twist.gain is None else twist.gain * factor)
    return replace(twist, slow=factor if twist.slow is None else twist.slow * factor)


# Static and dynamic changes of the input


def input_dead_zone(rng: Rng, plant: Plant, u: Array, y: Array, twist: Twist) -> Twist:  # noqa: ARG001
    above = rng.uniform(0.12, 0.4) * plant.high
    below = rng.uniform(0.12, 0.4) * plant.low if rng.random() < 0.6 and plant.low < 0 else -above
    return _after_input(twist, lambda v: v - np.clip(v, below, above))


def input_saturation(rng: Rng, plant: Plant, u: Array, y: Array, twist: Twist) -> Twist:  # noqa: ARG001
    top = float(np.quantile(u, rng.uniform(0.65, 0.88)))
    bottom = float(np.quantile(u, rng.uniform(0.12, 0.35))) if plant.low < 0 and rng.random() < 0.6 else -np.inf
    return _after_input(twist, lambda v: np.clip(v, bottom, top))


def input_backlash(rng: Rng, plant: Plant, u: Array, y: Array, twist: Twist) -> Twist:  # noqa: ARG001
    gap = rng.uniform(0.1, 0.35) * (plant.high - plant.low)
    slack = rng.uniform(0, 1) * gap
    return _after_input(twist, lambda v: memory.play(v, gap, slack))


def input_curve(rng: Rng, plant: Plant, u: Array, y: Array, twist: Twist) -> Twist:  # noqa: ARG001
    size = max(abs(plant.low), plant.high)
    if rng.random() < 0.6:
        bend = float(rng.choice([-1, 1])) * rng.uniform(0.7, 1.6)
        return _after_input(twist, lambda v: size / bend * np.expm1(bend * v / size))
    knots = plant.low + (plant.high - plant.low) * np.array(
        [0.0, rng.uniform(0.25, 0.45), rng.uniform(0.55, 0.75), 1.0]
    )
    slopes = rng.permutation([rng.uniform(0.5, 0.7), rng.uniform(0.9, 1.1), rng.uniform(1.4, 2.0)])
    heights = np.concatenate([[0.0], np.cumsum(slopes * np.diff(knots))])
    heights -= np.interp(min(max(0.0, plant.low), plant.high), knots, heights)
    return _after_input(twist, lambda v: np.interp(v, knots, heights))


def input_bias(rng: Rng, plant: Plant, u: Array, y: Array, twist: Twist) -> Twist:
    # The way that it pushes the arm over the record, in deviations of what the input does.
    way = float(rng.choice([-1, 1])) * _between(rng, 0.3, 2.0) * float(np.std(y))
    bias = way / (plant.gain * len(u) * plant.sampling_time)
    return _after_input(twist, lambda v: v + bias)


def input_delay(rng: Rng, plant: Plant, u: Array, y: Array, twist: Twist) -> Twist:  # noqa: ARG001
    whole = _between(rng, 0.8, max(2.5, min(8.0, 0.6 * plant.tempo)))
    # A multiple of the substep, so that the switching instants of the held input are met exactly.
    shift = round(whole * SUBSTEPS) if rng.random() < 0.7 else round(whole + 0.5) * SUBSTEPS
    return _after_input(twist, lambda v: np.concatenate([np.zeros(shift), v[:-shift]]))


def variable_delay(rng: Rng, plant: Plant, u: Array, y: Array, twist: Twist) -> Twist:  # noqa: ARG001
    whole = _between(rng, 1.5, max(2.5, min(7.0, 0.6 * plant.tempo)))
    if plant.low > 0 and rng.random() < 0.3:  # what leaves is seen at the end of a pipe that the input flows through
        flow = u
        late, place = "sensor", twist.sensor
    else:
        top = _between(rng, 0.3, 30.0)
        wave = make_signal(str(rng.choice(["held_noise", "multisine", "steps"])), rng, len(u), 4 * plant.tempo)
        flow = top * (1 - rng.uniform(0.5, 0.75) * (1 - wave) / 2)
        twist = replace(twist, channels={**twist.channels, "flow": flow})
        late, place = "input", twist.input
    passing = np.repeat(flow, SUBSTEPS) / SUBSTEPS
    volume = whole * float(np.mean(flow))
    return replace(twist, **{late: (*place, lambda v: memory.pipe(v, passing, volume))})


def rate_limit(rng: Rng, plant: Plant, u: Array, y: Array, twist: Twist) -> Twist:  # noqa: ARG001
    crossing = rng.uniform(0.6, 3.0) * max(4.0, plant.tempo)  # samples from one end of the range to the other
    limit = (plant.high - plant.low) / (crossing * SUBSTEPS)
    return _after_input(twist, lambda v: memory.slope_limited(v, limit))


def input_noise(rng: Rng, plant: Plant, u: Array, y: Array, twist: Twist) -> Twist:  # noqa: ARG001
    size = rng.uniform(0.05, 0.15) * (plant.high - plant.low)
    return replace(twist, input_error=size * rng.uniform(-1, 1, len(u)))


def hysteresis(rng: Rng, plant: Plant, u: Array, y: Array, twist: Twist) -> Twist:  # noqa: ARG001
    share = rng.uniform(0.35, 0.85)
    return _after_input(twist, lambda v: memory.relays(v, plant.low, plant.high, share))


def extra_lag(rng: Rng, plant: Plant, u: Array, y: Array, twist: Twist) -> Twist:  # noqa: ARG001
    ratio = 1 / (SUBSTEPS * plant.tempo * rng.uniform(0.4, 1.2))
    return _after_drive(twist, lambda v: memory.lag(v, ratio))


def resonance(rng: Rng, plant: Plant, u: Array, y: Array, twist: Twist) -> Twist:  # noqa: ARG001
    period = max(7.0, plant.tempo * rng.uniform(2.0, 6.0))
    damping = _between(rng, 0.05, 0.35)
    return _after_drive(twist, lambda v: memory.ring(v, 2 * np.pi / (period * SUBSTEPS), damping))


def valve_stiction(rng: Rng, plant: Plant, u: Array, y: Array, twist: Twist) -> Twist:  # noqa: ARG001
    breakaway = rng.uniform(0.12, 0.3) * (plant.high - plant.low)
    sliding = rng.uniform(0.15, 0.7) * breakaway
    return _after_input(twist, lambda v: memory.sticking_valve(v, breakaway, sliding))


def inner_curve(rng: Rng, plant: Plant, u: Array, y: Array, twist: Twist) -> Twist:  # noqa: ARG001
    ratio = 1 / (SUBSTEPS * plant.tempo * rng.uniform(0.4, 1.2))
    inner = memory.lag(np.repeat(u, SUBSTEPS), ratio)
    form, (low, high) = rng.random(), np.quantile(inner, [0.02, 0.98])
    if form < 0.4:
        bottom = low + rng.uniform(0.1, 0.3) * (high - low) if rng.random() < 0.5 else -np.inf
        top = high - rng.uniform(0.15, 0.35) * (high - low)
        return _after_drive(twist, lambda v: np.clip(memory.lag(v, ratio), bottom, top))
    if form < 0.7:
        dead = rng.uniform(0.2, 0.45) * max(high, -low)
        return _after_drive(twist, lambda v: (w := memory.lag(v, ratio)) - np.clip(w, -dead, dead))
    # A diode that leaks: beyond its knee, a piece of another slope.
    knee, leak = low + rng.uniform(0.35, 0.65) * (high - low), rng.uniform(0.0, 0.35)
    knots, slopes = np.array([2 * low - high, knee, 2 * high - low]), rng.permutation([leak, 1.0])
    heights = np.concatenate([[0.0], np.cumsum(slopes * np.diff(knots))])
    heights -= np.interp(0.0, knots, heights)
    return _after_drive(twist, lambda v: np.interp(memory.lag(v, ratio), knots, heights))


# Changes of gain and time constant


def gain(rng: Rng, plant: Plant, u: Array, y: Array, twist: Twist) -> Twist:  # noqa: ARG001
    factor, ones = _factor(rng, 1.12, 1.7), np.ones(len(u) * SUBSTEPS)
    if plant.name == "cstr":  # the factor a before y in table 2 of the hybrid thesis: gain and speed together
        return _scaled(_scaled(twist, "gain", ones / factor), "slow", ones / factor)
    return _scaled(twist, "gain", factor * ones)


def time_constant(rng: Rng, plant: Plant, u: Array, y: Array, twist: Twist) -> Twist:  # noqa: ARG001
    factor, ones = _factor(rng, 1.25, 2.0), np.ones(len(u) * SUBSTEPS)
    if plant.name == "cstr":  # the gain 1 - 0.12 tau of eq. 5.6 follows
        twist = _scaled(twist, "gain", ones * (1 - REACTION * plant.tau * factor) / plant.gain)
    return _scaled(twist, "slow", factor * ones)


def _gain_or_slow(rng: Rng, plant: Plant) -> str:
    return "gain" if plant.name == "arm_angle" or rng.random() < 0.5 else "slow"


def parameter_change(rng: Rng, plant: Plant, u: Array, y: Array, twist: Twist) -> Twist:  # noqa: ARG001
    which = _gain_or_slow(rng, plant)
    at = int(rng.uniform(0.2, 0.6) * len(u))
    factor = np.ones(len(u))
    factor[at:] = _factor(rng, 1.15, 1.6) if which == "gain" else _factor(rng, 1.5, 2.5)
    return _scaled(twist, which, np.repeat(factor, SUBSTEPS))


def parameter_drift(rng: Rng, plant: Plant, u: Array, y: Array, twist: Twist) -> Twist:  # noqa: ARG001
    which = _gain_or_slow(rng, plant)
    total = _factor(rng, 1.3, 1.9) if which == "gain" else _factor(rng, 1.8, 3.0)
    time = np.arange(len(u) * SUBSTEPS) / (len(u) * SUBSTEPS)
    return _scaled(twist, which, 1 + (total - 1) * time if rng.random() < 0.5 else total**time)


def slow_channel(rng: Rng, n: int) -> Array:
    """Draw a temperature in degC that wanders smoothly or in steps, and passes its range several times."""
    if rng.random() < 0.5:
        rounds = rng.uniform(2.5, 7.0, 3)
        waves = np.sin(2 * np.pi * np.outer(np.arange(n) / n, rounds) + rng.uniform(0, 2 * np.pi, 3))
        z = waves @ rng.uniform(0.3, 1.0, 3)
    else:
        hold = int(rng.integers(n // 16, n // 9))
        z = np.repeat(rng.uniform(-1, 1, n // hold + 1), hold)[:n]
    z = (z - np.min(z)) / np.ptp(z)
    return np.round(rng.uniform(-20, 25) + rng.uniform(30, 60) * z, 2)


def scheduled_parameter(rng: Rng, plant: Plant, u: Array, y: Array, twist: Twist) -> Twist:  # noqa: ARG001
    which = _gain_or_slow(rng, plant)
    temperature = slow_channel(rng, len(u))
    total = _factor(rng, 1.3, 2.0) if which == "gain" else _factor(rng, 1.8, 3.0)
    # Viscosity falls exponentially with temperature (data/README.md), and the parameter with it.
    factor = total ** ((temperature - np.mean(temperature)) / np.ptp(temperature))
    twist = replace(twist, channels={**twist.channels, "temperature": temperature})
    return _scaled(twist, which, np.repeat(factor, SUBSTEPS))


def operating_point(rng: Rng, plant: Plant, u: Array, y: Array, twist: Twist) -> Twist:  # noqa: ARG001
    low, high = np.quantile(y, [0.02, 0.98])
    middle, width = float(low + high) / 2, float(high - low)
    strength = float(rng.choice([-1, 1])) * rng.uniform(0.8, 1.6)
    # Beyond the usual levels the parameter stays as it is at their ends.
    if plant.name != "clutch" and rng.random() < 0.3:
        strength *= 0.6
        return replace(twist, gain_of=lambda x: exp(strength * max(-0.6, min(0.6, (x - middle) / width))))
    return _slowed(twist, lambda x, drive, rate: exp(strength * max(-0.6, min(0.6, (x - middle) / width))))  # noqa: ARG005


def direction_dependence(rng: Rng, plant: Plant, u: Array, y: Array, twist: Twist) -> Twist:  # noqa: ARG001
    ratio = _between(rng, 1.6, 3.0) ** 0.5
    up, down = (ratio, 1 / ratio) if rng.random() < 0.5 else (1 / ratio, ratio)
    return _slowed(twist, lambda x, drive, rate: up if rate > 0 else down)  # noqa: ARG005


def _slowed(twist: Twist, factor: Callable[[float, float, float], float]) -> Twist:
    before = twist.slow_of
    if before is None:
        return replace(twist, slow_of=factor)
    return replace(twist, slow_of=lambda x, drive, rate: before(x, drive, rate) * factor(x, drive, rate))


def power_law(rng: Rng, plant: Plant, u: Array, y: Array, twist: Twist) -> Twist:  # noqa: ARG001
    return replace(twist, power=_between(rng, 1.4, 3.0) if rng.random() < 0.7 else rng.uniform(0.5, 0.7))


def square_root_outflow(rng: Rng, plant: Plant, u: Array, y: Array, twist: Twist) -> Twist:  # noqa: ARG001
    # Torricelli: the full tank empties as the linear one does. The outlet may lie below the sensor's zero.
    full = float(np.max(np.abs(y)))
    below = rng.uniform(0.02, 0.1) * full if rng.random() < 0.3 else 0.0
    outflow = full / (full + below) ** 0.5 / plant.tau
    return _pushed(twist, lambda x, drive: x / plant.tau - outflow * max(0.0, x + below) ** 0.5)  # noqa: ARG005


def bilinear(rng: Rng, plant: Plant, u: Array, y: Array, twist: Twist) -> Twist:  # noqa: ARG001
    share = rng.choice([-1, 1]) * rng.uniform(0.25, 0.6)
    decay = plant.tau**-2 if plant.name == "linear2" else 1 / plant.tau
    factor = float(share * decay / max(abs(plant.low), plant.high))
    return _pushed(twist, lambda x, drive: factor * drive * x)


def _pushed(twist: Twist, push: Callable[[float, float], float]) -> Twist:
    before = twist.push
    if before is None:
        return replace(twist, push=push)
    return replace(twist, push=lambda x, drive: before(x, drive) + push(x, drive))


def stiffness(rng: Rng, plant: Plant, u: Array, y: Array, twist: Twist) -> Twist:  # noqa: ARG001
    reach, soft = float(np.quantile(np.abs(y), 0.98)), plant.tau**-2
    if rng.random() < 0.65:
        bend = rng.uniform(0.4, 2.0) if rng.random() < 0.75 else -rng.uniform(0.08, 0.2)
        # Far out the spring is straight again, so that a soft one never pushes outwards.
        return _pushed(twist, lambda x, drive: -bend * soft * x * min(abs(x) / reach, 2.0) ** 2)  # noqa: ARG005
    gap, hard = rng.uniform(0.25, 0.6) * reach, rng.uniform(1.0, 3.0) * soft
    return _pushed(twist, lambda x, drive: -hard * (x - max(-gap, min(gap, x))))  # noqa: ARG005


def gravity(rng: Rng, plant: Plant, u: Array, y: Array, twist: Twist) -> Twist:  # noqa: ARG001
    weight = rng.uniform(0.1, 0.5) * _torque(plant)
    zero = rng.uniform(-0.8, 0.8) if rng.random() < 0.4 else 0.0  # angle at which the sensor shows the arm hanging
    return _pushed(twist, lambda x, drive: -weight * sin(x - zero))  # noqa: ARG005


# Other causes beside the input


def missing_input(rng: Rng, plant: Plant, u: Array, y: Array, twist: Twist) -> Twist:
    name = str(rng.choice(["held_noise", "steps", "multisine", "qprts"]))
    wave = make_signal(name, rng, len(u), max(4.0, plant.tempo) * rng.uniform(0.6, 2.0))
    unit = _between(rng, 0.3, 30.0)
    if plant.order == 1 and rng.random() < 0.3 and plant.name != "arm_free":
        ratio = 1 / (plant.tempo * rng.uniform(0.5, 2.0))
        size = float(rng.choice([-1, 1])) * _between(rng, 0.15, 0.8) * float(np.std(y))
        behind = memory.lag(np.repeat(wave, SUBSTEPS), ratio / SUBSTEPS)
        sampled = np.concatenate([[0.0], behind])[::SUBSTEPS][: len(u)]
        twist = _after_output(twist, lambda w: w + size * sampled)
    else:
        drive = plant.high - plant.low if plant.name != "clutch" else 25.0
        size = float(rng.choice([-1, 1])) * _between(rng, 0.08, 0.4) * drive
        held = np.repeat(size * wave, SUBSTEPS)
        twist = _after_drive(twist, lambda v: v + held)
    return replace(twist, channels={**twist.channels, "inflow": unit * wave})


def periodic_disturbance(rng: Rng, plant: Plant, u: Array, y: Array, twist: Twist) -> Twist:
    period, phase = _between(rng, 6.0, 150.0), rng.uniform(0, 2 * np.pi)
    if plant.name in FLOWS and rng.random() < 0.3:
        time = np.arange(len(u) * SUBSTEPS) / SUBSTEPS
        size = rng.uniform(0.1, 0.4) * (float(np.ptp(y)) / abs(plant.gain))
        return _after_drive(twist, lambda v: v + size * np.sin(2 * np.pi * time / period + phase))
    size = _between(rng, 0.08, 0.5) * float(np.std(y))
    wave = size * np.sin(2 * np.pi * np.arange(len(u)) / period + phase)
    return _after_output(twist, lambda w: w + wave)


# Friction: forces as parts of the motor's largest torque, drag by the speeds that occur


def _torque(plant: Plant) -> float:
    return THETA * TORQUE * plant.high


def _friction(twist: Twist) -> Friction:
    return twist.friction or Friction()


def coulomb_friction(rng: Rng, plant: Plant, u: Array, y: Array, twist: Twist) -> Twist:  # noqa: ARG001
    level = rng.uniform(0.08, 0.3) * _torque(plant)
    return replace(twist, friction=replace(_friction(twist), sliding=level, breakaway=level))


def stribeck_friction(rng: Rng, plant: Plant, u: Array, y: Array, twist: Twist) -> Twist:  # noqa: ARG001
    level = rng.uniform(0.06, 0.15) * _torque(plant)
    speed = y if plant.name != "arm_angle" else np.gradient(y, plant.sampling_time)
    fading = rng.uniform(0.15, 0.5) * float(np.std(speed))
    breakaway = level * rng.uniform(2.0, 3.5)  # 1.2 / 0.43 in the hybrid thesis, eq. 5.8
    friction = replace(_friction(twist), sliding=level, breakaway=breakaway, fading=fading)
    return replace(twist, friction=friction)


def viscous_friction(rng: Rng, plant: Plant, u: Array, y: Array, twist: Twist) -> Twist:  # noqa: ARG001
    decay = 1 / (rng.uniform(4.0, 30.0) * plant.sampling_time)
    return replace(twist, friction=replace(_friction(twist), viscous=decay))


def quadratic_drag(rng: Rng, plant: Plant, u: Array, y: Array, twist: Twist) -> Twist:  # noqa: ARG001
    if plant.name == "arm_free":  # the speed at which drag balances the largest torque
        final = _torque(plant) * plant.sampling_time * rng.uniform(4.0, 15.0)
        drag = _torque(plant) / final**2
    else:
        speed = y if plant.name == "arm_speed" else np.gradient(y, plant.sampling_time)
        drag = rng.uniform(0.5, 3.0) / (plant.tau * 2 * float(np.std(speed)))
    return replace(twist, friction=replace(_friction(twist), drag=drag))


def load_friction(rng: Rng, plant: Plant, u: Array, y: Array, twist: Twist) -> Twist:  # noqa: ARG001
    level = rng.uniform(0.2, 0.5) * _torque(plant)  # at the largest load
    load = slow_channel(rng, len(u))
    load = rng.uniform(0.0, 0.2) + (load - np.min(load)) / np.ptp(load)
    pressing = np.repeat(load / np.max(load), SUBSTEPS)
    twist = replace(twist, channels={**twist.channels, "load": _between(rng, 1.0, 100.0) * load})
    return replace(twist, friction=replace(_friction(twist), sliding=level, breakaway=level, load=pressing))


def elastic_coupling(rng: Rng, plant: Plant, u: Array, y: Array, twist: Twist) -> Twist:  # noqa: ARG001
    share, damping = rng.uniform(0.2, 0.7), _between(rng, 0.02, 0.2)
    omega = 2 * np.pi * np.sqrt(1 - share) / (_between(rng, 6.0, 25.0) * plant.sampling_time)
    at_second = bool(rng.random() < 0.6)
    gap = 0.0
    if at_second and rng.random() < 0.4:
        # The twist that the largest drive holds, and as much again.
        gap = rng.uniform(0.3, 1.5) * share * _torque(plant) / omega**2
    return replace(twist, coupling=Coupling(share, omega, damping, gap, at_second))


# The sensor


def output_curve(rng: Rng, plant: Plant, u: Array, y: Array, twist: Twist) -> Twist:  # noqa: ARG001
    top = float(np.max(np.abs(y)))
    form = rng.random()
    if plant.name == "cstr" and form < 0.35:
        return _after_output(twist, lambda w: np.sqrt(np.maximum(w, 0.0)))  # hybrid thesis, table 2
    if form < 0.65:
        turn = rng.uniform(1.2, 1.9) / top  # the sine of table 2, up to and a little beyond its top
        size = _between(rng, 0.4, 2.0) * top
        return _after_output(twist, lambda w: size * np.sin(turn * w))
    bend = float(rng.choice([-1, 1])) * rng.uniform(0.7, 1.5)
    return _after_output(twist, lambda w: top / bend * np.expm1(bend * w / top))


def output_saturation(rng: Rng, plant: Plant, u: Array, y: Array, twist: Twist) -> Twist:  # noqa: ARG001
    top = float(np.quantile(y, rng.uniform(0.72, 0.92)))
    bottom = float(np.quantile(y, rng.uniform(0.08, 0.28))) if plant.low < 0 and rng.random() < 0.4 else -np.inf
    return _after_output(twist, lambda w: np.clip(w, bottom, top))


def sensor_bias(rng: Rng, plant: Plant, u: Array, y: Array, twist: Twist) -> Twist:  # noqa: ARG001
    bias = float(rng.choice([-1, 1])) * _between(rng, 0.08, 0.6) * float(np.std(y))
    return _after_output(twist, lambda w: w + bias)


def sensor_drift(rng: Rng, plant: Plant, u: Array, y: Array, twist: Twist) -> Twist:  # noqa: ARG001
    total = float(rng.choice([-1, 1])) * _between(rng, 0.3, 2.0) * float(np.std(y))
    drift = total * (np.arange(len(u)) / len(u)) ** rng.uniform(1.0, 1.2)
    return _after_output(twist, lambda w: w + drift)


def sensor_lag(rng: Rng, plant: Plant, u: Array, y: Array, twist: Twist) -> Twist:  # noqa: ARG001
    ratio = 1 / (SUBSTEPS * plant.tempo * rng.uniform(0.3, 1.2))
    return replace(twist, sensor=(*twist.sensor, lambda w: memory.lag(w, ratio)), seen_twice=True)


def outliers(rng: Rng, plant: Plant, u: Array, y: Array, twist: Twist) -> Twist:  # noqa: ARG001
    return replace(twist, glitches=rng.uniform(0.01, 0.04))


def quantisation(rng: Rng, plant: Plant, u: Array, y: Array, twist: Twist) -> Twist:  # noqa: ARG001
    return replace(twist, quantised=True)


def multiplicative_noise(rng: Rng, plant: Plant, u: Array, y: Array, twist: Twist) -> Twist:  # noqa: ARG001
    return replace(twist, growing=_between(rng, 4.0, 20.0))


_SLOW_EDGES = (*BINARY, *SMOOTH)
_CURVED = ("cstr", "linear1", "linear2", "arm_speed")
EFFECTS: dict[str, Effect] = {
    effect.name: effect
    for effect in (
        Effect("input_dead_zone", input_dead_zone, (*_CURVED, "arm_angle"), BINARY, needs="signed"),
        Effect("input_saturation", input_saturation, EVERY, BINARY),
        Effect("input_backlash", input_backlash, STABLE, BINARY),
        Effect("input_curve", input_curve, _CURVED, BINARY),
        Effect("input_bias", input_bias, ("arm_angle", "arm_free")),
        Effect("input_delay", input_delay, (*EVERY, "arm_free"), SMOOTH),
        Effect("variable_delay", variable_delay, ("cstr", "linear1", "linear2"), SMOOTH),
        Effect("rate_limit", rate_limit, STABLE, _SLOW_EDGES),
        Effect("input_noise", input_noise, STABLE),
        Effect("gain", gain, ("cstr", "linear1"), fixes=("gain", "tau")),
        Effect("time_constant", time_constant, ("cstr", "linear1"), SMOOTH, fixes=("gain", "tau")),
        Effect("extra_lag", extra_lag, STABLE, SMOOTH),
        Effect("resonance", resonance, STABLE, SMOOTH),
        Effect("power_law", power_law, ("cstr", "linear1"), BINARY, needs="positive"),
        Effect("operating_point", operating_point, STABLE, _SLOW_EDGES),
        Effect("direction_dependence", direction_dependence, STABLE, _SLOW_EDGES),
        Effect("parameter_change", parameter_change, EVERY, SMOOTH),
        Effect("parameter_drift", parameter_drift, EVERY, SMOOTH),
        Effect("scheduled_parameter", scheduled_parameter, EVERY, SMOOTH),
        Effect("missing_input", missing_input, EVERY),
        Effect("coulomb_friction", coulomb_friction, (*ARM, "arm_angle"), BINARY),
        Effect("stribeck_friction", stribeck_friction, ARM, BINARY),
        Effect("viscous_friction", viscous_friction, ("arm_free",)),
        Effect("quadratic_drag", quadratic_drag, ARM, BINARY),
        Effect("load_friction", load_friction, (*ARM, "arm_angle"), BINARY),
        Effect("elastic_coupling", elastic_coupling, (*ARM, "arm_angle"), SMOOTH),
        Effect("hysteresis", hysteresis, STABLE, BINARY),
        Effect("output_curve", output_curve, _CURVED, BINARY),
        Effect("output_saturation", output_saturation, STABLE, BINARY),
        Effect("sensor_bias", sensor_bias, STABLE, BINARY),
        Effect("sensor_drift", sensor_drift, STABLE),
        Effect("sensor_lag", sensor_lag, STABLE, SMOOTH),
        Effect("outliers", outliers, (*EVERY, "arm_free")),
        Effect("quantisation", quantisation, (*EVERY, "arm_free")),
        Effect("multiplicative_noise", multiplicative_noise, (*STABLE, "arm_free"), BINARY),
        Effect("periodic_disturbance", periodic_disturbance, (*EVERY, "arm_free")),
        Effect("valve_stiction", valve_stiction, STABLE, BINARY),
        Effect("stiffness", stiffness, ("linear2",), BINARY),
        Effect("gravity", gravity, ("arm_angle",), BINARY),
        Effect("square_root_outflow", square_root_outflow, ("cstr", "linear1"), BINARY, needs="positive"),
        Effect("bilinear", bilinear, _CURVED, BINARY),
        Effect("inner_curve", inner_curve, _CURVED, SMOOTH),
    )
}
