"""Bounds of hidden signals as measurements."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from relaxations.algebra.arrays import Array
from relaxations.algebra.ball_arithmetic import EPSILON
from smid.data import Dataset
from smid.models import Measurement, Model
from smid.models.symbols import unused


def with_bounds_measured(
    model: Model, data: Dataset, bounds: Mapping[str, float]
) -> tuple[Model, list[dict[str, Array]], dict[str, float]]:
    """Return a model that measures its bounded hidden signals, with the samples of each experiment, and the bounds.

    To lie between two ends is to be measured as their middle, within half of their distance.
    """
    runs = [dict(run.values) for run in data.experiments]
    within, taken = dict(bounds), set(model.names)
    measurements = list(model.measurements)
    for name, (low, high) in model.bounds.items():
        channel, noise = (unused(f"{name}_{what}", taken) for what in ("between", "within"))
        taken |= {channel, noise}
        middle = 0.5 * low + 0.5 * high
        within[channel] = max(high - middle, middle - low) * (1 + 4 * EPSILON)
        for values, run in zip(runs, data.experiments, strict=True):
            values[channel] = np.full(run.n_samples, middle)
        measurements.append(Measurement(channel, name, noise))
    return replace(model, measurements=tuple(measurements), bounds={}), runs, within
