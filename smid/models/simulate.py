"""Free simulation and one-step-ahead prediction of a model."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike

from relaxations.algebra.arrays import Array
from smid.models.errors import ModelError
from smid.models.model import Model
from smid.models.predictor import past_name, predictor
from smid.models.running import (
    at_sampling_time,
    channel_samples,
    input_signals,
    measured_signals,
    parameter_values,
    run_lines,
)
from smid.models.sensor import signal_to_channel

__all__ = ["Experiment", "Experiments", "Simulation", "predict", "predict_data", "simulate", "simulate_data"]


class Experiment(Protocol):
    """One uninterrupted record."""

    @property
    def values(self) -> Mapping[str, Array]:
        """Samples of each channel, of shape (n,)."""


class Experiments(Protocol):
    """Any data set that lists its experiments."""

    @property
    def experiments(self) -> Sequence[Experiment]:
        """The records."""


@dataclass(frozen=True)
class Simulation:
    """What a model computed over a data set.

    Attributes
    ----------
    model
        The model.
    outputs
        Per experiment, the noise-free output channels, of shape (n,) each; ``outputs[i][channel]``. NaN before the
        first measured samples that can start the run.
    signals
        Per experiment, every signal; NaN before the first sample that inputs and initial states determine.
    skip
        Samples at the start of each experiment, after those that are NaN, that come from the initial state, not from
        the model.

    Examples
    --------
    >>> from smid.data import Dataset
    >>> from smid.models import OutputError
    >>> data = Dataset.from_arrays(input={"u": [1.0, 0, 0]}, output={"y": [0.0, 1, 0.5]}, sampling_time=1.0)
    >>> OutputError().with_values({"a1": -0.5, "b0": 1.0}).simulate(data).outputs[0]["y"]
    array([0. , 1. , 0.5])
    """

    model: Model
    outputs: tuple[Mapping[str, Array], ...]
    signals: tuple[Mapping[str, Array], ...]
    skip: int


def simulate(
    model: Model,
    channels: Mapping[str, ArrayLike],
    parameters: Mapping[str, ArrayLike] | None = None,
    initial: Mapping[str, ArrayLike] | None = None,
    n: int | None = None,
    *,
    check: bool = True,
) -> dict[str, Array]:
    """Run a model freely over one experiment, from the first `max_lag` samples of its states.

    Every signal and every noise-free measured channel has shape (n,), or (B, n) when batched.

    Parameters
    ----------
    channels
        Input channels of shape (n,); a noisy input may also be given by its true signal.  A measured output
        channel is only used to choose the branch of a sensor curve.
    parameters
        Values, over those the model carries.  Arrays of shape (B,) run B parameter vectors at once.
    initial
        First samples of signals, at least `max_lag` each; other states start at rest, at zero.
    n
        Number of samples; by default the length of the input channels.
    check
        Whether to raise when the simulation leaves the finite range; otherwise inf and NaN are returned.

    Raises
    ------
    ModelError
        If a channel or a value is missing, too short or not finite, or the simulation leaves the finite
        range.

    Examples
    --------
    >>> from smid.models import OutputError
    >>> simulate(OutputError(), {"u": [1.0, 1.0, 1.0]}, {"a1": -0.5, "b0": 1.0})["y"]
    array([0. , 1. , 1.5])
    """
    values, batch = parameter_values(model, parameters)
    inputs, count = input_signals(model, channels, values, n)
    lines = model.discretised().lines
    known = _of_model(model, run_lines(lines, inputs, values, batch, initial or {}, count, check))
    for item in (*(m for m in model.measurements if m not in model.outputs), *model.outputs):
        samples = channels.get(item.channel)
        anchor = 0.0 if samples is None or item.inverse is None else float(np.nanmedian(np.asarray(samples)))
        known[item.channel] = signal_to_channel(item, known[item.signal], values, anchor)
    return known


def predict(
    model: Model,
    channels: Mapping[str, ArrayLike],
    parameters: Mapping[str, ArrayLike] | None = None,
    n: int | None = None,
    *,
    check: bool = True,
) -> dict[str, Array]:
    """Predict one step ahead over one experiment: every past output is the measured one.

    Parameters
    ----------
    channels
        Input and measured output channels of shape (n,).
    parameters
        Values, over those the model carries; arrays of shape (B,) are batched.
    n
        Number of samples; by default the length of the channels.
    check
        Whether to raise when the prediction leaves the finite range.

    Raises
    ------
    ModelError
        If a channel or a value is missing, or the prediction leaves the finite range.

    Examples
    --------
    >>> from smid.models import OutputError
    >>> record = {"u": [1.0, 1.0, 1.0], "y": [0.0, 2.0, 0.0]}
    >>> predict(OutputError(), record, {"a1": -0.5, "b0": 1.0})["y"]
    array([0., 1., 2.])
    """
    values, batch = parameter_values(model, parameters)
    inputs, count = input_signals(model, channels, values, n)
    past = measured_signals(model, channels, values)
    lines = predictor(model.discretised().lines, frozenset(past))
    inputs |= {past_name(name): samples[..., :count] for name, samples in past.items()}
    known = _of_model(model, run_lines(lines, inputs, values, batch, past, count, check))
    for item in (*(m for m in model.measurements if m not in model.outputs), *model.outputs):
        anchor = float(np.nanmedian(channel_samples(channels, item.channel))) if item.inverse is not None else 0.0
        known[item.channel] = signal_to_channel(item, known[item.signal], values, anchor)
    return known


def simulate_data(
    model: Model,
    data: Experiments,
    parameters: Mapping[str, float] | None = None,
    initial: str | Mapping[str, ArrayLike] = "measured",
) -> Simulation:
    """Run a model freely over every experiment of a data set.

    Parameters
    ----------
    data
        Anything with ``experiments``, each with ``values[channel]`` of shape (n,); its ``sampling_time``, where it has
        one, is that of a model in derivatives that has none. A missing output (NaN) is never read: a run that starts
        from measured samples begins at the first of which enough are there in a row.

    Examples
    --------
    >>> from types import SimpleNamespace
    >>> from smid.models import OutputError
    >>> record = SimpleNamespace(values={"u": np.ones(3), "y": np.array([4.0, 0.0, 0.0])})
    >>> run = simulate_data(OutputError(), SimpleNamespace(experiments=(record,)), {"a1": -0.5, "b0": 1.0})
    >>> run.outputs[0]["y"]
    array([4. , 3. , 2.5])
    """
    if isinstance(initial, str) and initial not in ("measured", "rest"):
        raise ModelError(f"initial = {initial!r} is unknown: use 'measured', 'rest' or a mapping of signals to samples")
    model = at_sampling_time(model, getattr(data, "sampling_time", None))
    values, _ = parameter_values(model, parameters)
    runs = []
    for experiment in data.experiments:
        first, start = 0, initial
        channels = experiment.values
        if isinstance(start, str):
            measured = measured_signals(model, channels, values, True) if start == "measured" else {}
            first = _first_start(model, measured)
            start = {name: samples[first:] for name, samples in measured.items()}
            channels = {name: samples[first:] for name, samples in channels.items()}
        run = simulate(model, channels, parameters, start)
        runs.append({name: np.concatenate([np.full(first, np.nan), samples]) for name, samples in run.items()})
    return _collect(model, runs)


def predict_data(model: Model, data: Experiments, parameters: Mapping[str, float] | None = None) -> Simulation:
    """Predict one step ahead over every experiment of a data set.

    Parameters
    ----------
    data
        Anything with ``experiments``, each with ``values[channel]`` of shape (n,).
    """
    model = at_sampling_time(model, getattr(data, "sampling_time", None))
    return _collect(model, [predict(model, item.values, parameters) for item in data.experiments])


def _first_start(model: Model, measured: Mapping[str, Array]) -> int:
    """Return the first instant from which all measured signals are there for as long as they start a run."""
    if not measured:
        return 0
    missing = np.any([np.isnan(samples) for samples in measured.values()], axis=0)
    length = max(model.max_lag, 1)
    there = np.lib.stride_tricks.sliding_window_view(~missing, min(length, len(missing))).all(axis=1)
    if not there.any():
        raise ModelError(
            f"nowhere are {length} samples of {', '.join(model.output_channels)} in a row there, from which a "
            "simulation could start: give initial='rest', or initial samples by signal"
        )
    return int(np.argmax(there))


def _of_model(model: Model, known: dict[str, Array]) -> dict[str, Array]:
    """Leave out the helper lines of the integration and of the predictor."""
    own = {*model.inputs, *(line.signal for line in model.lines)}
    return {name: samples for name, samples in known.items() if name in own}


def _collect(model: Model, runs: Sequence[Mapping[str, Array]]) -> Simulation:
    names = (*model.inputs, *(line.signal for line in model.lines))
    return Simulation(
        model,
        tuple({channel: run[channel] for channel in model.output_channels} for run in runs),
        tuple({name: run[name] for name in names} for run in runs),
        model.max_lag,
    )
