"""One-step-ahead fits, in which past outputs are inputs: where a fit of the free run starts.

Of a model that is linear in its parameters such a fit is linear least squares.

Reference: Ljung, System Identification, 2nd ed., section 7.2 (prediction errors).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from relaxations.algebra.arrays import Mask
from smid.data import Channel, Dataset
from smid.data.gaps import bridged, missing_samples
from smid.fitting.problem import Fitting
from smid.models import Model, Parameter
from smid.models.predictor import past_name, predictor


def prediction(model: Model, data: Dataset, used: Sequence[Mask], scale: Mapping[str, float] | None = None) -> Fitting:
    """Return the one-step-ahead problem, with past outputs as inputs; outputs have no sensor curve.

    It leaves out the samples whose recent past is not all there.
    """
    measured = {m.signal: m.channel for m in model.outputs}
    lines = predictor(model.discretised().lines, frozenset(measured))
    ahead = Model("one step ahead", model.parameters, lines, model.measurements)
    lost = [missing_samples(run, measured.values()) for run in data.experiments]
    reach = np.ones(model.max_lag + 1)
    known = [mask & ~(np.convolve(gaps, reach)[: len(gaps)] > 0) for mask, gaps in zip(used, lost, strict=True)]
    return Fitting(ahead, _with_past(data, {past_name(s): c for s, c in measured.items()}), known, scale=scale)


def one_step_ahead(
    model: Model, data: Dataset, used: Sequence[Mask], seed: int = 0, starts: int = 3
) -> dict[str, float]:
    """Return the parameters of a one-step-ahead fit (linear for a linear model); {} if it fails."""
    if any(m.inverse is not None for m in model.measurements):
        return {}
    problem = prediction(model, data, used)
    free = [p for p in model.parameters if p.lower < p.upper]
    generator = np.random.default_rng(seed)
    best, least = {}, np.inf
    for trial in range(starts):
        values = {p.name: drawn(p, generator) if trial else min(max(0.1, p.lower), p.upper) for p in free}
        vector, cost = problem.solve(problem.start(values), 30, 1e-4)
        if cost < least:
            best, least = dict(zip(problem.run.parameters, vector.tolist(), strict=False)), cost
    return best


def _with_past(data: Dataset, channels: Mapping[str, str]) -> Dataset:
    """Return the data with copies of channels under other names; nothing is fitted to the lines across their gaps."""
    runs = tuple(
        replace(run, values={**run.values, **{new: bridged(run.values[old]) for new, old in channels.items()}})
        for run in data.experiments
    )
    return replace(data, experiments=runs, channels=(*data.channels, *(Channel(new) for new in channels)))


def drawn(parameter: Parameter, generator: np.random.Generator) -> float:
    """Return a random value within the box of a parameter."""
    low = parameter.lower if np.isfinite(parameter.lower) else min(-1.0, parameter.upper - 2)
    high = parameter.upper if np.isfinite(parameter.upper) else max(1.0, low + 2)
    return float(generator.uniform(low, high))
