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

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.optimize import linprog

from relaxations.algebra.arrays import Array
from smid.data import DataError, Dataset
from smid.display.result import Part, Result
from smid.display.table import Table
from smid.models import ModelError
from smid.sensors.lag import lag
from smid.sensors.prediction import Prediction
from smid.sensors.program import Block, Code, Program
from smid.sensors.ranges import Range
from smid.sensors.sensor import VirtualSensor, trained
from smid.sensors.stream import Stream
from smid.sensors.tensor import Tensor
from smid.sensors.trained_on import TrainedOn

__all__ = ["BoundedSensor", "IntervalPrediction", "bound_error"]

KNOTS = 7
MEMORY = 0.8  # the pole of the speed: five samples
MARGIN = 0.3
SLACK = 1e-14
INT64 = 7  # the type's number in ONNX


@dataclass(frozen=True, eq=False, repr=False)
class IntervalPrediction(Result):
    """Intervals of the output of records.

    Parameters
    ----------
    prediction
        The computed output, in the middle of the intervals.
    lower, upper
        Shape (n,). In the unit of the output, one array per record.

    Examples
    --------
    >>> from smid.data.bundled import load_clutch
    >>> from smid.sensors import CFPX
    >>> data = load_clutch("20C_ramp_a")
    >>> found = bound_error(CFPX(10).fit(data, seed=1), data).predict(data)
    >>> found.records, found.mean_width < 4
    (('20C_ramp_a',), True)
    """

    prediction: Prediction
    lower: tuple[Array, ...]
    upper: tuple[Array, ...]

    def _content(self) -> Iterator[Part]:
        rows = tuple(
            (name, str(low.size), f"{np.mean(high - low):.3g}")
            for name, low, high in zip(self.records, self.lower, self.upper, strict=True)
        )
        output = self.prediction.output
        width = f"mean width [{output.unit}]" if output.unit else "mean width"
        yield Table(f"Intervals of {output.name}.", ("record", "samples", width), rows, "lrr")
        yield from self.warnings

    @property
    def records(self) -> tuple[str, ...]:
        """Names of the records."""
        return self.prediction.records

    @property
    def position(self) -> tuple[Array, ...]:
        """The computed output, one array per record."""
        return self.prediction.position

    @property
    def warnings(self) -> tuple[str, ...]:
        """Limits of the answer."""
        return self.prediction.warnings

    @property
    def mean_width(self) -> float:
        """Mean of upper minus lower over all samples, in the unit of the output."""
        return float(np.mean(np.concatenate(self.upper) - np.concatenate(self.lower)))

    def coverage(self, data: Dataset) -> dict[str, float]:
        """Return the share of each record's measured outputs, from 0 to 1, that lies inside the intervals.

        Raises
        ------
        DataError
            As `Prediction.measured`.
        """
        measured = self.prediction.measured(data)
        return {
            name: float(np.mean(((low <= y) & (y <= high))[data.n_init :]))
            for name, y, low, high in zip(self.records, measured, self.lower, self.upper, strict=True)
        }


@dataclass(frozen=True, eq=False)
class BoundedSensor:
    """A trained sensor and the bound of its error.

    Parameters
    ----------
    knots
        Shape (m - 1,). Values of the output, rising; beyond them the bound is constant.
    weights
        Shape (m,). Of the hats in the unit of the output, then of the speed.
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

    @property
    def trained_on(self) -> TrainedOn | None:
        """The records that trained the sensor."""
        return self.sensor.trained_on

    def program(self) -> Program:
        """Return the steps of the sensor, and of half the width of its interval."""
        return self.sensor.program().bounded(HalfWidth(self.knots, self.weights, self.margin))

    def predict(self, data: Dataset) -> IntervalPrediction:
        """Return intervals of the output.

        Raises
        ------
        DataError
            As `VirtualSensor.predict`.
        """
        said, block = self.sensor.predict(data), HalfWidth(self.knots, self.weights, self.margin)
        halves = [block.advance([x], block.rest([x[0]]))[0] for x in said.position]
        return IntervalPrediction(
            said,
            lower=tuple(x - d for x, d in zip(said.position, halves, strict=True)),
            upper=tuple(x + d for x, d in zip(said.position, halves, strict=True)),
        )

    def stream(self, *, units: Mapping[str, str] | None = None, state: Mapping[str, Any] | None = None) -> Stream:
        """Return the sensor for samples one by one; see `VirtualSensor.stream`."""
        return Stream(self.program(), trained(self.trained_on, self), units or {}, state)


@dataclass(frozen=True, eq=False)
class HalfWidth(Block):
    """Half the width of the interval of an output; the memory is the last output and the recent speed."""

    knots: Array
    weights: Array
    margin: float

    def rest(self, first: Sequence[Array]) -> Array:
        """Return the first output, and no speed; see `Block.rest`."""
        return np.array([first[0], 0.0])

    def advance(self, signals: Sequence[Array], memory: Array) -> tuple[Array, Array]:
        """Return the bounds; see `Block.advance`."""
        position = signals[0]
        speed = _speed(position, memory)
        shape = np.interp(position, self.knots, self.weights[:-1])
        half = (1.0 + self.margin) * (shape + self.weights[-1] * speed)
        return half, np.array([position[-1], speed[-1]])

    def past(self, signals: Sequence[Range]) -> Range:
        """Return any last output and any speed; see `Block.past`."""
        now = signals[0]
        return Range(np.array([now.lower, 0.0]), np.array([now.upper, now.width * (1.0 + SLACK)]))

    def enclose(self, signals: Sequence[Range], memory: Range, cells: int) -> tuple[Range, Range]:  # noqa: ARG002
        """Return the least and the largest bound; see `Block.enclose`."""
        now, before, speed = signals[0], memory[0], memory[1]
        inside = self.knots[(now.lower < self.knots) & (self.knots < now.upper)]
        shape = np.interp([now.lower, now.upper, *inside], self.knots, self.weights[:-1])
        step = Range(
            np.maximum(0.0, np.maximum(now.lower - before.upper, before.lower - now.upper)),
            np.maximum(now.upper - before.lower, before.upper - now.lower),
        )
        recent = [MEMORY * s + (1.0 - MEMORY) * d for s, d in ((speed.lower, step.lower), (speed.upper, step.upper))]
        # Nonnegative sums of a few terms: their rounding errors are below the slack.
        least, most = (
            (1.0 + self.margin) * (s + self.weights[-1] * v) * (1.0 + slack)
            for s, v, slack in ((shape.min(), recent[0], -SLACK), (shape.max(), recent[1], SLACK))
        )
        speeds = np.asarray(recent) * (1.0 + np.array([-SLACK, SLACK]))
        after = Range(np.array([now.lower, speeds[0]]), np.array([now.upper, speeds[1]]))
        return Range(np.asarray(least), np.asarray(most)), after

    def onnx(self, signals: Sequence[Tensor], memory: Tensor) -> tuple[Tensor, Tensor]:
        """Return the interpolation and the speed; see `Block.onnx`."""
        graph, x = memory.graph, signals[0]
        step = graph.add("Abs", x - memory[:1].begun(x))
        speed = step + MEMORY * (memory[1:2].begun(0.0) - step)
        held = x.clip(float(self.knots[0]), float(self.knots[-1]))
        # The number of the inner knots that x has reached is the place of its line.
        reached = graph.add("Cast", graph.add("GreaterOrEqual", held, self.knots[1:-1]), to=INT64)
        place = graph.add("ReduceSum", reached, np.array([0], dtype=np.int64), keepdims=1)
        heights = self.weights[:-1]
        tables = (np.diff(heights) / np.diff(self.knots), self.knots[:-1], heights[:-1])
        slope, knot, height = (graph.add("Gather", table, place) for table in tables)
        shape = slope * (held - knot) + height
        half = (1.0 + self.margin) * (shape + float(self.weights[-1]) * speed)
        return half, graph.join(x, speed)

    def code(self, name: str, signals: Sequence[str]) -> Code:
        """Return numpy's interpolation and the speed; see `Block.code`."""
        x, n = signals[0], self.knots.size
        heights = self.weights[:-1]
        slopes = np.diff(heights) / np.diff(self.knots)
        tables = [
            f"static const double {name}_{what}[{values.size}] = {{{', '.join(map(repr, values.tolist()))}}};"
            for what, values in (("x", self.knots), ("y", heights), ("k", slopes))
        ]
        return Code(
            update=(
                f"m[1] = fabs({x} - m[0]) + {MEMORY!r} * (m[1] - fabs({x} - m[0]));\n"
                f"m[0] = {x};\n"
                f"{name} = interpolated({x}, {n}, {name}_x, {name}_y, {name}_k);\n"
                f"{name} = {1.0 + self.margin!r} * ({name} + {float(self.weights[-1])!r} * m[1]);"
            ),
            constants="\n".join(tables),
            size=2,
            rest=f"m[0] = {x}; m[1] = 0.0;",
        )

    def range_code(self, name: str, signals: Sequence[str]) -> Code:
        """Return the least and the largest bound; see `Block.range_code`."""
        x, n = signals[0], self.knots.size
        table = name.removeprefix("r")
        half = f"{1.0 + self.margin!r} * (%s + {float(self.weights[-1])!r} * %s) * (1.0 %s {SLACK!r})"
        return Code(
            f"{{ double least = interpolated({x}.lower, {n}, {table}_x, {table}_y, {table}_k);\n"
            f"  double most = interpolated({x}.upper, {n}, {table}_x, {table}_y, {table}_k);\n"
            "  double shape[2] = {smaller(least, most), larger(least, most)};\n"
            f"  for (int k = 0; k < {n}; k++)\n"
            f"    if ({x}.lower < {table}_x[k] && {table}_x[k] < {x}.upper) {{\n"
            f"      shape[0] = smaller(shape[0], {table}_y[k]);\n"
            f"      shape[1] = larger(shape[1], {table}_y[k]);\n"
            "    }\n"
            f"  least = larger(0.0, larger({x}.lower - high[0], low[0] - {x}.upper));\n"
            f"  most = larger({x}.upper - low[0], high[0] - {x}.lower);\n"
            f"  low[1] = {MEMORY!r} * low[1] + {1.0 - MEMORY!r} * least;\n"
            f"  high[1] = {MEMORY!r} * high[1] + {1.0 - MEMORY!r} * most;\n"
            f"  {name}.lower = {half % ('shape[0]', 'low[1]', '-')};\n"
            f"  {name}.upper = {half % ('shape[1]', 'high[1]', '+')};\n"
            f"  low[0] = {x}.lower; high[0] = {x}.upper;\n"
            f"  low[1] *= {1.0 - SLACK!r}; high[1] *= {1.0 + SLACK!r}; }}"
        )


def _speed(position: Array, memory: Array) -> Array:
    """Return the recent speed, shape (n,), after the last output and speed."""
    steps = np.abs(np.diff(position, prepend=memory[0]))
    return lag(steps, np.full(steps.size, MEMORY), float(memory[1]))


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
    trained(sensor.trained_on, sensor)
    if not margin >= 0:
        raise ModelError(f"margin = {margin}: give a share, 0 or more, such as {MARGIN}")
    said = sensor.predict(data)
    error = np.abs(np.concatenate(said.residuals(data)))
    positions = [x[data.n_init :] for x in said.position]
    position = np.concatenate(positions)
    if position.size <= KNOTS + 1:
        raise DataError(f"{position.size} samples for a bound of {KNOTS + 1} weights: give longer records")
    low, high = float(position.min()), float(position.max())
    knots = np.linspace(low, high if high > low else low + 1.0, KNOTS)
    hats = [np.interp(position, knots, row) for row in np.eye(KNOTS)]
    shape = np.stack([*hats, np.concatenate([_speed(x, np.array([x[0], 0.0])) for x in positions])], axis=1)
    solution = linprog(shape.mean(axis=0), A_ub=-shape, b_ub=-error, bounds=(0, None), method="highs")
    # The solver meets its constraints within a tolerance: raise all weights by the largest excess.
    found = np.asarray(solution.x, dtype=np.float64)
    weights = found * max(1.0, float(np.max(error / (shape @ found)))) * (1.0 + 1e-12)
    return BoundedSensor(sensor, knots, weights, margin, position.size)
