"""A model on a window of a record, as a proof takes it: every parameter and every hidden state has a box."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from relaxations.algebra.arrays import Array
from smid.data import Channel, Dataset
from smid.diagnosis.proof.reached import reached
from smid.fitting.minimax import minimax
from smid.fitting.problem import Fitting
from smid.identification.inversion.outermost import unknowns_of
from smid.identification.inversion.record import Record
from smid.models import Model, signal, t

REACH = 10.0
"""What has no box is taken to be at most so many times as large as in a fit."""

ASSUMED = f"parameters without a box: at most {REACH:g} times their fit"


@dataclass(frozen=True, eq=False)
class Posed:
    """A model on a window of a record.

    Parameters
    ----------
    points
        Candidates for a point that fits: by least squares, and with the smallest largest error.
    least
        The smallest largest error that was found, in noise bounds. It proves nothing.
    error
        Shape (n,). Of the least-squares fit at each sample, in noise bounds.
    """

    record: Record
    points: tuple[Array, ...]
    least: float
    error: Array

    @property
    def fits(self) -> bool:
        """Whether a candidate is verified to fit."""
        return any(map(self.record.fits, self.points))


def posed(model: Model, part: Dataset, bounds: Mapping[str, float], inputs: Mapping[str, tuple[float, float]]) -> Posed:
    """Pose a model on a window.

    A parameter or a hidden state without a box is bounded by `REACH` times its magnitude in a fit. What inputs alone
    drive is where they can drive it.

    Parameters
    ----------
    part
        The window.
    inputs
        The range of each channel in the whole record.
    """
    problem = Fitting(model, part, [np.ones(run.n_samples, bool) for run in part.experiments], scale=bounds)
    with np.errstate(all="ignore"):
        start = problem.start(model.values)
        solved = problem.solve(start)[0]
        found = [minimax(problem, vector) for vector in (solved, start)]
        fit, vectors = problem.result(found[0][0], 0.0), [vector for vector, _ in found]
        signals, _ = problem.run.run(problem.inputs[0], fit.model.values, fit.initial[0], jacobian=False)
        errors = [problem.result(solved, 0.0).residual(part, m.channel)[0] / bounds[m.channel] for m in problem.outputs]
    # Boxes that are proven empty are small, and of small ones a run through all samples says more than pieces.
    record = Record(model, part, bounds, whole=True)
    if record.loose:
        sizes = {name: float(np.nanmax(np.abs(samples))) for name, samples in signals.items()} | dict(fit.model.values)
        boxes = {name: (-_reach(sizes[name]), _reach(sizes[name])) for name in record.loose}
        boxes |= {name: ends for name, ends in reached(record.model, inputs, signals).items() if name in boxes}
        record = Record(model.bound(**boxes), part, bounds, whole=True)
    record = record.turned(signals)
    return Posed(
        record,
        tuple(unknowns_of(record, problem, vector) for vector in vectors),
        min(largest for _, largest in found),
        np.sqrt(np.nansum(np.square(errors), axis=0)),
    )


def _reach(value: float) -> float:
    return REACH * (abs(value) or 1.0)


def with_known_clocks(model: Model, data: Dataset) -> tuple[Model, Dataset]:
    """Return the model with its clocks as channels of the data: a window does not begin at time zero."""
    for line in model.lines:
        step = line.expression - signal(line.signal)[t - 1]
        if line.rate or not step.is_number:
            continue
        samples = [float(step) * np.arange(run.n_samples, dtype=np.float64) for run in data.experiments]
        data = with_channel(data, line.signal, samples)
        model = replace(model, lines=tuple(other for other in model.lines if other is not line))
    return model, data


def with_channel(data: Dataset, name: str, samples: Sequence[Array]) -> Dataset:
    """Return a record with a further channel.

    Parameters
    ----------
    samples
        Shape (n,). Of each experiment.
    """
    runs = tuple(
        replace(run, values={**run.values, name: own}) for run, own in zip(data.experiments, samples, strict=True)
    )
    return replace(data, experiments=runs, channels=(*data.channels, Channel(name)), resampling=())
