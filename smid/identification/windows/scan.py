"""The extreme parameters of the free runs that stay within the noise bounds, and the samples that hold them.

The search is local and without proof. Linear programs in the parameters and the initial states
(:mod:`smid.fitting.sequential`) cost about as much as a few simulations, whatever the length of the record.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from relaxations.algebra.arrays import Array, Index
from smid.data import DataError, Dataset
from smid.fitting.constraints import Constraints, constrained
from smid.fitting.fit import fit
from smid.fitting.problem import Fitting
from smid.fitting.sequential import Descents, largest
from smid.models import Model

_FITTED = 20_000  # samples of each experiment for the start by least squares
_MARGIN = 1e-9  # kept from the noise bounds, so that rounding does not break them
_PRICES = (1e3, 1e5, 1e7)  # of an error beyond the bound: raised while one is worth it, as where parameters trade
_WORTH = 1e-6
_INNER = 1e-9  # least predicted reduction of the largest error, for a run inside: on a long record few are
_OBJECTING = 5  # errors beyond the bound that a point of the windows adds to them
_BACK = 40  # halvings of the way back to a point inside


@dataclass(frozen=True, eq=False)
class Extreme:
    """The run at an end of an interval.

    Parameters
    ----------
    value
        The parameter's.
    vector
        Shape (n_free,). Parameters and initial states.
    rows
        The errors that hold it: indices into the residual.
    """

    value: float
    vector: Array
    rows: Index


class Scan:
    """The free runs of a model within the noise bounds of a record.

    Parameters
    ----------
    bounds
        Of each output channel, in its unit.

    Attributes
    ----------
    inside, least, least_rows
        The run with the smallest largest error that was found, this error as a share of the noise bound, and what holds
        it. Beyond 1 no run within the bounds was found.
    """

    def __init__(self, model: Model, data: Dataset, bounds: Mapping[str, float]) -> None:
        everything = [np.ones(run.n_samples, bool) for run in data.experiments]
        first = [np.arange(run.n_samples) < _FITTED for run in data.experiments]
        begun = fit(model, data, first)
        self.problem = Fitting(begun.model, data, everything, begun.initial, scale=bounds)
        self._descents = Descents(self.problem)
        start, constraints = self.problem.start(begun.model.values), Constraints.of(self.problem)
        if constraints.violated(start):
            part = Fitting(begun.model, data, first, begun.initial)
            start = constrained(part, part.start(begun.model.values), constraints)
            if constraints.violated(start):
                raise DataError("no run is found that keeps the constraints of the model")
        found = self._descents.descend(start, np.zeros(len(start)), 0.0, 1.0, _INNER)
        self.inside, self.least, self.least_rows = found.vector, found.largest, found.rows

    @property
    def free(self) -> tuple[str, ...]:
        """Return the parameters that have an interval."""
        problem = self.problem
        ends = zip(problem.run.parameters, problem.lower, problem.upper, strict=True)
        return tuple(name for name, low, high in ends if low < high)

    def values(self, vector: Array) -> dict[str, float]:
        """Return the value of every parameter of the model."""
        fixed = {p.name: p.lower for p in self.problem.model.parameters}
        return fixed | dict(zip(self.problem.run.parameters, vector.tolist(), strict=False))

    def extreme(self, name: str, sign: int) -> Extreme:
        """Return the run with the least value of a parameter (sign 1), or with the largest one (sign -1)."""
        place = self.problem.run.parameters.index(name)
        cost = np.zeros(len(self.inside))
        cost[place] = sign
        found = self._descents.descend(self.inside, cost, 1.0 - _MARGIN, _PRICES[0], _WORTH)
        for price in _PRICES[1:]:
            if found.largest > 1.0:
                found = self._descents.descend(found.vector, cost, 1.0 - _MARGIN, price, _WORTH)
        vector = self._pulled_back(found.vector)
        return Extreme(float(vector[place]), vector, found.rows)

    def difference(self, one: Extreme, other: Extreme) -> float:
        """Return by how much two runs differ, in noise bounds: the median, for their initial states soon fade."""
        errors = self.problem.residual(one.vector) - self.problem.residual(other.vector)
        return float(np.median(np.abs(errors)))

    def memory(self, least: float) -> int:
        """Return after how many samples initial states within the noise bounds change no error by more than a share."""
        problem = self.problem
        count = len(problem.run.parameters)
        channels = {m.signal: m.channel for m in problem.outputs}
        reach = np.array([problem.scale.get(channels.get(problem.run.states[k][0], ""), 0.0) for k in problem.begun])
        runs = len(problem.used)
        changed = np.abs(problem.jacobian(self.inside)[:, count:]) @ np.tile(reach, runs)
        lasting = self.problem.places[changed > least, 1]
        return int(lasting.max(initial=0)) + 1

    def places(self, rows: Index) -> Index:
        """Return the experiment and the sample of some errors, shape (n, 2)."""
        return self.problem.places[rows]

    def beyond(self, values: Mapping[str, float]) -> Index:
        """Return the errors that are most beyond the bound with some parameters, from the initial states inside."""
        vector = self.inside.copy()
        vector[: len(self.problem.run.parameters)] = [values[name] for name in self.problem.run.parameters]
        return largest(np.abs(self.problem.residual(vector)), 1.0, _OBJECTING)

    def _pulled_back(self, vector: Array) -> Array:
        """Return the run nearest to a vector, on the way to the run inside, whose errors are within the bounds."""

        def within(share: float) -> bool:
            errors = self.problem.residual(self.inside + share * (vector - self.inside))
            return float(np.abs(errors).max()) <= 1.0 - 0.5 * _MARGIN

        low, high = 0.0, 1.0
        if within(high):
            return vector
        for _ in range(_BACK):
            middle = 0.5 * (low + high)
            low, high = (middle, high) if within(middle) else (low, middle)
        return self.inside + low * (vector - self.inside)


def best_run(
    model: Model, data: Dataset, bounds: Mapping[str, float], values: Mapping[str, float]
) -> list[dict[str, Array]]:
    """Return the outputs of the run with given parameters whose largest error, as a share of its bound, is least."""
    everything = [np.ones(run.n_samples, bool) for run in data.experiments]
    fixed = model.bound(**{name: (value, value) for name, value in values.items()})
    problem = Fitting(fixed, data, everything, scale=bounds)
    vector = problem.start({})
    if problem.n_free:
        vector = Descents(problem).descend(vector, np.zeros(problem.n_free), 0.0, 1.0, _INNER).vector
    return problem.simulate(vector)
