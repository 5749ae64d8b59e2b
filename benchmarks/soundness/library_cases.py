"""Random sets of models from the whole effect library, on base plants of every kind.

A seed draws a plant, one extension that an effect offers of it, its parameters and boxes that hold them, some samples
of the plant's record, initial states and noises. Boxes of hidden states are drawn around their run.

A set is made empty by a further channel that shows the difference of two samples of the output, ``y_t - y_{t-k}``. With
``d`` the difference that is shown and r the largest of ``|y_t - y_{t-k} - d_t|``, no model at all keeps a noise bound
below r / 3 on both channels. The bound is drawn below that.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from functools import lru_cache

import numpy as np

from benchmarks.soundness.cases import Case
from relaxations.algebra.arrays import Array
from smid import Dataset, Model
from smid.diagnosis.effects import EFFECTS
from smid.diagnosis.effects.check import Case as Plant
from smid.diagnosis.effects.check import cases
from smid.diagnosis.effects.effect import Extension
from smid.identification.inversion.record import Record
from smid.models import Line, Measurement, signal, simulate, t
from smid.models.structure import is_clock

WIDTHS = (0.01, 0.1, 0.5)  # of boxes, as shares of the parameter
NOISES = (0.005, 0.02, 0.1)  # bounds, as shares of the output's range
SHARES = (0.5, 0.8, 0.95)  # of the least noise bound
TRIES = 100


@lru_cache
def extensions(plant: Plant) -> tuple[tuple[str, Extension], ...]:
    """Return every extension of a plant, with the name of its effect."""
    return tuple((effect.name, found) for effect in EFFECTS for found in effect.extensions(plant.model, plant.site))


def library_case(feasible: bool, seed: int) -> Case:
    """Draw a set that holds the truth, or one without any point."""
    rng = np.random.default_rng([seed, 7])
    plant = sorted(cases(), key=lambda plant: plant.name)[seed % len(cases())]
    offered = extensions(plant)
    for _ in range(TRIES):  # until a run is finite, and an output is shown as it is
        effect, extension = offered[int(rng.integers(len(offered)))]
        found = _drawn(rng, plant, extension, feasible)
        if found is not None:
            return replace(found, kind=f"{plant.name}, {effect}")
    raise RuntimeError(f"no extension of {plant.name} has a finite run")


def _drawn(rng: np.random.Generator, plant: Plant, extension: Extension, feasible: bool) -> Case | None:
    truth = _truth(rng, plant, extension)
    model = extension.model if feasible else _with_difference(extension.model, int(rng.integers(1, 4)))
    if model is None:
        return None
    model = model.bound(**dict(_boxes(rng, model, truth)))
    runs = [_run(rng, plant, model, truth) for _ in range(1 if rng.random() < 0.8 else 2)]
    n_samples = min(len(next(iter(run.values()))) for run in runs)
    moving = all(np.ptp(run[name]) > 0 for run in runs for name in model.inputs if name in plant.site.data.inputs)
    if n_samples < model.max_lag + len(model.parameters) + 2 or not moving:  # `identify` refuses such records
        return None
    shown = {m.channel: m.signal for m in model.measurements if m.noise is not None}
    clean = {channel: np.concatenate([run[channel] for run in runs]) for channel in shown}
    spans = {channel: float(np.ptp(samples)) for channel, samples in clean.items()}
    if not all(np.isfinite(span) and span > 1e-6 for span in spans.values()):
        return None
    share = float(rng.choice(NOISES))
    bounds = {channel: share * span for channel, span in spans.items()}
    if not feasible:
        bounds = dict.fromkeys(bounds, min(bounds.values()))
    parts = [_recorded(rng, model, run, bounds, str(k)) for k, run in enumerate(runs)]
    data = parts[0].with_experiments([part.experiments[0] for part in parts])
    if feasible:
        return Case("", "feasible", _with_hidden_boxes(rng, model, data, bounds, runs), data, bounds, truth)
    needed = _least(model, data)
    if needed < 1e-3 * min(bounds.values()):
        return None
    bounds = dict.fromkeys(bounds, float(rng.choice(SHARES)) * needed)
    return Case("", "small bound", _with_hidden_boxes(rng, model, data, bounds, runs), data, bounds, truth)


def _truth(rng: np.random.Generator, plant: Plant, extension: Extension) -> dict[str, float]:
    """Return parameters: the plant's, and those of the effect near one of its starts."""
    start = extension.starts[int(rng.integers(len(extension.starts)))] if extension.starts else {}
    known = {**plant.model.values, **start}
    return {
        p.name: float(np.clip(known.get(p.name, p.null or 0.0) * rng.uniform(0.9, 1.1), p.lower, p.upper))
        for p in extension.model.parameters
    }


def _boxes(
    rng: np.random.Generator, model: Model, truth: Mapping[str, float]
) -> Iterator[tuple[str, tuple[float, float]]]:
    """Yield boxes that hold the truth, some at an end."""
    width = float(rng.choice(WIDTHS))
    for p in model.parameters:
        value, size = truth[p.name], width * (abs(truth[p.name]) or 0.1)
        place = float(rng.choice([0.0, 1.0])) if rng.random() < 0.2 else float(rng.random())
        yield p.name, (max(p.lower, value - place * size), min(p.upper, value + (1 - place) * size))


def _run(rng: np.random.Generator, plant: Plant, model: Model, truth: Mapping[str, float]) -> dict[str, Array]:
    """Return all signals and channels over some samples of the plant's record, each line fitting from its first."""
    channels, n = plant.site.data.experiments[0].values, int(rng.integers(10, 31))
    # A run takes its first samples from the initial states, also where a line has a shorter lag: those are cut off.
    lag = model.max_lag
    first = int(rng.integers(30, plant.site.data.n_samples - n - lag))
    initial = {name: plant.free_run[name][first:] for name in plant.model.states}
    before = (np.arange(lag) - lag) * plant.site.sampling_time  # of clocks, which are zero where the record begins
    initial |= {line.signal: before for line in model.lines if is_clock(line)}
    inputs = {name: samples[first : first + lag + n] for name, samples in channels.items()}
    with np.errstate(all="ignore"):
        found = inputs | simulate(model, inputs, truth, initial, check=False)
    return {name: samples[lag:] for name, samples in found.items()}


def _recorded(
    rng: np.random.Generator, model: Model, run: Mapping[str, Array], bounds: Mapping[str, float], name: str
) -> Dataset:
    """Return what channels show, with noise at random or at its bound; some outputs are missing."""
    shown = dict(run)
    for channel, bound in bounds.items():
        n = len(run[channel])
        noise = rng.uniform(-1, 1, n) if rng.random() < 0.5 else (1 - 1e-9) * rng.choice([-1.0, 1.0], n)
        shown[channel] = run[channel] + bound * noise
        if channel in model.output_channels and rng.random() < 0.2:
            shown[channel][rng.integers(n)] = np.nan
    outputs = {channel: shown[channel] for channel in model.output_channels}
    inputs = {channel: shown[channel] for channel in model.channels if channel not in outputs}
    return Dataset.from_arrays(input=inputs, output=outputs, sampling_time=model.sampling_time or 1.0, name=name)


def _with_hidden_boxes(
    rng: np.random.Generator,
    model: Model,
    data: Dataset,
    bounds: Mapping[str, float],
    runs: list[dict[str, Array]],
) -> Model:
    boxes = {}
    for name in Record(model, data, bounds).loose:
        samples = np.concatenate([run[name] for run in runs])
        size = float(np.ptp(samples)) or 1.0
        around = float(rng.choice(WIDTHS)) * size
        boxes[name] = (float(samples.min()) - around, float(samples.max()) + around)
    return model.bound(**boxes)


def _with_difference(model: Model, lag: int) -> Model | None:
    """Return the model with a channel that shows the difference of two samples of its first output."""
    seen = model.outputs[0]
    if seen.inverse is not None or seen.noise is None:
        return None
    own = signal(seen.signal)
    return replace(
        model,
        lines=(*model.lines, Line(signal("change")[t], own[t] - own[t - lag])),
        measurements=(*model.measurements, Measurement("difference", "change", "nu")),
    )


def _least(model: Model, data: Dataset) -> float:
    """Return a noise bound below which the difference contradicts the output, whatever the parameters are."""
    (lag,) = (lag for line in model.lines if line.signal == "change" for _, lag in line.reads if lag)
    left = [
        np.abs(run.values[channel][lag:] - run.values[channel][:-lag] - run.values["difference"][lag:])
        for run in data.experiments
        for channel in [model.outputs[0].channel]
    ]
    return float(np.nanmax(np.concatenate(left))) / 3
