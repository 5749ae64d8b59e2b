"""A sensor with a dead zone: up to a threshold of the pressure, the position is the rest position.

    x = rest  where  P <= threshold,   else the output of the sensor

The rest position is the mean of the positions below the threshold. Of all thresholds, the one that lowers the sum of
squared errors most is taken; cumulative sums over the samples sorted by pressure try every one.

Reference: clutch thesis, 5.3.3 and figures 5.19 to 5.21, which do not give the thresholds.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Self, TypeVar

import numpy as np

from relaxations.algebra.arrays import Array
from smid.data import Dataset
from smid.networks import ProgressCallback
from smid.sensors.program import Block, Code, Program
from smid.sensors.ranges import Range
from smid.sensors.sensor import VirtualSensor, require_training_data, training_rows
from smid.sensors.tensor import Tensor
from smid.sensors.trained_on import TrainedOn

__all__ = ["DeadZone", "enforced"]

Zone = TypeVar("Zone", bound="DeadZone")


@dataclass(frozen=True, eq=False)
class DeadZone(VirtualSensor):
    """A sensor, and the rest position at low pressure.

    Parameters
    ----------
    sensor
        Gives the position above the threshold.
    pressure
        Name of the channel with the threshold.
    threshold
        In the unit of the pressure; None before training, or if no threshold lowers the error.
    rest
        Position up to the threshold.

    Examples
    --------
    >>> from smid.data.bundled import load_clutch
    >>> from smid.sensors import CFPX
    >>> data = load_clutch("20C_step_a")
    >>> plain = CFPX(10).fit(data, seed=1)
    >>> sensor = DeadZone(CFPX(10)).fit(data, seed=1)
    >>> sensor.predict(data).mse(data) < plain.predict(data).mse(data)
    True
    """

    sensor: VirtualSensor
    pressure: str = "pressure"
    threshold: float | None = None
    rest: float | None = None
    trained_on: TrainedOn | None = None

    @property
    def channels(self) -> tuple[str, ...]:
        """Those of the sensor, and the pressure."""
        return tuple(dict.fromkeys((*self.sensor.channels, self.pressure)))

    @property
    def n_parameters(self) -> int:
        """Those of the sensor, threshold and rest."""
        return self.sensor.n_parameters + 2

    @property
    def output(self) -> str:
        """That of the sensor."""
        return self.sensor.output

    def fit(
        self,
        data: Dataset,
        *,
        seed: int | np.random.Generator,
        starts: int = 5,
        progress: ProgressCallback | None = None,
    ) -> Self:
        """Return this sensor, trained, with its dead zone; see `VirtualSensor.fit`."""
        require_training_data(data, self.channels, self.output)
        sensor = self.sensor.fit(data, seed=seed, starts=starts, progress=progress)
        return enforced(replace(self, sensor=sensor), data)

    def program(self) -> Program:
        """Return the steps of the sensor, then the threshold; see `VirtualSensor.program`."""
        inner = self.sensor.program()
        if self.threshold is None or self.rest is None:
            return inner
        return inner.then(Threshold(self.threshold, self.rest), inner.output, self.pressure)


def enforced(zone: Zone, data: Dataset) -> Zone:
    """Return a dead zone, whose sensor is trained, with the best threshold on records."""
    # For every threshold: the fall of the squared error if the samples up to it get their mean.
    rows = training_rows(data)
    order = rows[np.argsort(data.stacked(zone.pressure)[rows], kind="stable")]
    pressure, position = data.stacked(zone.pressure)[order], data.stacked(zone.output)[order]
    spoken = np.concatenate(zone.sensor.predict(data).position)[order]
    mean = np.cumsum(position) / np.arange(1, position.size + 1)
    at_rest = np.cumsum(position**2) - np.cumsum(position) * mean
    gain = np.cumsum((position - spoken) ** 2) - at_rest
    best = int(np.argmax(gain))
    told = TrainedOn.of(data, zone.channels, zone.output)
    if gain[best] <= 0:
        return replace(zone, threshold=None, rest=None, trained_on=told)
    return replace(zone, threshold=float(pressure[best]), rest=float(mean[best]), trained_on=told)


@dataclass(frozen=True)
class Threshold(Block):
    """A signal, replaced by a constant where a second one does not exceed the threshold."""

    threshold: float
    constant: float

    def rest(self, first: Sequence[Array]) -> Array:  # noqa: ARG002
        """Return no memory; see `Block.rest`."""
        return np.zeros(0)

    def advance(self, signals: Sequence[Array], memory: Array) -> tuple[Array, Array]:
        """Return the values; see `Block.advance`."""
        return np.where(signals[1] <= self.threshold, self.constant, signals[0]), memory

    def enclose(self, signals: Sequence[Range], memory: Range, cells: int) -> tuple[Range, Range]:  # noqa: ARG002
        """Return both where the second signal may lie on either side; see `Block.enclose`."""
        value, gate = signals
        at_rest = Range.exact(self.constant)
        if gate.upper <= self.threshold:
            return at_rest, memory
        return (value if gate.lower > self.threshold else value.hull(at_rest)), memory

    def onnx(self, signals: Sequence[Tensor], memory: Tensor) -> tuple[Tensor, Tensor]:
        """Return the condition; see `Block.onnx`."""
        graph = signals[0].graph
        at_rest = graph.add("LessOrEqual", signals[1], self.threshold)
        return graph.add("Where", at_rest, self.constant, signals[0]), memory

    def code(self, name: str, signals: Sequence[str]) -> Code:
        """Return the condition; see `Block.code`."""
        return Code(update=f"{name} = {signals[1]} <= {self.threshold!r} ? {self.constant!r} : {signals[0]};")

    def range_code(self, name: str, signals: Sequence[str]) -> Code:
        """Return the conditions of both ends of the second signal; see `Block.range_code`."""
        value, gate = signals
        rest, threshold = f"{self.constant!r}", f"{self.threshold!r}"
        return Code(
            f"{name}.lower = {gate}.upper <= {threshold} ? {rest}\n"
            f"  : {gate}.lower > {threshold} ? {value}.lower : smaller({value}.lower, {rest});\n"
            f"{name}.upper = {gate}.upper <= {threshold} ? {rest}\n"
            f"  : {gate}.lower > {threshold} ? {value}.upper : larger({value}.upper, {rest});"
        )
