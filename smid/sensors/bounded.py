"""A sensor with an error bound: the measured position lies in [x - D, x + D], x the computed position.

    D_t = (1 + margin) (sum_j d_j hat_j(x_t) + d_v v_t),    v_t = lag of |x_t - x_{t-1}|

The hats are piecewise linear functions between knots over the range of positions, v is the recent speed, and the d_j
are nonnegative. A linear program finds the d_j of the least mean bound that holds on every sample of records that did
not train the sensor:

    min mean D   such that   |y_t - x_t| <= D_t  for every t,    d >= 0

The bound includes the noise of the position sensor. If all samples were independent, another sample would exceed the
bound without margin with a mean probability of at most m / (N + 1), m the number of d's. Samples of a record are not
independent, so the bound is widened by the margin. Leaving out each record in turn shows which margin is needed.

References: Campi, Calafiore, Garatti, "Interval predictor models: identification and reliability", Automatica 45
(2009); Calafiore, Campi, "Uncertain convex programs: randomized solutions and confidence levels", Mathematical
Programming 102 (2005), for the m / (N + 1); Milanese, Novara, "Set membership identification of nonlinear systems",
Automatica 40 (2004), for bounds that vary over the range.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from scipy.optimize import linprog

from relaxations.algebra.arrays import Array
from smid.data import DataError, Dataset
from smid.display.result import Part, Result
from smid.display.table import Table
from smid.models import ModelError
from smid.sensors.lag import lag
from smid.sensors.sensor import VirtualSensor, require_channels, trained
from smid.sensors.stream import Stream

__all__ = ["BoundedSensor", "IntervalEstimate", "IntervalPrediction", "IntervalStream", "bound_error"]

KNOTS = 7
MEMORY = 0.8  # the pole of the speed: five samples
MARGIN = 0.3


@dataclass(frozen=True, eq=False, repr=False)
class IntervalPrediction(Result):
    """Intervals of the position of records.

    Parameters
    ----------
    records
        Names of the records.
    position, lower, upper
        Shape (n,). In mm, one array per record.
    warnings
        Limits of the answer.

    Examples
    --------
    >>> found = IntervalPrediction(("20C_ramp_b",), (np.ones(2),), (np.zeros(2),), (np.full(2, 2.0),))
    >>> found.records, found.upper[0] - found.lower[0]
    (('20C_ramp_b',), array([2., 2.]))
    """

    records: tuple[str, ...]
    position: tuple[Array, ...]
    lower: tuple[Array, ...]
    upper: tuple[Array, ...]
    warnings: tuple[str, ...] = ()

    def _content(self) -> Iterator[Part]:
        rows = tuple(
            (name, str(low.size), f"{np.mean(high - low):.3g}")
            for name, low, high in zip(self.records, self.lower, self.upper, strict=True)
        )
        yield Table("Intervals of the position.", ("record", "samples", "mean width [mm]"), rows, "lrr")
        yield from self.warnings

    @property
    def mean_width(self) -> float:
        """Mean of upper minus lower over all samples, in mm."""
        return float(np.mean(np.concatenate(self.upper) - np.concatenate(self.lower)))

    def coverage(self, data: Dataset) -> dict[str, float]:
        """Return the share of each record's measured positions, from 0 to 1, that lies inside the intervals.

        Raises
        ------
        DataError
            If there is no position, or the records are not those of the prediction.
        """
        require_channels(data, ("position",))
        if tuple(run.name for run in data.experiments) != self.records:
            raise DataError("the records are not those of the prediction: give the data set that was predicted")
        result = {}
        for run, low, high in zip(data.experiments, self.lower, self.upper, strict=True):
            y = run.values["position"]
            result[run.name] = float(np.mean(((low <= y) & (y <= high))[data.n_init :]))
        return result


@dataclass(frozen=True)
class IntervalEstimate:
    """The interval of the position at one instant: time in seconds, positions in mm.

    Examples
    --------
    >>> now = IntervalEstimate(time=0.5, position=1.2, lower=1.1, upper=1.3)
    >>> now.lower < now.position < now.upper
    True
    """

    time: float
    position: float
    lower: float
    upper: float
    warnings: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class BoundedSensor:
    """A trained sensor and the bound of its error.

    Parameters
    ----------
    knots
        Shape (m - 1,). Positions in mm, rising; beyond them the bound is constant.
    weights
        Shape (m,). Of the hats in mm, then of the speed.
    margin
        Share by which the bound is widened.
    n_samples
        Number of samples on which the bound holds.
    """

    sensor: VirtualSensor
    knots: Array
    weights: Array
    margin: float
    n_samples: int

    @property
    def violation(self) -> float:
        """Largest mean probability that another, independent sample exceeds the bound without margin."""
        return self.weights.size / (self.n_samples + 1)

    def predict(self, data: Dataset) -> IntervalPrediction:
        """Return intervals of the position.

        Raises
        ------
        DataError
            As `VirtualSensor.predict`.
        """
        said = self.sensor.predict(data)
        bounds = [_Bound(self).advance(x) for x in said.position]
        return IntervalPrediction(
            records=said.records,
            position=said.position,
            lower=tuple(x - d for x, d in zip(said.position, bounds, strict=True)),
            upper=tuple(x + d for x, d in zip(said.position, bounds, strict=True)),
            warnings=said.warnings,
        )

    def stream(self) -> IntervalStream:
        """Return the sensor for samples one by one; its answers equal those of `predict`."""
        return IntervalStream(self.sensor.stream(), _Bound(self))


class IntervalStream:
    """A bounded sensor that takes one sample after the other.

    Examples
    --------
    >>> from smid.data.bundled import load_clutch
    >>> from smid.sensors import PX
    >>> data = load_clutch("20C_ramp_a")
    >>> sensor = PX(hidden=(3,)).fit(data, seed=1, starts=1)
    >>> now = bound_error(sensor, data, margin=0.0).stream().update(0.0, pressure=0.0)
    >>> now.lower <= now.position <= now.upper
    True
    """

    def __init__(self, stream: Stream, bound: _Bound) -> None:
        self._stream, self._bound = stream, bound

    def update(self, time: float, **samples: float) -> IntervalEstimate:
        """Take the samples of an instant and return the interval; see `Stream.update`."""
        said = self._stream.update(time, **samples)
        half = float(self._bound.advance(np.array([said.position]))[0])
        return IntervalEstimate(time, said.position, said.position - half, said.position + half, said.warnings)


class _Bound:
    """Half the width of the interval, with the recent speed as memory."""

    def __init__(self, sensor: BoundedSensor) -> None:
        self._sensor = sensor
        self._speed = _Speed()

    def advance(self, position: Array) -> Array:
        sensor = self._sensor
        heights, weight = sensor.weights[:-1], sensor.weights[-1]
        shape = np.interp(position, sensor.knots, heights)
        return np.asarray((1.0 + sensor.margin) * (shape + weight * self._speed.advance(position)))


class _Speed:
    def __init__(self) -> None:
        self._position: float | None = None
        self._value = 0.0

    def advance(self, position: Array) -> Array:
        before = position[:1] if self._position is None else np.array([self._position])
        steps = np.abs(np.diff(np.concatenate([before, position])))
        speed = lag(steps, np.full(steps.size, MEMORY), self._value)
        self._position, self._value = float(position[-1]), float(speed[-1])
        return speed


def bound_error(sensor: VirtualSensor, data: Dataset, *, margin: float = MARGIN) -> BoundedSensor:
    """Return a trained sensor with the bound of its error.

    Parameters
    ----------
    data
        Records with the position that did not train the sensor.
    margin
        Share by which the bound is widened, for other records.

    Raises
    ------
    DataError
        If a channel is missing, or there are fewer samples than weights.
    ModelError
        If the sensor is not trained, or the margin is negative.

    Examples
    --------
    >>> from smid.data.bundled import load_clutch
    >>> from smid.sensors import PX
    >>> sensor = PX(hidden=(3,)).fit(load_clutch("20C_ramp_a"), seed=1, starts=1)
    >>> bounded = bound_error(sensor, load_clutch("20C_ramp_b"), margin=0.0)
    >>> bounded.predict(load_clutch("20C_ramp_b")).coverage(load_clutch("20C_ramp_b"))
    {'20C_ramp_b': 1.0}
    """
    trained(sensor.sampling_time, sensor)
    if not margin >= 0:
        raise ModelError(f"margin = {margin}: give a share, 0 or more, such as {MARGIN}")
    said = sensor.predict(data)
    error = np.abs(np.concatenate(said.residuals(data)))
    positions = [x[data.n_init :] for x in said.position]
    position = np.concatenate(positions)
    if position.size <= KNOTS + 1:
        raise DataError(f"{position.size} samples for a bound of {KNOTS + 1} weights: give longer records")
    knots = np.linspace(position.min(), position.max(), KNOTS)
    hats = [np.interp(position, knots, row) for row in np.eye(KNOTS)]
    shape = np.stack([*hats, np.concatenate([_Speed().advance(x) for x in positions])], axis=1)
    solution = linprog(shape.mean(axis=0), A_ub=-shape, b_ub=-error, bounds=(0, None), method="highs")
    # The solver meets its constraints within a tolerance: raise all weights by the largest excess.
    found = np.asarray(solution.x, dtype=np.float64)
    weights = found * max(1.0, float(np.max(error / (shape @ found)))) * (1.0 + 1e-12)
    return BoundedSensor(sensor, knots, weights, margin, position.size)
