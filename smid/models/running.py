"""Checked values and channels, and the run of compiled lines over them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from relaxations.algebra.arrays import Array
from smid.models.compiled import compile_lines
from smid.models.errors import ModelError
from smid.models.model import Model
from smid.models.parts import Line
from smid.models.sensor import channel_to_signal
from smid.models.structure import first_samples

__all__ = ["at_sampling_time", "channel_samples", "input_signals", "measured_signals", "parameter_values", "run_lines"]


def parameter_values(model: Model, parameters: Mapping[str, ArrayLike] | None) -> tuple[dict[str, Any], int | None]:
    """Merge parameter values with the model's own and find the batch size.

    A parameter with a box of one point has that value. Scalars stay Python floats; the batch size is None without
    batch.

    Parameters
    ----------
    parameters
        Values over those the model carries; arrays of shape (B,) are batched.
    """
    fixed = {item.name: item.lower for item in model.parameters if item.lower == item.upper}
    merged: dict[str, Any] = {**fixed, **model.values, **(parameters or {})}
    names = [parameter.name for parameter in model.parameters]
    missing = [name for name in names if name not in merged]
    unknown = sorted(set(merged) - set(names))
    if missing or unknown:
        problem = f"no value for {', '.join(missing)}" if missing else f"no parameter {', '.join(unknown)}"
        raise ModelError(f"{problem}: the simulation needs a value for each of {', '.join(names)}")
    arrays = {name: np.asarray(merged[name], dtype=float) for name in names}
    for name, value in fixed.items():
        # The lines in use may hold the number in the parameter's place.
        if not np.allclose(arrays[name], value, rtol=1e-9, atol=0.0):
            raise ModelError(f"{name} is fixed at {value:g}, not {merged[name]}: widen its box first, by bound")
    sizes = {array.shape[0] for array in arrays.values() if array.ndim == 1}
    if len(sizes) > 1 or any(array.ndim > 1 for array in arrays.values()):
        raise ModelError("batched parameters differ in shape: give scalars, or arrays of one common shape (B,)")
    values = {name: array if array.ndim else float(array) for name, array in arrays.items()}
    return values, next(iter(sizes), None)


def at_sampling_time(model: Model, sampling_time: float | None) -> Model:
    """Return a model with rates with the sampling time of the data.

    Parameters
    ----------
    sampling_time
        Of the data, in seconds; None: not known.
    """
    if not model.continuous or sampling_time is None:
        return model
    if model.sampling_time is None:
        return replace(model, sampling_time=float(sampling_time))
    if not np.isclose(model.sampling_time, sampling_time, rtol=1e-9, atol=0.0):
        raise ModelError(
            f"model {model.name!r} is for samples every {model.sampling_time:g} s, the data have one every "
            f"{sampling_time:g} s: resample them, or leave the model's sampling_time at None"
        )
    return model


def channel_samples(channels: Mapping[str, ArrayLike], name: str, gaps: bool = False) -> Array:
    """Get one channel as finite numbers, and NaN for missing samples where ``gaps`` are allowed.

    Shape (n,).
    """
    if name not in channels:
        raise ModelError(f"the data lack the channel {name!r}: they have {', '.join(channels)}")
    samples = np.asarray(channels[name], dtype=float)
    if samples.ndim != 1 or not (np.isfinite(samples) | (gaps & np.isnan(samples))).all():
        raise ModelError(f"channel {name!r} is not a finite series of shape (n,): clean or cut it first")
    return samples


def input_signals(
    model: Model, channels: Mapping[str, ArrayLike], values: Mapping[str, Any], n: int | None
) -> tuple[dict[str, Array], int]:
    """Collect the input signals, cut to the number of samples.

    Per input signal, shape (n,); and the number of samples n.
    """
    sensors = {item.signal: item for item in reversed(model.measurements)}
    inputs = {
        name: channel_to_signal(sensors[name], channel_samples(channels, channel), values)
        if name in sensors and name not in channels
        else channel_samples(channels, name)
        for name, channel in zip(model.inputs, model.input_channels, strict=True)
    }
    lengths = {name: samples.shape[-1] for name, samples in inputs.items()}
    if n is None and not lengths:
        raise ModelError(f"model {model.name!r} has no input to tell the number of samples: give n")
    count = min(lengths.values()) if n is None else n
    if any(length < count or (n is None and length != count) for length in lengths.values()):
        raise ModelError(f"input channels have lengths {lengths}, asked for n = {n}: make them equal and long enough")
    return {name: samples[..., :count] for name, samples in inputs.items()}, count


def run_lines(
    lines: tuple[Line, ...],
    inputs: Mapping[str, Array],
    values: Mapping[str, Any],
    batch: int | None,
    initial: Mapping[str, ArrayLike],
    count: int,
    check: bool,
) -> dict[str, Array]:
    """Evaluate compiled lines, group after group, over all samples.

    Every signal has shape (n,) or (B, n).

    Parameters
    ----------
    inputs
        Input signals, shape (n,) or (B, n).
    values
        Parameter values, scalars or shape (B,).
    """
    shape = (count,) if batch is None else (batch, count)
    lag = min(max(first_samples(lines).values(), default=0), count)
    given = {name: np.asarray(samples, dtype=float) for name, samples in initial.items()}
    for name, samples in given.items():
        if name not in {line.signal for line in lines}:
            raise ModelError(f"initial samples for {name!r}, which no line defines: name a signal of the model")
        if samples.ndim == 0 or samples.shape[-1] < lag or not np.isfinite(samples[..., :lag]).all():
            raise ModelError(f"initial samples of {name!r} are too few or not finite: give {lag} finite ones")
    known = {name: np.array(np.broadcast_to(samples, shape)) for name, samples in inputs.items()}
    with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
        for group in compile_lines(lines):
            start = lag if group.recursive else min(group.first, count)
            for name in group.signals:
                known[name] = np.full(shape, np.nan)
                if name in given:
                    known[name][..., :start] = given[name][..., :start]
            if group.recursive:
                group.warm_up(known, values, set(group.signals) & given.keys(), start)
            if start < count:
                group.evaluate(known, values, start)
            if check:
                _check_finite(group.signals, known, start)
    return known


def _check_finite(names: Sequence[str], known: Mapping[str, Array], start: int) -> None:
    finite = np.logical_and.reduce([np.isfinite(known[name][..., start:]) for name in names])
    if not finite.all():
        lost = ~(finite if finite.ndim == 1 else finite.all(axis=0))
        sample = start + int(np.argmax(lost))
        raise ModelError(
            f"the simulation of {', '.join(names)} leaves the finite range at sample {sample}: "
            "check that the parameters give a stable model"
        )


def measured_signals(
    model: Model, channels: Mapping[str, ArrayLike], values: Mapping[str, Any], gaps: bool = False
) -> dict[str, Array]:
    """Read the measured, defined signals off the output channels, through the sensor curves.

    Per measured signal, shape (n,); NaN for missing samples where ``gaps`` are allowed.
    """
    return {
        item.signal: channel_to_signal(item, channel_samples(channels, item.channel, gaps), values)
        for item in reversed(model.outputs)
    }
