"""What a sensor keeps of the records that trained it: names, units, ranges and rates of the channels.

Units travel with the sensor. Records in another unit of the same kind are converted, others are refused.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Self, TypeVar

import numpy as np
from scipy import sparse

from relaxations.algebra.arrays import Array
from relaxations.points.linear_program import minimum
from smid.data import DataError, Dataset
from smid.data.units import factor_to, in_units
from smid.sensors.ranges import Range

__all__ = ["Signal", "TrainedOn", "on_line"]

T = TypeVar("T", float, Array)

LOST = 20  # lost samples in a row that are bounded by what the training records say of as many
FASTER = 1.1  # a lost sample may have changed by this factor more than any in the training records
BINS = 200
SLACK = 0.05  # of the range: how far beyond it a sample is no extrapolation
_TRAINED = "the sensor was trained on records"


@dataclass(frozen=True)
class Signal:
    """A channel of the training records.

    Parameters
    ----------
    lower, upper
        Range of its samples.
    travel
        Largest change over 1, 2, ... samples.
    bend
        Pairs (a, b): 1, 2, ... samples between two others lie within ``a + b |difference of these two|`` of the line
        between them.

    Examples
    --------
    >>> pressure = Signal("pressure", "bar", 0.0, 30.0, (2.0, 3.5), ((0.1, 0.5),))
    >>> near, between = pressure.after(10.0, 1), pressure.between(10.0, 11.0, 1, 1)
    >>> near.width.round(3), between.width.round(3)
    (np.float64(4.4), np.float64(1.32))
    """

    name: str
    unit: str
    lower: float
    upper: float
    travel: tuple[float, ...]
    bend: tuple[tuple[float, float], ...]

    @classmethod
    def of(cls, data: Dataset, name: str) -> Self:
        """Return what records say of a channel."""
        runs = [run.values[name] for run in data.experiments]
        longest = max(run.size for run in runs)
        shifts = range(1, 1 + min(LOST, longest - 1))
        travel = [max(float(np.max(np.abs(x[k:] - x[:-k]), initial=0.0)) for x in runs) for k in shifts]
        low, high = min(float(x.min()) for x in runs), max(float(x.max()) for x in runs)
        bend = tuple(_bend(runs, lost) for lost in range(1, 1 + min(LOST, longest - 2)))
        return cls(name, data.channel(name).unit, low, high, tuple(np.maximum.accumulate(travel).tolist()), bend)

    def after(self, value: float, age: int) -> Range:
        """Return the range of a sample that was lost ``age`` samples after, or before, one that is known."""
        slack = SLACK * (self.upper - self.lower)
        whole = Range(np.asarray(min(self.lower - slack, value)), np.asarray(max(self.upper + slack, value)))
        if age > len(self.travel):
            return whole
        reach = FASTER * self.travel[age - 1]
        return Range(np.asarray(value - reach), np.asarray(value + reach)).meet(whole)

    def between(self, before: float, after: float, age: int, left: int) -> Range:
        """Return the range of a sample that was lost ``age`` samples after one, and ``left`` before another."""
        found = self.after(before, age).meet(self.after(after, left))
        if age + left - 1 > len(self.bend):
            return found
        constant, slope = self.bend[age + left - 2]
        line, reach = on_line(before, after, age, left), FASTER * (constant + slope * abs(after - before))
        return found.meet(Range(np.asarray(line - reach), np.asarray(line + reach)))

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
        return factor_to(self.unit, unit, self.name, _TRAINED)

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
        warnings = [signal.unchecked(data.channel(signal.name).unit) for signal in present]
        read = in_units(data, {signal.name: signal.unit for signal in present}, _TRAINED)
        return read, tuple(said for said in warnings if said)

    def cautions(self, samples: Mapping[str, Array]) -> tuple[str, ...]:
        """Return warnings about inputs, in the units of the training, outside the range of the training."""
        said = (signal.caution(samples[signal.name]) for signal in self.inputs)
        return tuple(words for words in said if words)


def on_line(before: T, after: T, age: int, left: int) -> T:
    """Return the value on the line between two samples."""
    return before + (after - before) * age / (age + left)


def _bend(runs: Sequence[Array], lost: int) -> tuple[float, float]:
    """Return the a and b of `Signal.bend` with the least mean of ``a + b |difference|`` that hold in all records."""
    spans, bends = [np.zeros(1)], [np.zeros(1)]
    for x in runs:
        if x.size > lost + 1:
            first, last = x[: -lost - 1], x[lost + 1 :]
            inside = [x[j : j - lost - 1] - on_line(first, last, j, lost + 1 - j) for j in range(1, lost + 1)]
            spans.append(np.abs(last - first))
            bends.append(np.abs(inside).max(axis=0))
    span, bend = np.concatenate(spans), np.concatenate(bends)
    # Of each bin the largest bend at the least span: b is not negative, so this holds for the whole bin.
    bins = np.minimum(BINS * (span / (span.max() or 1.0)), BINS - 1).astype(int)
    worst, least = np.zeros(BINS), np.full(BINS, np.inf)
    np.maximum.at(worst, bins, bend)
    np.minimum.at(least, bins, span)
    used = np.isfinite(least)
    rows = np.stack([np.ones(int(used.sum())), least[used]], axis=1)
    above = np.full(len(rows), np.inf)
    box = np.zeros(2), np.full(2, np.inf)
    found = minimum(np.array([1.0, span.mean()]), sparse.csr_array(rows), (worst[used], above), box, np.inf)
    assert isinstance(found, np.ndarray)  # a large enough a satisfies every row
    # The solver meets its constraints within a tolerance: raise a by the largest excess.
    return float(found[0] + max(0.0, float(np.max(worst[used] - rows @ found)))), float(found[1])
