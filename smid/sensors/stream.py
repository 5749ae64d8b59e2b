"""A sensor that runs with the plant, sample by sample, also where samples are lost.

A lost sample lies within a range: in the training records no sample of this channel has changed faster, and none
between two known ones was farther from the line between them. The program propagates ranges from there on
(`smid.sensors.ranges`), so that the interval contains what the sensor would have said with the sample. When the next
sample comes, the lost one is known better, and the instants since the last complete one are run again. The interval is
as narrow as before once the memory no longer depends on the lost sample: a lag forgets, a play has been pushed through
its slack.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, replace
from hashlib import sha256
from itertools import takewhile
from typing import Any

import numpy as np

from smid.data import DataError
from smid.data.channel import name_hint
from smid.display.result import plain
from smid.sensors.program import Memory, Program, exact, is_known
from smid.sensors.ranges import Range
from smid.sensors.trained_on import LOST, TrainedOn, on_line

__all__ = ["Estimate", "Stream"]

STATE = "smid.sensor-state/1"
LATE = 0.35  # of the sampling time: a sample this far from its instant is no better than a lost one
DRIFT = 0.1  # share of a deviation by which the next instants move
LONGEST = 1000  # instants that are bridged; then the sensor begins again


@dataclass(frozen=True)
class Estimate:
    """The output at one instant.

    Parameters
    ----------
    time
        In seconds.
    position
        In the unit of the training records. Where a sample was lost, the last one was held.
    lower, upper
        With an error bound, of the measured output. Without one, of what the sensor says: both are the position unless
        a sample was lost.
    bridged
        Whether a lost sample still widens the interval.
    warnings
        Limits of the answer.
    """

    time: float
    position: float
    lower: float
    upper: float
    bridged: bool = False
    warnings: tuple[str, ...] = ()


Entry = Mapping[str, float | None]
"""The samples of an instant by channel; None for one that was lost or late."""


@dataclass(frozen=True, eq=False)
class _State:
    """What a stream knows after a sample.

    ``instant`` is the time at which the last sample was due. ``held`` has the last known sample of each channel and how
    many instants ago it was, ``memory`` that of the program, and ``ranges`` its ranges where it is not known: before
    the instants of the window, some of which were lost.
    """

    time: float
    instant: float
    held: Mapping[str, tuple[float, int]]
    memory: Memory | None
    ranges: Mapping[str, Range] | None
    window: tuple[Entry, ...] = ()


class Stream:
    """A sensor that takes one sample after the other.

    Parameters
    ----------
    told
        The channels and the sampling time.
    units
        Of the samples by channel; by default those of the training.
    state
        As the property `state` of another stream; None for a plant at rest at the first sample.

    Examples
    --------
    >>> from smid.data.bundled import load_clutch
    >>> from smid.sensors import PX
    >>> sensor = PX(hidden=(3,)).fit(load_clutch("20C_ramp_a"), seed=1, starts=1)
    >>> stream = sensor.stream()
    >>> now = stream.update(0.0, pressure=5.0)
    >>> now.lower == now.position
    True
    >>> lost = stream.update(0.002, pressure=None)
    >>> lost.lower < now.position < lost.upper, lost.warnings
    (True, ('pressure is lost at 0.002 s: bridged',))
    """

    def __init__(
        self, program: Program, told: TrainedOn, units: Mapping[str, str], state: Mapping[str, Any] | None = None
    ) -> None:
        program.require_causal()
        self._program, self._told = program, told
        self._signals = {signal.name: signal for signal in told.inputs}
        for name in units:
            if name not in self._signals:
                raise DataError(
                    f"a unit is given for {name!r}, which is no channel of it; {name_hint(name, self._signals)}"
                )
        self._factors = {name: signal.factor(units.get(name, signal.unit)) for name, signal in self._signals.items()}
        self._state = None if state is None else self._restored(state)
        self._runs = list[_Run]()  # of the window of the state

    def update(self, time: float, **samples: float | None) -> Estimate:
        """Take the samples of an instant and return the output.

        Parameters
        ----------
        time
            In seconds. Where instants were skipped since the last sample, they are bridged.
        **samples
            By channel; None or NaN for a sample that was lost. Other channels are ignored.

        Raises
        ------
        DataError
            If a channel is not named, a sample is infinite, the first sample is lost, the time does not come after the
            last, or more than 1000 instants were skipped. The state stays the same.
        """
        given = {name: self._sample(name, time, samples) for name in self._signals}
        lost = [name for name, value in given.items() if value is None]
        if self._state is None:
            if not np.isfinite(time):
                raise DataError(f"time = {time} s is not a finite time: give the seconds of the sample")
            if lost:
                raise DataError(f"{lost[0]} is lost in the first sample: begin with a complete one")
            instants, late = 1, 0.0
        else:
            instants, late = self._instants(time, self._state)
        said = [f"{name} is lost at {time:g} s: bridged" for name in lost]
        if instants > 1:
            said.append(f"{instants - 1} samples are lost before {time:g} s: bridged")
        off = abs(late) > LATE * self._told.sampling_time
        if off:
            said.append(f"the sample of {time:g} s is {1e3 * abs(late):.3g} ms {'late' if late > 0 else 'early'}")
        # The instants that were skipped, then this one; a late sample is no better than a lost one.
        nothing: Entry = dict.fromkeys(self._signals)
        before = self._state or _State(time, time - self._told.sampling_time, {}, None, None)
        window = (*before.window, *[nothing] * (instants - 1), nothing if off else given)
        # The clock of the samples may drift and jitter: follow it slowly.
        instant = before.instant + instants * self._told.sampling_time + DRIFT * late
        self._state, estimate = self._replayed(replace(before, time=time, instant=instant, window=window))
        known = (signal.caution(np.array([given[name]])) for name, signal in self._signals.items() if name not in lost)
        return replace(estimate, warnings=(*said, *(words for words in known if words)))

    @property
    def state(self) -> dict[str, Any]:
        """What the sensor remembers, as plain data for JSON; `VirtualSensor.stream` takes it.

        Raises
        ------
        DataError
            If there is no sample yet.
        """
        if self._state is None:
            raise DataError("the stream has no state before its first sample: update it first")
        state, ranges = self._state, self._state.ranges
        return {
            "schema": STATE,
            "sensor": self._digest,
            "time": state.time,
            "instant": state.instant,
            "held": {name: list(pair) for name, pair in state.held.items()},
            "memory": {name: values.tolist() for name, values in (state.memory or {}).items()},
            "ranges": ranges and {name: [r.lower.tolist(), r.upper.tolist()] for name, r in ranges.items()},
            "window": [dict(entry) for entry in state.window],
        }

    @property
    def _digest(self) -> str:
        return sha256(json.dumps(plain([self._program, self._told])).encode()).hexdigest()

    def _restored(self, state: Mapping[str, Any]) -> _State:
        if state.get("schema") != STATE or state.get("sensor") != self._digest:
            raise DataError(
                "this is no state of this sensor: give that of a stream of the same sensor, or begin another stream"
            )
        try:
            ranges = state["ranges"]
            return _State(
                state["time"],
                state["instant"],
                {name: (value, age) for name, (value, age) in state["held"].items()},
                {name: np.array(values) for name, values in state["memory"].items()},
                ranges and {name: Range(np.array(low), np.array(high)) for name, (low, high) in ranges.items()},
                tuple(state["window"]),
            )
        except (KeyError, TypeError, ValueError, AttributeError):
            raise DataError("the state is damaged: save it again, or begin another stream") from None

    def _sample(self, name: str, time: float, samples: Mapping[str, float | None]) -> float | None:
        """Return a sample in the unit of the training; None where it is lost."""
        if name not in samples:
            raise DataError(
                f"no sample of {name!r} at {time:g} s: give {', '.join(self._signals)}, and None for a lost sample"
            )
        value = samples[name]
        if value is None or np.isnan(value):
            return None
        if not np.isfinite(value):
            raise DataError(f"{name} = {value} at {time:g} s is not finite: give None where the sample is lost")
        return self._factors[name] * float(value)

    def _instants(self, time: float, before: _State) -> tuple[int, float]:
        """Return how many sampling times have passed, and by how many seconds the sample is late."""
        interval = self._told.sampling_time
        if not np.isfinite(time):
            raise DataError(f"time = {time} s is not a finite time: give the seconds of the sample")
        if time <= before.time:
            raise DataError(
                f"the sample of {time:g} s came after that of {before.time:g} s: give samples in the order of time, "
                "once each"
            )
        count = round((time - before.instant) / interval)
        if count < 1:
            raise DataError(
                f"{1e3 * (time - before.time):.3g} ms between the samples of {before.time:g} s and {time:g} s, but the "
                f"sensor was trained at {interval:g} s: give one sample for each sampling time"
            )
        if count > LONGEST + 1:
            raise DataError(
                f"{count - 1} samples are lost between {before.time:g} s and {time:g} s, and at most {LONGEST} are "
                "bridged: begin another stream"
            )
        return count, time - before.instant - count * interval

    def _replayed(self, state: _State) -> tuple[_State, Estimate]:
        """Return the state and the estimate at the end of the window, which is run again from its beginning.

        A sample that was lost is known better once there is a later one.
        """
        inputs = [
            {name: self._input(name, state, place) for name in self._signals} for place in range(len(state.window))
        ]
        # While a gap lasts, no more is known of its first instants: run from where the inputs have changed.
        runs = [run for run, _ in takewhile(_same, zip(self._runs, inputs, strict=False))]
        for one in inputs[len(runs) :]:
            before = replace(runs[-1].after, time=state.time) if runs else state
            after, estimate = self._advance(before, one)
            runs.append(_Run(one, after))
        # Begin the window after the last complete instant, and not too long ago.
        lost = max((k for k, entry in enumerate(state.window, 1) if None in entry.values()), default=0)
        complete = len(state.window) if lost < len(state.window) else 0
        begin = max(complete, len(state.window) - LOST)
        self._runs = runs[begin:]
        known = runs[begin - 1].after if begin else state
        return replace(known, time=state.time, instant=state.instant, window=state.window[begin:]), estimate

    def _input(self, name: str, state: _State, place: int) -> _Input:
        """Return a channel at an instant of the window."""
        signal = self._signals[name]
        entries = [entry[name] for entry in state.window]
        now = entries[place]
        if now is not None:
            return _Input((now, 0), now, Range.exact(now))
        earlier = [(value, place - k) for k, value in enumerate(entries[:place]) if value is not None]
        later = [(value, k) for k, value in enumerate(entries[place + 1 :], 1) if value is not None]
        value, age = earlier[-1] if earlier else (state.held[name][0], state.held[name][1] + place + 1)
        if not later:
            return _Input((value, age), value, signal.after(value, age))
        after, left = later[0]
        return _Input((value, age), on_line(value, after, age, left), signal.between(value, after, age, left))

    def _advance(self, state: _State, inputs: Mapping[str, _Input]) -> tuple[_State, Estimate]:
        """Return the state and the estimate after one instant."""
        program, half_width = self._program, self._program.half_width
        signals, memory = program.advance({n: np.array([one.value]) for n, one in inputs.items()}, state.memory)
        position = float(signals[program.output][0])
        half = 0.0 if half_width is None else float(signals[half_width][0])
        lower, upper, ranges = position - half, position + half, state.ranges
        boxes = {name: one.range for name, one in inputs.items()}
        if ranges is None and any(box.width > 0 for box in boxes.values()):
            assert state.memory is not None  # the first sample is complete
            ranges = exact(state.memory)
        if ranges is not None:
            found, ranges = program.enclose(boxes, ranges)
            half = 0.0 if half_width is None else float(found[half_width].upper)
            lower = min(lower, float(found[program.output].lower) - half)
            upper = max(upper, float(found[program.output].upper) + half)
        bridged = ranges is not None
        after = None if ranges is None or is_known(ranges) else ranges
        held = {name: one.held for name, one in inputs.items()}
        return replace(state, held=held, memory=memory, ranges=after), Estimate(
            state.time, position, lower, upper, bridged
        )


@dataclass(frozen=True, eq=False)
class _Input:
    """A channel at one instant: the last known sample and its age, the value that is used, and its range."""

    held: tuple[float, int]
    value: float
    range: Range

    @property
    def numbers(self) -> tuple[object, ...]:
        return self.held, self.value, self.range.lower.tolist(), self.range.upper.tolist()


@dataclass(frozen=True, eq=False)
class _Run:
    """An instant of the window: its inputs, and the state after it."""

    inputs: Mapping[str, _Input]
    after: _State


def _same(pair: tuple[_Run, Mapping[str, _Input]]) -> bool:
    run, inputs = pair
    return all(run.inputs[name].numbers == one.numbers for name, one in inputs.items())
