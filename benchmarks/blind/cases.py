"""One blind case from a seed: plant, input, effects, noise.

Strength of a case: ``rms(y - base) / rms(noise)``, with ``y`` the noise-free output with the effect and ``base`` the
best fit to it of the base model, parameters and initial state (`refit.misfit`). The misfit is computed first; the noise
level is then set so that the strength is a log-uniform draw between 3 and 20. A draw is thrown away, and everything
drawn again, when the noise would exceed 20 % of the output's standard deviation, or the misfit is below 3 % of it (then
the integration error of a model at the sampling time would be seen beside the effect), or the effect shows
in one part of the record only: the first 80 % must hold 0.6, the last 20 %, the test part, 0.3 of the rms misfit.

Which effects are hidden follows from their rank in a hash of seed, kind and name, and every draw from a generator of
its own for these effects: an effect that is added to the list changes only the cases that it enters.

A single effect must also be told apart by the record, whoever looks: where the obvious rival explains the noise-free
output up to half the noise, everything is drawn again. Guarded so are, against a free polynomial of the input,
`output_curve`, `operating_point`, `power_law`, `square_root_outflow`, `stiffness` and `bilinear` (on a slow input each
is a static curve), and `stribeck_friction` against Coulomb friction.

Effects that leave no mean misfit have a strength of their own:

    input_noise     rms of the output with true minus with recorded input, over rms of the noise
    outliers        rms of the glitches over rms of the noise; each is at least five noise bounds
    quantisation    step over rms of the noise; the noise bound handed over covers half a step more
    multiplicative_noise  noise at the largest magnitude of the output over that at zero

Several effects: the smallest of their strengths, each the smaller of (i) that of the effect alone and (ii) the rms by
which taking it out of the case changes the output, over the rms of the noise.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from zlib import crc32

import numpy as np
from scipy.optimize import least_squares

from benchmarks.blind.base_models import base_model
from benchmarks.blind.effects import EFFECTS, Effect, slow_channel
from benchmarks.blind.plants import Friction, Plant, Twist, draw_plant, simulate
from benchmarks.blind.refit import misfit
from benchmarks.blind.signals import SIGNALS, make_signal
from relaxations.algebra.arrays import Array
from smid import Dataset, Model
from smid.models import Measurement

__all__ = ["TEST", "Case", "draw", "ranked"]

Rng = np.random.Generator
TEST, WEAKEST, STRONGEST, LOUDEST, FAINTEST = 0.2, 3.0, 20.0, 0.2, 0.03
SPECIAL = ("input_noise", "outliers", "quantisation", "multiplicative_noise")
PLANTS = ("clutch", "cstr", "arm_speed", "arm_angle", "arm_free", "linear1", "linear2")
KINDS = ("none", "single", "pair", "triple")
ATTEMPTS, APART, DEGREE = 40, 0.5, 5

# What the walk of two masses leaves out.
RIGID = (
    *("coulomb_friction", "stribeck_friction", "load_friction", "viscous_friction", "quadratic_drag"),
    *("operating_point", "direction_dependence", "time_constant"),
    *("parameter_change", "parameter_drift", "scheduled_parameter"),
    *("gravity", "bilinear"),
)
# What is a static curve on a slow input.
CURVED = ("output_curve", "operating_point", "power_law", "square_root_outflow", "stiffness", "bilinear")
# Pairs that are nearly one effect twice: two static curves in one place, two slow motions of one thing, two lags.
SAME = (
    {"input_dead_zone", "input_saturation", "input_curve", "inner_curve"},
    {"output_curve", "output_saturation"},
    {"input_backlash", "hysteresis", "valve_stiction"},
    {"parameter_change", "parameter_drift"},
    {"sensor_bias", "sensor_drift"},
    {"coulomb_friction", "stribeck_friction", "load_friction"},
    {"viscous_friction", "quadratic_drag"},
    {"elastic_coupling", "resonance"},
    *({"elastic_coupling", other} for other in RIGID),
    {"input_delay", "variable_delay", "extra_lag", "sensor_lag", "resonance", "rate_limit", "inner_curve"},
    {"power_law", "square_root_outflow", "operating_point", "direction_dependence", "output_curve"},
    {"gain", "time_constant", "parameter_change", "parameter_drift"},
)


@dataclass(frozen=True)
class Case:
    """A blind case: what the diagnosis is given, and what it has to find.

    Attributes
    ----------
    seed : int
        Seed of every choice.
    data : Dataset
        One experiment; extra channels may be decoys.
    model : Model
        The base model.
    noise_bound : float
        True bound on the output's noise, in the output's unit; glitches are no noise.
    truth : tuple of str
        Hidden effects.
    plant, signal : str
        Names of the base plant and of the input signal.
    clean : numpy.ndarray, shape (n,)
        Noise-free output, sensor effects included.
    predictable : numpy.ndarray, shape (n,)
        What the true model computes from the recorded data; differs from `clean` by the input's noise only.
    strength : float
        As the head of the module defines it; 0 without effect.
    noise : numpy.ndarray, shape (n,)
        The noise alone, without rounding and glitches.
    misfit : numpy.ndarray, shape (n,)
        What the base model cannot explain of the noise-free output.
    fixed : tuple of str
        What the base model holds fixed.
    attempts : int
        Draws made until one was accepted.
    """

    seed: int
    data: Dataset
    model: Model
    noise_bound: float
    truth: tuple[str, ...]
    plant: str
    signal: str
    clean: Array
    predictable: Array
    strength: float
    noise: Array
    misfit: Array
    fixed: tuple[str, ...]
    attempts: int


@dataclass(frozen=True)
class _Setting:
    """Plant, input and names of the effects, before their sizes are drawn."""

    plant: Plant
    signal: str
    u: Array
    start: float
    fixed: tuple[str, ...]


def draw(seed: int, effects: int = 1, samples: int = 1000) -> Case:
    """Draw a case.

    Parameters
    ----------
    seed : int
        Seed of every choice.
    effects : {0, 1, 2, 3}
        How many effects are hidden.
    samples : int
        Length of the record; at least 200.

    Returns
    -------
    Case
        The same for the same arguments, bit by bit.

    Raises
    ------
    ValueError
        If the number of effects or of samples is not of these.

    Examples
    --------
    >>> draw(0).truth == (ranked(0, "single")[0],)
    True
    """
    if effects not in range(len(KINDS)) or samples < 200:
        raise ValueError(f"effects = {effects}, samples = {samples}: hide 0 to 3 effects in at least 200 samples")
    attempts = 0
    for chosen in _choices(seed, effects):
        rng = np.random.default_rng([seed, samples, *(crc32(effect.name.encode()) for effect in chosen)])
        for _ in range(ATTEMPTS):
            attempts += 1
            setting = _setting(rng, chosen, samples)
            case = _hidden(rng, setting, chosen) if chosen else _null(rng, setting)
            if case is not None:
                return replace(case, seed=seed, attempts=attempts)
    raise RuntimeError(f"seed {seed}: no choice of {effects} effects has an acceptable draw in {ATTEMPTS} attempts")


def ranked(seed: int, kind: str) -> list[str]:
    """Return the names of all effects, in an order that an added effect does not change.

    The order is by a cryptographic hash: cyclic sums of names of one length differ by constants, and so favour some.

    Parameters
    ----------
    seed : int
        Seed of the case.
    kind : {"single", "pair", "triple"}
        How many effects are hidden.

    Returns
    -------
    list of str
        The first are hidden, as far as they can stand together.

    Examples
    --------
    >>> sorted(ranked(0, "pair")) == sorted(EFFECTS)
    True
    """
    return sorted(EFFECTS, key=lambda name: hashlib.sha256(f"{seed} {kind} {name}".encode()).digest())


def _choices(seed: int, effects: int) -> Iterator[tuple[Effect, ...]]:
    """Yield the sets of effects that can stand together, the one of the first ranks first."""
    for names in combinations(ranked(seed, KINDS[effects]), effects):
        chosen = tuple(EFFECTS[name] for name in names)
        same = any(len(group.intersection(names)) > 1 for group in SAME)
        if not same and len(_needs(chosen)) < 2 and _plants(chosen, _fixed(chosen)) and _signals(chosen):
            yield chosen


def _needs(chosen: Sequence[Effect]) -> set[str]:
    return {effect.needs for effect in chosen if effect.needs}


def _fixed(chosen: Sequence[Effect]) -> tuple[str, ...]:
    return tuple(sorted({name for effect in chosen for name in effect.fixes}))


def _signals(chosen: Sequence[Effect]) -> list[str]:
    return [name for name in SIGNALS if all(name in effect.signals for effect in chosen)]


def _plants(chosen: Sequence[Effect], fixed: Sequence[str]) -> list[str]:
    shared = [name for name in PLANTS if all(name in effect.plants for effect in chosen)]
    return [name for name in shared if not fixed or name in ("cstr", "linear1")]


def _setting(rng: Rng, chosen: tuple[Effect, ...], samples: int) -> _Setting:
    fixed = _fixed(chosen)
    if not chosen and rng.random() < 0.15:
        fixed = ("gain", "tau")
    plant = draw_plant(rng, str(rng.choice(_plants(chosen, fixed))), "".join(_needs(chosen)))
    signal = str(rng.choice(_signals(chosen)))
    z = make_signal(signal, rng, samples, plant.tempo)
    if plant.balanced:
        z = (z - np.mean(z)) / np.max(np.abs(z - np.mean(z)))
    u = plant.low + (plant.high - plant.low) * (1 + z) / 2
    start = 0.0
    if rng.random() < 0.25:
        rest = simulate(plant, Twist(), u)
        start = float(rng.uniform(0.2, 1.0) * rng.choice(rest[len(rest) // 2 :]))
    return _Setting(plant, signal, u, start, fixed)


def _null(rng: Rng, setting: _Setting) -> Case:
    y = simulate(setting.plant, Twist(), setting.u, setting.start)
    noise, bound = _noise(rng, len(y), float(np.std(y)) * float(np.exp(rng.uniform(np.log(0.004), np.log(0.15)))))
    return _case(rng, setting, Twist(), (), setting.u, (y, y), noise, bound, 0.0, np.zeros(len(y)))


def _hidden(rng: Rng, setting: _Setting, chosen: tuple[Effect, ...]) -> Case | None:
    plant, u, start = setting.plant, setting.u, setting.start
    base = simulate(plant, Twist(), u, start)
    # Each effect has a generator of its own, so that it is the same alone and among others.
    seeds = rng.integers(2**63, size=len(chosen))

    def built(effects: Sequence[int]) -> Twist:
        twist = Twist()
        for k in effects:
            twist = chosen[k].build(np.random.default_rng(seeds[k]), plant, u, base, twist)
        return twist

    every = range(len(chosen))
    twist = built(every)
    recorded = u if twist.input_error is None else u + twist.input_error
    predictable = simulate(plant, twist, recorded, start)
    y = predictable if twist.input_error is None else simulate(plant, twist, u, start)
    size = float(np.std(y))
    if not (np.all(np.isfinite(y)) and 0.2 * np.std(base) < size < 8 * np.std(base) + 1e-300):
        return None
    rest = misfit(plant, u, y, setting.fixed)
    parts = []
    for k, effect in enumerate(chosen):
        others = built([other for other in every if other != k]) if len(chosen) > 1 else None
        part = _part(setting, effect, built([k]), others, y, predictable)
        if part is not None and not (FAINTEST * size <= part):
            return None
        parts.append(part)
    seen = [part for part in parts if part is not None]
    if seen and not set(SPECIAL) & {effect.name for effect in chosen} and not _spread_out(rest):
        return None
    wanted = float(np.exp(rng.uniform(np.log(WEAKEST), np.log(STRONGEST))))
    if seen:
        level = min(seen) / wanted
        if level > LOUDEST * size:
            return None
        strength = wanted
        if len(chosen) == 1 and _rival_rest(setting, chosen[0], twist, y) < APART * level:
            return None
    else:
        level = size * float(np.exp(rng.uniform(np.log(0.005), np.log(0.06))))
        strength = 0.0
    noise, bound = _noise(rng, len(y), level)
    names = tuple(effect.name for effect in chosen)
    return _case(rng, setting, twist, names, recorded, (y, predictable), noise, bound, strength, rest)


def _part(
    setting: _Setting, effect: Effect, single: Twist, others: Twist | None, y: Array, predictable: Array
) -> float | None:
    """Return the rms that makes an effect visible; None for what is done to the noise."""
    plant, u, start = setting.plant, setting.u, setting.start
    if effect.name in SPECIAL and effect.name != "input_noise":
        return None
    if effect.name == "input_noise":
        return _rms(y - predictable)
    alone = simulate(plant, single, u, start)
    part = _rms(misfit(plant, u, alone, setting.fixed))
    if others is not None:
        part = min(part, _rms(y - simulate(plant, others, u, start)))
    return part


def _rival_rest(setting: _Setting, effect: Effect, twist: Twist, y: Array) -> float:
    """Return the rms that the obvious rival of an effect leaves, infinite where none is guarded against."""
    plant, u = setting.plant, setting.u
    if effect.name in CURVED and plant.name != "clutch":
        return _rms(misfit(plant, u, y, powers=DEGREE))
    if effect.name == "stribeck_friction" and twist.friction is not None:
        level = twist.friction.sliding

        def left(z: Array) -> Array:
            gain, decay, sliding = np.exp(z)
            tau = plant.tau / decay
            # Push and decay are gain / tau and 1 / tau; the integrating arm has no decay of its own.
            other = replace(plant, gain=plant.gain * gain * (1.0 if plant.balanced else tau / plant.tau), tau=tau)
            friction = Friction(sliding=sliding * level, breakaway=sliding * level)
            return simulate(other, Twist(friction=friction), u, setting.start) - y

        found = least_squares(left, np.array([0.0, 0.0, 0.4]), diff_step=[0.02] * 3, max_nfev=5)
        return _rms(found.fun)
    return float("inf")


def _spread_out(rest: Array) -> bool:
    split = round((1 - TEST) * len(rest))
    return _rms(rest[:split]) > 0.6 * _rms(rest) and _rms(rest[split:]) > 0.3 * _rms(rest)


def _rms(x: Array) -> float:
    return float(np.sqrt(np.mean(x**2)))


def _noise(rng: Rng, n: int, level: float) -> tuple[Array, float]:
    """Draw noise of that very rms and its bound: uniform, triangular, or a Gaussian cut at 2.5 deviations."""
    kind = int(rng.integers(3))
    if kind == 0:
        shape = rng.uniform(-1, 1, n)
    elif kind == 1:
        shape = rng.triangular(-1, 0, 1, n)
    else:
        shape = rng.standard_normal(n) / 2.5
        while np.any(far := np.abs(shape) > 1):
            shape[far] = rng.standard_normal(int(np.sum(far))) / 2.5
    factor = level / _rms(shape)
    return factor * shape, factor


def _case(
    rng: Rng,
    setting: _Setting,
    twist: Twist,
    truth: tuple[str, ...],
    recorded: Array,
    outputs: tuple[Array, Array],
    noise: Array,
    bound: float,
    strength: float,
    rest: Array,
) -> Case:
    plant, n = setting.plant, len(noise)
    if twist.growing:
        # The bound holds at the largest magnitude, where the noise stays as it is.
        size = np.abs(outputs[0]) / np.max(np.abs(outputs[0]))
        noise = noise * (1 + (twist.growing - 1) * size) / twist.growing
        strength = min(strength or twist.growing, twist.growing)
    y, level = outputs[0] + noise, _rms(noise)
    if twist.quantised:
        ratio = float(np.exp(rng.uniform(np.log(WEAKEST), np.log(STRONGEST / 2))))
        step = ratio * level
        y = step * np.round(y / step)
        bound += step / 2
        strength = min(strength or ratio, ratio)
    if twist.glitches:
        where = rng.choice(np.arange(2, n), max(3, round(twist.glitches * n)), replace=False)
        sizes = bound * np.exp(rng.uniform(np.log(5.0), np.log(30.0), len(where))) * rng.choice([-1, 1], len(where))
        y[where] += sizes
        strength = min(strength or np.inf, _rms(sizes) / level)
    others = dict(twist.channels)
    if rng.random() < 0.25:
        # A decoy of the kind that the case does not use, or by chance the only one of its kind.
        if "temperature" not in others and rng.random() < 0.5:
            others["temperature"] = slow_channel(rng, n)
        elif not {"flow", "inflow"} & set(others):
            others["flow"] = float(rng.uniform(0.3, 30.0)) * make_signal("held_noise", rng, n, plant.tempo)
    sensors = {plant.output: y}
    model = base_model(plant, setting.fixed, physical=bool(rng.random() < 0.4))
    if twist.seen_twice:
        quick = simulate(plant, replace(twist, sensor=(), output=()), setting.u, setting.start)
        sensors["reference"] = quick + rng.permutation(noise)
        (seen,) = model.measurements
        model = replace(model, measurements=(seen, Measurement("reference", seen.signal, "zeta")))
    data = Dataset.from_arrays(
        input={plant.input: recorded},
        output=sensors,
        sampling_time=plant.sampling_time,
        **{name: others[name] for name in sorted(others)},  # type: ignore[arg-type]
    )
    return Case(
        0, data, model, bound, truth, plant.name, setting.signal, *outputs, strength, noise, rest, setting.fixed, 0
    )
