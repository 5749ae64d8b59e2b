"""What a sensor keeps of the records that trained it: names, units, ranges and rates of the channels.

Units travel with the sensor. Records in another unit of the same kind are converted, others are refused.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from relaxations.algebra.arrays import Array
from smid.data import Channel, DataError, Dataset
from smid.models.units import conversion
from smid.sensors.ranges import Range

__all__ = ["Signal", "TrainedOn"]

TRAVEL = 20  # samples over which the largest change of a channel is kept
FASTER = 1.1  # a lost sample may have changed by this factor more than any in the training records
SLACK = 0.05  # of the range: how far beyond it a sample is no extrapolation


@dataclass(frozen=True)
class Signal:
    """A channel of the training records.

    Parameters
    ----------
    lower, upper
        Range of its samples.
    travel
        Largest change over 1, 2, ... samples.

    Examples
    --------
    >>> pressure = Signal("pressure", "bar", 0.0, 30.0, (2.0, 3.5))
    >>> near = pressure.after(10.0, 1)
    >>> near.lower.round(3), near.upper.round(3)
    (np.float64(7.8), np.float64(12.2))
    """

    name: str
    unit: str
    lower: float
    upper: float
    travel: tuple[float, ...]

    @classmethod
    def of(cls, data: Dataset, name: str) -> Self:
        """Return what records say of a channel."""
        runs = [run.values[name] for run in data.experiments]
        shifts = range(1, 1 + min(TRAVEL, max(run.size for run in runs) - 1))
        travel = [max(float(np.max(np.abs(x[k:] - x[:-k]), initial=0.0)) for x in runs) for k in shifts]
        low, high = min(float(x.min()) for x in runs), max(float(x.max()) for x in runs)
        return cls(name, data.channel(name).unit, low, high, tuple(np.maximum.accumulate(travel).tolist()))

    def after(self, value: float, age: int) -> Range:
        """Return the range of a sample that was lost ``age`` samples after, or before, one that is known."""
        if age <= len(self.travel):
            reach = FASTER * self.travel[age - 1]
            return Range(np.asarray(value - reach), np.asarray(value + reach))
        return Range(np.asarray(min(self.lower, value)), np.asarray(max(self.upper, value)))

    def caution(self, samples: Array) -> str | None:
        """Return a warning where samples are outside the range of the training; missing samples are ignored."""
        slack = SLACK * (self.upper - self.lower)
        low, high = float(np.nanmin(samples)), float(np.nanmax(samples))
        if self.lower - slack <= low and high <= self.upper + slack:
            return None
        reached = f"{low:g}" if low == high else f"{low:g} to {high:g}"
        unit = f" {self.unit}" * bool(self.unit)
        return (
            f"{self.name} {reached}{unit}, but the sensor was trained from {self.lower:g} to {self.upper:g}{unit}: "
            "extrapolated"
        )

    def factor(self, unit: str) -> float:
        """Return the number that converts a unit to that of the training; 1 where one of them is not stated.

        Raises
        ------
        DataError
            If the units measure different things, or are not known.
        """
        if not unit or not self.unit:
            return 1.0
        found = conversion(unit, self.unit)
        if found is None:
            raise DataError(
                f"{self.name} is in {unit}, but the sensor was trained on records in {self.unit}: convert the column, "
                "or correct its unit"
            )
        return found

    def unchecked(self, unit: str) -> str | None:
        """Return a warning where a unit is not stated."""
        if bool(unit) == bool(self.unit):
            return None
        where = "the record states" if self.unit else "the records that trained the sensor state"
        return f"{where} no unit of {self.name}: taken to be in {self.unit or unit}"


@dataclass(frozen=True)
class TrainedOn:
    """The channels and the sampling time of the training records.

    Parameters
    ----------
    sampling_time
        In seconds.

    Examples
    --------
    >>> from smid.data.bundled import load_clutch
    >>> told = TrainedOn.of(load_clutch("20C_step_a"), ("pressure",), "position")
    >>> told.sampling_time, told.output.unit, round(told.inputs[0].upper)
    (0.002, 'mm', 36)
    """

    sampling_time: float
    inputs: tuple[Signal, ...]
    output: Signal

    @classmethod
    def of(cls, data: Dataset, inputs: Sequence[str], output: str) -> Self:
        """Return what records say of a sensor's channels."""
        return cls(data.sampling_time, tuple(Signal.of(data, name) for name in inputs), Signal.of(data, output))

    def read(self, data: Dataset) -> tuple[Dataset, tuple[str, ...]]:
        """Return records in the units of the training, and warnings about units that are not stated.

        Raises
        ------
        DataError
            If a unit does not match, or the sampling time is another.
        """
        if not np.isclose(data.sampling_time, self.sampling_time, rtol=1e-6):
            raise DataError(
                f"the records have a sampling time of {data.sampling_time:g} s, those that trained the sensor "
                f"{self.sampling_time:g} s: resample the records"
            )
        present = [signal for signal in (*self.inputs, self.output) if signal.name in data.names]
        factors = {signal.name: signal.factor(data.channel(signal.name).unit) for signal in present}
        warnings = [signal.unchecked(data.channel(signal.name).unit) for signal in present]
        units = {signal.name: signal.unit or data.channel(signal.name).unit for signal in present}
        return converted(data, factors, units), tuple(said for said in warnings if said)

    def cautions(self, samples: Mapping[str, Array]) -> tuple[str, ...]:
        """Return warnings about inputs, in the units of the training, outside the range of the training."""
        said = (signal.caution(samples[signal.name]) for signal in self.inputs)
        return tuple(words for words in said if words)


def converted(data: Dataset, factors: Mapping[str, float], units: Mapping[str, str]) -> Dataset:
    """Return records with channels multiplied by factors, and their new units."""
    if all(factor == 1.0 for factor in factors.values()):
        return data
    return replace(
        data,
        experiments=tuple(
            replace(run, values={name: factors.get(name, 1.0) * x for name, x in run.values.items()})
            for run in data.experiments
        ),
        channels=tuple(Channel(c.name, units.get(c.name, c.unit)) for c in data.channels),
        resampling=(),
    )
