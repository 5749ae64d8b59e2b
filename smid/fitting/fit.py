"""Output-error least squares from several starts (:mod:`.problem`)."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from relaxations.algebra.arrays import Array, Mask
from smid.data import DataError, Dataset
from smid.fitting.one_step_ahead import drawn, one_step_ahead
from smid.fitting.problem import Fit, Fitting
from smid.models import Model, Parameter

_DRAWN = 125  # random values within the boxes, and as many of any size: in another unit they are 1e-3 or 1e6
_ORDERS = 16.0  # of magnitude
_LARGEST = 1e8  # in place of an infinite end
_EXACT = 1e-14  # reduction of the cost, as small as it can be told


def fit(
    model: Model,
    data: Dataset,
    used: Sequence[Mask] | None = None,
    *,
    starts: int = 6,
    seed: int = 0,
) -> Fit:
    """Return a model whose free run is fitted to data by least squares.

    Parameters
    ----------
    model
        Bound to the data's channels. Its parameter values, if any, are the first start.
    used
        Shape (n,). Per experiment, the samples to fit; by default all after the warm-up. Missing samples are left out.
    starts
        Number of starts: the model's values, a one-step-ahead fit (also scaled towards zero), then the best of many
        random values of all orders of magnitude.

    Raises
    ------
    DataError
        If no start gives a finite simulation.

    Examples
    --------
    >>> from smid.models import OutputError
    >>> u = [1.0, 0, 1, 1, 0, 0, 1, 0]
    >>> data = Dataset.from_arrays(input={"u": u}, output={"y": [0, 1, 0.5, 1.25, 1.625, 0.8125, 0.40625, 1.203125]},
    ...     sampling_time=1.0)
    >>> round(fit(OutputError(), data).model.values["a1"], 6)
    -0.5
    """
    if used is None:
        used = [np.arange(run.n_samples) >= data.n_init for run in data.experiments]
    problem = Fitting(model, data, used)
    return problem.result(*best_of_starts(problem, starts, seed))


def best_of_starts(problem: Fitting, starts: int = 6, seed: int = 0) -> tuple[Array, float]:
    """Return the best vector found from several starts, shape (n_free,), and its cost; see `fit`."""
    best, least, guessed = None, np.inf, None
    for values in _starts(problem, starts, seed):
        vector, cost = problem.solve(problem.start(values))
        if cost < least:
            best, least, guessed = vector, cost, problem.initial(vector)
    if best is None or guessed is None:
        raise DataError(
            f"the model {problem.model.name!r} cannot be simulated on these data: it diverges from every start. Bound "
            "its parameters to the stable range (stable=True), or give start values"
        )
    reached = problem.at(dict(zip(problem.run.parameters, best.tolist(), strict=False)), guessed)
    # Which start is best by the last digits must not matter.
    return problem.solve(reached, tolerance=_EXACT)


def _starts(problem: Fitting, count: int, seed: int) -> list[dict[str, float]]:
    model, generator = problem.model, np.random.default_rng(seed)
    free = [p for p in model.parameters if p.lower < p.upper]
    if not free:
        return [{}]
    found: list[dict[str, float]] = []
    if all(p.name in model.values for p in free):
        found.append({p.name: model.values[p.name] for p in free})
    ahead = one_step_ahead(model, problem.data, problem.used, seed)
    for shrink in (1.0, 0.9, 0.5) if ahead else ():
        found.append({name: shrink * value for name, value in ahead.items()})
    if len(found) < count:
        draws = [{p.name: draw(p, generator) for p in free} for draw in (drawn, _of_any_size) for _ in range(_DRAWN)]
        with np.errstate(all="ignore"):  # many overflow
            found += sorted(draws, key=lambda values: problem.cost(problem.quick_start(values)))
    return found[:count]


def _of_any_size(parameter: Parameter, generator: np.random.Generator) -> float:
    """Return a random value within the box of a parameter, of any order of magnitude."""
    ends = np.clip([parameter.lower, parameter.upper], -_LARGEST, _LARGEST)
    size = generator.choice(ends[ends != 0]) * 10.0 ** -generator.uniform(0, _ORDERS)
    return float(np.clip(size, parameter.lower, parameter.upper))
