"""A sensor that runs with the plant, sample by sample."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from relaxations.algebra.arrays import Array
from smid.data import DataError

if TYPE_CHECKING:
    from smid.sensors.sensor import Run

__all__ = ["Estimate", "Stream"]


@dataclass(frozen=True)
class Estimate:
    """The position at one instant: time in seconds, position in mm, and limits of the answer."""

    time: float
    position: float
    warnings: tuple[str, ...] = ()


class Stream:
    """A sensor that takes one sample after the other.

    Parameters
    ----------
    run
        The sensor at rest.
    channels
        Channels that it needs.
    sampling_time
        In seconds.
    cautions
        Returns warnings about samples.

    Examples
    --------
    >>> from smid.data.bundled import load_clutch
    >>> from smid.sensors import PX
    >>> sensor = PX(hidden=(3,)).fit(load_clutch("20C_ramp_a"), seed=1, starts=1)
    >>> stream = sensor.stream()
    >>> stream.update(0.0, pressure=0.0).time
    0.0
    """

    def __init__(
        self,
        run: Run,
        channels: tuple[str, ...],
        sampling_time: float,
        cautions: Callable[[Mapping[str, Array]], tuple[str, ...]],
    ) -> None:
        self._run, self._channels, self._interval, self._cautions = run, channels, sampling_time, cautions
        self._last: float | None = None

    def update(self, time: float, **samples: float) -> Estimate:
        """Take the samples of an instant and return the position.

        Parameters
        ----------
        time
            In seconds: one sampling time after the last, within half a sampling time.
        **samples
            By channel: current in mA, pressure in bar, temperature in degC; other channels are ignored.

        Raises
        ------
        DataError
            If a channel is missing, a sample is not finite, or the time is not the next one. The state stays the same.
        """
        for channel in self._channels:
            if channel not in samples:
                raise DataError(f"no sample of {channel!r} at {time:g} s: give {', '.join(self._channels)}")
            if not np.isfinite(samples[channel]):
                raise DataError(
                    f"{channel} = {samples[channel]} at {time:g} s is not finite: give the last good sample, "
                    "or begin another stream"
                )
        self._check_time(time)
        block = {channel: np.array([samples[channel]], dtype=np.float64) for channel in self._channels}
        self._last = time
        return Estimate(time, float(self._run.advance(block)[0]), self._cautions(block))

    def _check_time(self, time: float) -> None:
        if not np.isfinite(time):
            raise DataError(f"time = {time} s is not a finite time: give the seconds of the sample")
        if self._last is None:
            return
        step = time - self._last
        if step <= 0:
            raise DataError(
                f"the sample of {time:g} s came after that of {self._last:g} s: "
                "give samples in the order of time, once each"
            )
        if abs(step - self._interval) > 0.5 * self._interval:
            raise DataError(
                f"{step:g} s between the samples of {self._last:g} s and {time:g} s, but the sensor was trained at "
                f"{self._interval:g} s: give every sample, or begin another stream"
            )
