"""Free runs of a model over records that it was not fitted to.

A run starts from the first measured outputs. A hidden state, which no channel shows, has no such start: the hidden
states, and with them all initial states, are those that fit the first samples best, 25 for each state and at most half
of the record. The parameters are kept. These samples are not scored.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from relaxations.algebra.arrays import Array
from smid.data import Dataset
from smid.fitting.problem import Fitting
from smid.models import Model
from smid.models.running import parameter_values
from smid.models.sensitivities import compile_free_run

__all__ = ["beginning", "free_runs"]

_PER_STATE = 25


def hidden_states(model: Model) -> frozenset[str]:
    """Return the signals with memory that no output channel shows."""
    shown = {item.signal for item in model.outputs}
    return frozenset(name for name, _ in compile_free_run(model).states) - shown - set(model.inputs)


def beginning(model: Model, n_samples: int) -> int:
    """Return how many first samples of an experiment tell the hidden states; zero if there are none."""
    if not hidden_states(model):
        return 0
    return min(_PER_STATE * len(compile_free_run(model).states), n_samples // 2)


def free_runs(model: Model, data: Dataset) -> tuple[dict[str, Array], ...]:
    """Return the simulated output channels of each experiment, shape (n,) each.

    Parameters
    ----------
    model
        Bound to the data, with values.

    Examples
    --------
    >>> from smid.models import OutputError
    >>> data = Dataset.from_arrays(input={"u": [1.0, 0, 0]}, output={"y": [0.0, 1, 0.5]}, sampling_time=1.0)
    >>> free_runs(OutputError().with_values({"a1": -0.5, "b0": 1.0}), data)[0]["y"]
    array([0. , 1. , 0.5])
    """
    if not hidden_states(model):
        return tuple(dict(run) for run in model.simulate(data).outputs)
    values, _ = parameter_values(model, None)
    found = []
    for run in data.experiments:
        alone = replace(data, experiments=(run,), resampling=())
        problem = Fitting(model, alone, [np.arange(run.n_samples) < beginning(model, run.n_samples)])
        vector, _ = problem.solve(problem.start(values), held=problem.run.parameters)
        found += problem.simulate(vector)
    return tuple(found)
