"""The strict protocol: a peer is fitted and chosen without the test part, and simulated on it once.

1. The test part is the one of `benchmarks.measured_diagnosis`.
2. Each candidate of a peer (its orders) is fitted to the first four fifths of every run of the rest and simulated on
   the last fifth. The candidate of the least RMSE is fitted again, to the whole rest.
3. Every run is simulated from its beginning. The output samples that a peer may begin from are those before the test
   part, or the first ones of a whole test run, which do not count. They are the ones that smid begins from.

Inputs and outputs are scaled by mean and standard deviation of the samples of the fit.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from relaxations.algebra.arrays import Array
from smid import Dataset
from smid.data import Experiment

VALIDATION = 0.2
DIVERGED = 100.0
"""Error in ranges of the output beyond which a free run is called divergent."""


@dataclass(frozen=True, eq=False)
class Run:
    """A run as a peer gets it: inputs of shape (n, inputs), output of shape (n,)."""

    inputs: Array
    output: Array


Settings = tuple[int, ...]
FreeRun = Callable[[Array, Array], Array]
"""From the inputs of a run and its first output samples to the output of the whole run."""


@dataclass(frozen=True)
class Peer:
    """Another tool.

    Parameters
    ----------
    title, meaning
        Its name, and what its settings are.
    candidates
        The settings it chooses from.
    fit
        Its fit to runs, with settings.
    """

    title: str
    meaning: tuple[str, ...]
    candidates: tuple[Settings, ...]
    fit: Callable[[Sequence[Run], Settings], FreeRun]


def run_of(data: Dataset, experiment: Experiment) -> Run:
    """Return an experiment as a peer gets it."""
    return Run(np.column_stack([experiment.values[name] for name in data.inputs]), experiment.values[data.output])


def identified(peer: Peer, seen: Sequence[Run]) -> tuple[Settings, FreeRun]:
    """Choose the settings of a peer and fit it, on the runs without the test part."""
    stops = [round((1 - VALIDATION) * len(run.output)) for run in seen]
    fitting = [Run(run.inputs[:stop], run.output[:stop]) for run, stop in zip(seen, stops, strict=True)]

    def validation(settings: Settings) -> float:
        error = rmse(_fitted(peer, fitting, settings), list(zip(seen, stops, strict=True)))
        return np.inf if error is None else error

    best = min(peer.candidates, key=validation)
    return best, _fitted(peer, seen, best)


def rmse(free_run: FreeRun, runs: Sequence[tuple[Run, int]]) -> float | None:
    """Return the RMSE of free runs, None where one diverges.

    Parameters
    ----------
    runs
        Each with its number of first samples that are known and do not count.
    """
    errors = []
    for run, known in runs:
        with np.errstate(all="ignore"):
            error = free_run(run.inputs, run.output[:known])[known:] - run.output[known:]
        if not np.all(np.abs(error) < DIVERGED * np.ptp(run.output)):
            return None
        errors.append(error)
    return float(np.sqrt(np.mean(np.concatenate(errors) ** 2)))


def _fitted(peer: Peer, runs: Sequence[Run], settings: Settings) -> FreeRun:
    inputs, output = np.vstack([run.inputs for run in runs]), np.concatenate([run.output for run in runs])
    centre, zero = inputs.mean(axis=0), output.mean()
    scale, unit = (np.where(spread > 0, spread, 1.0) for spread in (inputs.std(axis=0), output.std()))
    scaled = peer.fit([Run((run.inputs - centre) / scale, (run.output - zero) / unit) for run in runs], settings)
    return lambda u, y: zero + unit * scaled((u - centre) / scale, (y - zero) / unit)
