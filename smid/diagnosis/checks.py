"""What a diagnosis is asked for, checked before any work: effects, noise bound, and a record that moves."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping, Sequence
from numbers import Integral

import numpy as np

from smid.data import DataError, Dataset
from smid.data.gaps import bridged
from smid.diagnosis.effects import EFFECTS
from smid.diagnosis.effects.effect import Effect
from smid.feasible.feasible_set import check_noise_bound, is_constant
from smid.models import Model, ModelError

_STEP = 0.5  # of the range: a step response with little damping swings over nearly twice its step


def chosen_effects(effects: Sequence[str | Effect] | None) -> tuple[Effect, ...]:
    """Return the effects to try; ModelError for one that is unknown or stands there twice."""
    known = {effect.name: effect for effect in EFFECTS}
    if effects is None:
        return EFFECTS
    if isinstance(effects, str) or not isinstance(effects, Iterable):
        one = effects if isinstance(effects, str) else EFFECTS[0].name
        raise ModelError(f"effects = {effects!r}: give a list of names, [{one!r}]")
    chosen = []
    for item in effects:
        if isinstance(item, str) and item not in known:
            raise ModelError(
                f"effect {item!r} is unknown: choose from {', '.join(known)}, or give an Effect of your own"
            )
        chosen.append(known[item] if isinstance(item, str) else item)
    if not chosen or len({e.name for e in chosen}) < len(chosen):
        raise ModelError("the effects to try must be at least one, each under its own name: list every effect once")
    return tuple(chosen)


def processes(workers: int | None) -> int:
    """Return how many processes to use, one per processor where no number is given; ModelError for less than one."""
    if workers is not None and not (isinstance(workers, Integral) and workers >= 1):
        raise ModelError(f"workers = {workers}: give a number of processes, at least 1, or none for one per processor")
    return workers or os.cpu_count() or 1


def output_of(model: Model, output: str | None) -> tuple[str, tuple[str, ...]]:
    """Return the output to diagnose, and a sentence where there are others."""
    channels = model.output_channels
    if output is not None and output not in channels:
        raise ModelError(f"{output!r} is no output of the model: choose among {', '.join(channels)}")
    chosen = channels[0] if output is None else output
    others = ", ".join(c for c in channels if c != chosen)
    return chosen, (f"The diagnosis is about {chosen}, not about the output {others}.",) if others else ()


def bound_of_output(model: Model, noise_bound: float | Mapping[str, float] | None, output: str) -> float | None:
    """Return the noise bound of an output."""
    if noise_bound is None:
        return None
    if output not in {m.channel for m in model.measurements if m.noise is not None}:
        raise ModelError(
            f"the model takes no output {output!r} as noisy, so a noise bound does not apply: give none, or a model "
            "whose output has noise"
        )
    return check_noise_bound(model, noise_bound, None)[output]


def check_moving(model: Model, data: Dataset) -> None:
    """Raise an error if a channel of the model is constant before the test part."""
    still = {
        channel: data.experiments[0].values[channel][0] for channel in model.channels if is_constant(data, channel)
    }
    for channel in model.output_channels:
        if channel in still:
            raise DataError(
                f"the output {channel!r} is constant: it is {still[channel]:g} at every sample before the test part; "
                "check the sensor, or crop the record to where it moves"
            )
    from_rest = still.keys() >= set(model.input_channels) and any(_steps(data, c) for c in model.output_channels)
    for channel in model.input_channels:
        if channel in still and not from_rest:
            raise DataError(
                f"the input {channel!r} does not excite: it is {still[channel]:g} at every sample before the test "
                "part; measure with an input that moves (a step, a ramp, a PRBS), crop the record to where it does, or "
                "leave it out of the model"
            )


def _steps(data: Dataset, channel: str) -> bool:
    """Return whether an output ends far from where it begins and moves little by then, as a step response does."""
    runs = [bridged(run.values[channel]) for run in data.experiments]
    ends = [y[-max(1, len(y) // 4) :] for y in runs]
    return all(
        abs(np.median(end) - y[0]) >= _STEP * np.ptp(y) and np.ptp(end) <= _STEP * np.ptp(y)
        for y, end in zip(runs, ends, strict=True)
    )
