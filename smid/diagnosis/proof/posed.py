"""A model on a window of a record, as a proof takes it: every parameter and every hidden state has a box."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from relaxations.algebra.arrays import Array
from smid.data import Channel, Dataset
from smid.fitting.fit import Fitting
from smid.fitting.minimax import minimax
from smid.identification.inversion.outermost import unknowns_of
from smid.identification.inversion.record import Record
from smid.models import Model, signal, t

REACH = 10.0
"""What has no box is taken to be at most so many times as large as in a fit."""

ASSUMED = f"parameters without a box: at most {REACH:g} times their fit"


def posed(model: Model, part: Dataset, bounds: Mapping[str, float]) -> tuple[Record, list[Array]]:
    """Return the record of a window, and candidates for a point that fits it.

    A parameter or a hidden state without a box is bounded by `REACH` times its magnitude in a fit.
    """
    problem = Fitting(model, part, [np.ones(run.n_samples, bool) for run in part.experiments], scale=bounds)
    with np.errstate(all="ignore"):
        start = problem.start(model.values)
        vectors = [minimax(problem, vector)[0] for vector in (problem.solve(start)[0], start)]
        fit = problem.result(vectors[0], 0.0)
        signals, _ = problem.run.run(problem.inputs[0], fit.model.values, fit.initial[0], jacobian=False)
    record = Record(model, part, bounds)
    if record.loose:
        sizes = {name: float(np.nanmax(np.abs(samples))) for name, samples in signals.items()} | dict(fit.model.values)
        boxes = {name: (-_reach(sizes[name]), _reach(sizes[name])) for name in record.loose}
        record = Record(model.bound(**boxes), part, bounds)
    record = record.turned(signals)
    return record, [unknowns_of(record, problem, vector) for vector in vectors]


def _reach(value: float) -> float:
    return REACH * (abs(value) or 1.0)


def with_known_clocks(model: Model, data: Dataset) -> tuple[Model, Dataset]:
    """Return the model with its clocks as channels of the data: a window does not begin at time zero."""
    for line in model.lines:
        step = line.expression - signal(line.signal)[t - 1]
        if line.rate or not step.is_number:
            continue
        runs = tuple(
            replace(run, values={**run.values, line.signal: float(step) * np.arange(run.n_samples, dtype=np.float64)})
            for run in data.experiments
        )
        data = replace(data, experiments=runs, channels=(*data.channels, Channel(line.signal)), resampling=())
        model = replace(model, lines=tuple(other for other in model.lines if other is not line))
    return model, data
