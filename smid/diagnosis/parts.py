"""The parts of a record: what may be fitted and chosen by, and the test part, which nobody sees until the end."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from numbers import Real

import numpy as np

from relaxations.algebra.arrays import Array, Mask
from smid.data import DataError, Dataset
from smid.diagnosis.search.record import FOLDS
from smid.fitting.problem import Fit, Fitting
from smid.models import Model

STARTING = 50
"""Samples that the initial states of a whole test experiment are fitted to, where the record gives no number."""
_LEAST_TEST = 30


@dataclass(frozen=True, eq=False)
class Parts:
    """The samples of a record by their use.

    Parameters
    ----------
    seen
        The record without the test part: what every fit and every choice is given.
    test
        Shape (n,). Per experiment of the whole record, the samples of the test part that count: not the first ones of
        a whole experiment, which tell its initial states.
    """

    seen: Dataset
    test: tuple[Mask, ...]


def split(model: Model, data: Dataset, test: float | Sequence[str]) -> Parts:
    """Divide a record.

    Parameters
    ----------
    test
        Share of each experiment, at its end, or names of experiments.

    Raises
    ------
    DataError
        For a share out of range, an unknown experiment, or parts too short for the model.
    """
    names = [run.name for run in data.experiments]
    chosen = [test] if isinstance(test, str) else test
    if not isinstance(chosen, Sequence):
        if not (isinstance(chosen, Real) and 0.05 <= chosen <= 0.9):
            raise DataError(f"test = {chosen}: give a share between 0.05 and 0.9, or names of experiments")
        stops = [round((1 - chosen) * run.n_samples) for run in data.experiments]
    else:
        unknown = [name for name in chosen if name not in names]
        if unknown:
            raise DataError(f"test experiment {unknown[0]!r} is unknown: the data have {', '.join(names)}")
        if all(name in chosen for name in names):
            raise DataError("test names every experiment, so none is left to fit: leave one out of test at least")
        stops = [0 if run.name in chosen else run.n_samples for run in data.experiments]
    masks = tuple(
        np.arange(run.n_samples) >= (max(stop, data.n_init) if stop else data.n_init or STARTING)
        for run, stop in zip(data.experiments, stops, strict=True)
    )
    seen = tuple(
        replace(run, values={name: samples[:stop] for name, samples in run.values.items()})
        for run, stop in zip(data.experiments, stops, strict=True)
        if stop > data.n_init
    )
    free = sum(p.lower < p.upper for p in model.parameters)
    least = max(_LEAST_TEST, 3 * free)
    seeing, testing = sum(run.n_samples - data.n_init for run in seen), sum(int(mask.sum()) for mask in masks)
    if seeing < 2 * least or testing < least:
        begun = f" (the first {data.n_init or STARTING} of an experiment do not count)" if 0 in stops else ""
        raise DataError(
            f"the record is too short for its parts: the fits and the choice need {2 * least} samples and have "
            f"{seeing}, in {FOLDS} blocks; the test part needs {least} samples and has {testing}{begun}. Take a longer "
            "record, or another share in test, or other experiments"
        )
    return Parts(data.with_experiments(seen), masks)


def free_run(fit: Fit, data: Dataset, parts: Parts) -> tuple[Mapping[str, Array], ...]:
    """Return the output channels of a fitted model over the whole record, shape (n,), per experiment.

    An experiment of the test part begins with the states that fit its first samples best.
    """
    initial = dict(zip((run.name for run in parts.seen.experiments), fit.initial, strict=True))
    result = []
    for run, test in zip(data.experiments, parts.test, strict=True):
        alone = data.with_experiments((run,))
        if run.name in initial:
            problem = Fitting(fit.model, alone, [~test], [initial[run.name]])
            result.append(problem.simulate(problem.start(fit.model.values))[0])
        else:
            result.append(free_run_of_new(fit.model, alone, data.n_init or STARTING))
    return tuple(result)


def free_run_of_new(model: Model, data: Dataset, samples: int) -> dict[str, Array]:
    """Return the output channels of a fitted model on one experiment that no fit has seen, shape (n,).

    Parameters
    ----------
    samples
        The first ones, which tell the initial states.
    """
    problem = Fitting(model, data, [np.arange(data.experiments[0].n_samples) < samples])
    vector, _ = problem.solve(problem.start(model.values), held=problem.run.parameters)
    return problem.simulate(vector)[0]
