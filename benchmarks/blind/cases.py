"""One blind case from a seed: plant, input, effects, noise.

Strength of a case: ``rms(y - base) / rms(noise)``, with ``y`` the noise-free output with the effect and ``base`` the
best fit to it of the base model, parameters and initial state (`refit.misfit`). The misfit is computed first; the noise
level is then set so that the strength is a log-uniform draw between 3 and 20. A draw is thrown away, and everything
drawn again, when the noise would exceed 20 % of the output's standard deviation, or the misfit is below 3 % of it (then
the integration error of a model at the sampling time would be seen beside the effect), or the effect shows
in one part of the record only: the first 70 % must hold 0.6, the held-out rest 0.3 of the rms misfit.

A single effect must also be told apart by the record, whoever looks: where the obvious rival explains the noise-free
output up to half the noise, everything is drawn again. Guarded so are, against a free polynomial of the input,
`output_curve`, `operating_point` and `power_law` (on a slow input each is a static curve), and `stribeck_friction`
against Coulomb friction.

Effects that leave no mean misfit have a strength of their own:

    input_noise     rms of the output with true minus with recorded input, over rms of the noise
    outliers        rms of the glitches over rms of the noise; each is at least five noise bounds
    quantisation    step over rms of the noise; the noise bound handed over covers half a step more

Two effects: the smaller of two strengths, each the smallest of (i) that of the effect alone and (ii) the rms by which
taking it out of the pair changes the output, over the rms of the noise.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import least_squares

from benchmarks.blind.base_models import base_model
from benchmarks.blind.effects import EFFECTS, Effect, slow_channel
from benchmarks.blind.plants import Friction, Plant, Twist, draw_plant, simulate
from benchmarks.blind.refit import misfit
from benchmarks.blind.signals import SIGNALS, make_signal
from relaxations.algebra.arrays import Array
from smid import Dataset, Model

__all__ = ["HELD_OUT", "Case", "draw"]

Rng = np.random.Generator
HELD_OUT, WEAKEST, STRONGEST, LOUDEST, FAINTEST = 0.3, 3.0, 20.0, 0.2, 0.03
SPECIAL = ("input_noise", "outliers", "quantisation")
PLANTS = ("clutch", "cstr", "arm_speed", "arm_angle", "arm_free", "linear1", "linear2")
ATTEMPTS, APART, DEGREE = 400, 0.5, 5

# Pairs that are nearly one effect twice: two static curves in one place, two slow motions of one thing, two lags.
SAME = (
    {"input_dead_zone", "input_saturation", "input_curve"},
    {"output_curve", "output_saturation"},
    {"input_backlash", "hysteresis"},
    {"parameter_change", "parameter_drift"},
    {"sensor_bias", "sensor_drift"},
    {"coulomb_friction", "stribeck_friction"},
    {"viscous_friction", "quadratic_drag"},
    {"input_delay", "extra_lag", "resonance", "rate_limit"},
    {"power_law", "operating_point", "direction_dependence", "output_curve"},
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
        Seed; a single effect is the one of number ``seed`` modulo the number of effects.
    effects : {0, 1, 2}
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
    RuntimeError
        If no draw was acceptable: change the limits at the head of this module.

    Examples
    --------
    >>> draw(0).truth
    ('input_dead_zone',)
    """
    if effects not in (0, 1, 2) or samples < 200:
        raise ValueError(f"effects = {effects}, samples = {samples}: hide 0, 1 or 2 effects in at least 200 samples")
    rng = np.random.default_rng([seed, effects, samples])
    for attempt in range(1, ATTEMPTS + 1):
        chosen = _choose(rng, seed, effects)
        setting = _setting(rng, chosen, samples)
        if setting is None:
            continue
        case = _null(rng, setting) if not chosen else _hidden(rng, setting, chosen)
        if case is not None:
            return replace(case, seed=seed, attempts=attempt)
    raise RuntimeError(f"seed {seed}: no acceptable draw of {effects} effects in {ATTEMPTS} attempts")


def _choose(rng: Rng, seed: int, effects: int) -> tuple[Effect, ...]:
    names = list(EFFECTS)
    if effects == 0:
        return ()
    if effects == 1:
        return (EFFECTS[names[seed % len(names)]],)
    while True:
        first, second = (str(name) for name in rng.choice(names, 2, replace=False))
        one, other = EFFECTS[first], EFFECTS[second]
        contradicting = one.needs and other.needs and one.needs != other.needs
        if not any({first, second} <= group for group in SAME) and not contradicting and _shared(one, other):
            return one, other


def _shared(*chosen: Effect) -> list[str]:
    return [name for name in PLANTS if all(name in effect.plants for effect in chosen)]


def _setting(rng: Rng, chosen: tuple[Effect, ...], samples: int) -> _Setting | None:
    fixed = tuple(sorted({name for effect in chosen for name in effect.fixes}))
    if not chosen and rng.random() < 0.15:
        fixed = ("gain", "tau")
    plants = [name for name in _shared(*chosen) if not fixed or name in ("cstr", "linear1")]
    signals = [name for name in SIGNALS if all(name in effect.signals for effect in chosen)]
    if not plants or not signals:
        return None
    needs = "".join({effect.needs for effect in chosen if effect.needs})
    plant = draw_plant(rng, str(rng.choice(plants)), needs)
    signal = str(rng.choice(signals))
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
    twist, alone = Twist(), []
    for effect in chosen:
        # Each effect is drawn by itself as well, so that the strength of either one in the pair is known.
        state = rng.bit_generator.state
        alone.append(effect.build(rng, plant, u, base, Twist()))
        rng.bit_generator.state = state
        twist = effect.build(rng, plant, u, base, twist)
    recorded = u if twist.input_error is None else u + twist.input_error
    predictable = simulate(plant, twist, recorded, start)
    y = predictable if twist.input_error is None else simulate(plant, twist, u, start)
    size = float(np.std(y))
    if not (np.all(np.isfinite(y)) and 0.2 * np.std(base) < size < 8 * np.std(base) + 1e-300):
        return None
    rest = misfit(plant, u, y, setting.fixed)
    parts = []
    for effect, single, other in zip(chosen, alone, reversed(alone), strict=True):
        part = _part(setting, effect, single, other if len(chosen) == 2 else None, y, predictable)
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
    setting: _Setting, effect: Effect, single: Twist, other: Twist | None, y: Array, predictable: Array
) -> float | None:
    """Return the rms that makes an effect visible; None for glitches and rounding, which are added after the noise."""
    plant, u, start = setting.plant, setting.u, setting.start
    if effect.name in ("outliers", "quantisation"):
        return None
    if effect.name == "input_noise":
        return _rms(y - predictable)
    alone = simulate(plant, single, u, start)
    part = _rms(misfit(plant, u, alone, setting.fixed))
    if other is not None:
        part = min(part, _rms(y - simulate(plant, other, u, start)))
    return part


def _rival_rest(setting: _Setting, effect: Effect, twist: Twist, y: Array) -> float:
    """Return the rms that the obvious rival of an effect leaves, infinite where none is guarded against."""
    plant, u = setting.plant, setting.u
    if effect.name in ("output_curve", "operating_point", "power_law") and plant.name != "clutch":
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
    split = round((1 - HELD_OUT) * len(rest))
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
        elif "flow" not in others:
            others["flow"] = float(rng.uniform(0.3, 30.0)) * make_signal("held_noise", rng, n, plant.tempo)
    data = Dataset.from_arrays(
        input={plant.input: recorded},
        output={plant.output: y},
        sampling_time=plant.sampling_time,
        **{name: others[name] for name in sorted(others)},  # type: ignore[arg-type]
    )
    model = base_model(plant, setting.fixed, physical=bool(rng.random() < 0.4))
    return Case(
        0, data, model, bound, truth, plant.name, setting.signal, *outputs, strength, noise, rest, setting.fixed, 0
    )
