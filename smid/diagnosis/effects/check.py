"""The contract of an effect as checks, also for an effect of your own.

Each effect is put on base models of every kind (difference equations of order one and two, with an input curve, a
reactor, an arm and two tanks in derivatives, a lag that two sensors see, a record with a further channel) and must

- be the base model where its parameters have their null values, to nine digits;
- bring in parameters that are new, of finite boxes, and start inside them, away from null, with a finite and
  different run;
- give models that pickle and come back from ``to_dict``;
- describe itself in one sentence with a number;
- go on top of another effect and on top of itself.
"""

from __future__ import annotations

import json
import math
import pickle
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np

from relaxations.algebra.arrays import Array
from smid.data import Dataset
from smid.diagnosis.effects import input_backlash, sensor_bias
from smid.diagnosis.effects.effect import Effect, Extension, Site
from smid.models import (
    Hammerstein,
    Line,
    Measurement,
    Model,
    OutputError,
    Parameter,
    Reactor,
    RotatingArm,
    signal,
    simulate,
    t,
)

__all__ = ["Case", "cases", "check_effect", "check_on"]

_TOLERANCE = 1e-9
_SEED = 1
_SAMPLING_TIME = 0.1
# Longer than any effect looks back.
_REST = 40


@dataclass(frozen=True, eq=False)
class Case:
    """A base model with its values, and the record it is checked on.

    Parameters
    ----------
    name
        For messages.
    model
        With a value for each parameter.
    site
        With a record that the model made, and a small residual.
    """

    name: str
    model: Model
    site: Site

    @cached_property
    def free_run(self) -> Mapping[str, Array]:
        """Every signal of the base model's free run, shape (n,)."""
        return simulate(self.model, self.site.data.experiments[0].values, check=False)


def check_effect(effect: Effect) -> None:
    """Check that an effect keeps the contract on every base model it applies to.

    Parameters
    ----------
    effect
        Yours, or one that ships.

    Raises
    ------
    AssertionError
        With what is broken, on which model, in which variant.
    ModelError
        If the effect builds a model that cannot be.

    Examples
    --------
    >>> from smid.diagnosis.effects import sensor_bias
    >>> check_effect(sensor_bias.EFFECT)
    """
    applied = [check_on(effect, case) for case in cases()]
    _require(any(applied) or effect.detect is not None, f"{effect.name} applies to none of the base models")


def check_on(effect: Effect, case: Case) -> bool:
    """Check an effect on one base model; see `check_effect`.

    Examples
    --------
    >>> from smid.diagnosis.effects import missing_input
    >>> [check_on(missing_input.EFFECT, case) for case in cases()[:2]]
    [False, False]
    """
    place = f"{effect.name} on {case.name}"
    _require(re.fullmatch(r"[a-z][a-z0-9_]*", effect.name) is not None, f"{place}: the name is no snake_case word")
    _require(
        bool(effect.summary) and not effect.summary.endswith("."), f"{place}: the summary is empty or has a full stop"
    )
    extensions = tuple(effect.extensions(case.model, case.site))
    labels = [item.label for item in extensions]
    _require(len(set(labels)) == len(labels), f"{place}: two variants share a label among {labels}")
    for extension in extensions:
        _check_extension(extension, case, f"{place} ({extension.label or 'only variant'})")
    if not extensions:
        return False
    _check_composition(effect, extensions, case, place)
    return True


def _require(fact: bool, message: str) -> None:
    if not fact:
        raise AssertionError(message)


def _check_extension(extension: Extension, case: Case, place: str) -> None:
    model, base = extension.model, case.model
    new = _new(model, base)
    nulls = {p.name: p.null for p in new if p.null is not None}
    _require(bool(new), f"{place}: brings in no parameter")
    _require(bool(nulls), f"{place}: no new parameter has a null value, so nothing switches it off")
    kept = {p.name for p in model.parameters}
    gone = [p.name for p in base.parameters if p.name not in kept]
    _require(not gone, f"{place}: drops the base's parameters {gone}; keep them, multiply or add instead")
    _require(dict(model.values) == dict(base.values), f"{place}: changes the values of the base's parameters")
    for p in new:
        finite = math.isfinite(p.lower) and math.isfinite(p.upper)
        _require(finite and p.lower < p.upper, f"{place}: the box of {p.name} is no finite interval")
        _require(
            p.null is None or p.lower <= p.null <= p.upper, f"{place}: the null value of {p.name} is not in its box"
        )
    _require(bool(extension.starts), f"{place}: has no start")
    for start in extension.starts:
        _check_start(start, new, place)
    expected = _seen(case.free_run, case)
    # A shape has no null value: switched off, the effect must not depend on it.
    shapes = ({p.name: start[p.name] for p in new} for start in extension.starts)
    for off in dict.fromkeys(tuple(sorted({**shape, **nulls}.items())) for shape in shapes):
        found = _run(model, case, {**base.values, **dict(off)})
        error = _distance(model, found, expected)
        _require(
            error <= _TOLERANCE, f"{place}: at its null values it is off the base model by {error:.1e} of the output"
        )
    started = _run(model, case, {**base.values, **extension.starts[0]})
    _require(bool(np.isfinite(started[model.max_lag :]).all()), f"{place}: the run at the first start is not finite")
    moved = _distance(model, started, expected)
    _require(moved > _TOLERANCE, f"{place}: the run at the first start is the base model's")
    _check_storage(model, case, {**base.values, **extension.starts[0]}, started, place)
    _require(extension.describe is not None, f"{place}: neither the effect nor the extension has a describe")
    assert extension.describe is not None
    sentence = extension.describe(extension.starts[0], case.site)
    _require(sentence.endswith(".") and "\n" not in sentence, f"{place}: {sentence!r} is no sentence with a full stop")
    _require(re.search(r"\d", sentence) is not None, f"{place}: {sentence!r} gives no number")


def _check_start(start: Mapping[str, float], new: tuple[Parameter, ...], place: str) -> None:
    boxes = {p.name: p for p in new}
    _require(start.keys() >= boxes.keys(), f"{place}: a start names {sorted(start)}, the new are {sorted(boxes)}")
    for name, box in boxes.items():
        value = start[name]
        _require(box.lower <= value <= box.upper, f"{place}: the start {name} = {value:g} is not in its box")
    away = any(p.null is not None and start[name] != p.null for name, p in boxes.items())
    _require(away, f"{place}: the start {dict(start)} is at null")


def _check_storage(model: Model, case: Case, values: Mapping[str, float], expected: Array, place: str) -> None:
    pickled = pickle.loads(pickle.dumps(model))
    _require(pickled == model, f"{place}: the model does not come back from pickle")
    stored = Model.from_dict(json.loads(json.dumps(model.to_dict())))
    # Text may come back in another form of the same expression, so the lines are compared by what they do.
    same = all(getattr(stored, part) == getattr(model, part) for part in ("parameters", "measurements", "origins"))
    _require(same, f"{place}: the model does not come back from to_dict")
    error = _distance(model, _run(stored, case, values), expected)
    _require(error <= _TOLERANCE, f"{place}: the model that comes back from to_dict runs differently by {error:.1e}")


def _check_composition(effect: Effect, extensions: Sequence[Extension], case: Case, place: str) -> None:
    """Put it on two other effects, one at each end, and on itself: all variants must build, with names of their own."""
    others = (input_backlash.EFFECT, sensor_bias.EFFECT)
    grown = case.model
    values = dict(grown.values)
    for other in others:
        extension = next(iter(other.extensions(grown, case.site)))
        grown = extension.model
        values.update(extension.starts[0])
    grown = grown.with_values(values)
    bases = [("on a backlash and a bias", grown)]
    ends = extensions[:: max(1, len(extensions) - 1)][:2]  # the first and, where there are two, the last
    bases += [(f"on its own {item.label}", item.model.with_values(item.starts[0])) for item in ends]
    for what, base in bases:
        again = tuple(effect.extensions(base, case.site))
        _require(bool(again) or base is not grown, f"{place}: does not apply {what}")
        for item in again:
            old = {p.name for p in base.parameters}
            new = [p.name for p in item.model.parameters if p.name not in old]
            _require(bool(new), f"{place}: {what} it brings in no parameter with a name of its own")
            _require(set(item.starts[0]) >= set(new), f"{place}: {what} its starts name other parameters than it adds")
    first = next(iter(effect.extensions(grown, case.site)))
    run = _run(first.model, case, {**values, **first.starts[0]})
    _require(
        bool(np.isfinite(run[first.model.max_lag :]).all()), f"{place}: on a backlash and a bias its run is not finite"
    )


def _new(model: Model, base: Model) -> tuple[Parameter, ...]:
    old = {p.name for p in base.parameters}
    return tuple(p for p in model.parameters if p.name not in old)


def _distance(model: Model, found: Array, expected: Array) -> float:
    """Return the largest difference over the samples the model computes, as a share of the output's scale."""
    return float(np.abs((found - expected)[model.max_lag :]).max())


def _seen(signals: Mapping[str, Array], case: Case) -> Array:
    """Return the outputs, each over its scale, shape (n, outputs)."""
    return np.column_stack([signals[name] / case.site.scale(name) for name in case.model.output_channels])


def _run(model: Model, case: Case, values: Mapping[str, float]) -> Array:
    """Run freely from where the base model's states are while the input rests; give the outputs over their scales."""
    # Other lags of an extended model must not move its start against the base.
    first = max(0, case.model.max_lag - model.max_lag)
    channels = {name: samples[first:] for name, samples in case.site.data.experiments[0].values.items()}
    initial = {name: case.free_run[name][first:] for name in case.model.states}
    run = _seen(simulate(model, channels, values, initial, check=False), case)
    return np.concatenate([_seen(case.free_run, case)[:first], run])


@lru_cache(maxsize=1)
def cases() -> tuple[Case, ...]:
    """Return the base models that effects are checked on, each with a record of its own.

    Examples
    --------
    >>> [case.name for case in cases()][:2]
    ['a first-order lag', 'a swinging second order']
    """
    generator = np.random.default_rng(_SEED)
    two = OutputError(2, 1, offset=True).with_values({"a1": -1.5, "a2": 0.7, "b0": 0.1, "b1": 0.1, "offset": 0.02})
    curve = Hammerstein(powers=(1, 3), stable=True).with_values({"alpha": -0.8, "gamma1": 1.0, "gamma2": 0.2})
    reactor = Reactor(2.0, sampling_time=_SAMPLING_TIME)
    arm = RotatingArm(2.0, 0.5, drag=True, sampling_time=_SAMPLING_TIME)
    return tuple(
        _case(name, model, generator, channel=channel, lowest=lowest)
        for name, model, channel, lowest in (
            ("a first-order lag", OutputError().with_values({"a1": -0.8, "b0": 0.4}), False, -1.0),
            ("a swinging second order", two, False, -1.0),
            ("an input curve and a lag", curve, False, -1.0),
            ("the reactor", reactor.with_values(_fixed(reactor)), False, 0.0),
            ("the arm", arm.with_values(_fixed(arm)), False, -1.0),
            ("two tanks", _tanks(), False, 0.0),
            ("a lag seen twice", _seen_twice(), False, -1.0),
            ("a lag with a temperature", OutputError().with_values({"a1": -0.9, "b0": 0.2}), True, -1.0),
        )
    )


def _tanks() -> Model:
    """Return two tanks, the first above the second, and a sensor whose zero is off."""
    pump, outflow, zero = Parameter("pump", 0.0, 9.0), Parameter("outflow", 0.0, 9.0), Parameter("zero", -9.0, 9.0)
    upper, w, u, k = signal("upper"), signal("w"), signal("u"), outflow.symbol
    lines = (
        Line(upper[t], pump.symbol * u[t] - k * upper[t], rate=True),
        Line(w[t], k * upper[t] - k * w[t], rate=True),
        Line(signal("seen")[t], w[t] + zero.symbol),
    )
    measured = (Measurement("y", "seen", "eta"),)
    tanks = Model("two tanks", (pump, outflow, zero), lines, measured, sampling_time=_SAMPLING_TIME, scheme="euler")
    return tanks.with_values({"pump": 2.0, "outflow": 1.5, "zero": -0.3})


def _seen_twice() -> Model:
    """Return a lag with a sensor that shows it as it is, and one in another unit."""
    pole, gain, scale = Parameter("pole", -1.0, 1.0), Parameter("gain", -9.0, 9.0), Parameter("scale", 0.1, 9.0)
    w = signal("w")
    lines = (
        Line(w[t], pole.symbol * w[t - 1] + gain.symbol * signal("u")[t - 1]),
        Line(signal("scaled")[t], scale.symbol * w[t]),
    )
    measured = (Measurement("y", "w", "eta"), Measurement("z", "scaled", "zeta"))
    model = Model("a lag seen twice", (pole, gain, scale), lines, measured)
    return model.with_values({"pole": 0.85, "gain": 0.3, "scale": 2.0})


def _fixed(model: Model) -> dict[str, float]:
    return {p.name: p.lower for p in model.parameters}


def _case(name: str, model: Model, generator: np.random.Generator, *, channel: bool, lowest: float) -> Case:
    """Make a record of steps and ramps that starts at zero and turns round often."""
    n = 240
    steps = np.repeat(generator.uniform(lowest, 1.0, n // 12), 12)
    u = steps + 0.3 * (1.0 - abs(lowest)) * np.sin(0.3 * np.arange(n))
    u[:_REST] = 0.0
    u[120:] = np.convolve(u, np.ones(8) / 8)[120:n]
    others: dict[str, Array] = {"T": 20 + np.cumsum(generator.normal(size=n)) / 5} if channel else {}

    def record(outputs: Mapping[str, Array]) -> Dataset:
        units = {"u": "A", "y": "bar"}
        return Dataset.from_arrays(
            input={"u": u, **others}, output=dict(outputs), sampling_time=_SAMPLING_TIME, units=units
        )

    draft = Case(name, model, Site(record(dict.fromkeys(model.output_channels, np.zeros(n))), "u", "y"))
    outputs = {channel: draft.free_run[channel] for channel in model.output_channels}
    y = outputs["y"]
    residual = 0.02 * np.sin(1.1 * np.arange(n)) * np.abs(y).max() + 0.01 * generator.normal(size=n)
    return Case(name, model, Site(record({**outputs, "y": y + residual}), "u", "y", (residual,)))
