r"""Time stamps: whether they are uniform, and linear resampling to a uniform grid.

With stamps :math:`t_k`, the record is uniform if a straight line :math:`t_0 + k h` meets every stamp to within
:math:`10^{-6} h` plus the rounding of the printed stamps. Otherwise each channel is interpolated linearly.

An interpolated sample is a convex combination of two measured ones, so a noise bound :math:`|\eta| \le D` holds for it
too. The true signal between two samples differs from the chord by up to :math:`|f''| h^2 / 8`. The record holds an
estimate of that error; the user adds it to the noise bound.

Missing samples and missing rows stay missing: nothing is interpolated across an interval longer than 1.75 of the usual.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from smid.data.errors import DataError

RELATIVE_TOLERANCE = 1e-6
# Rounding of the stamps explains at most this share of the interval. Otherwise every record of about one sample per
# second would be uniform if its stamps are integer seconds.
LARGEST_ROUNDING_SHARE = 0.05
# Usual intervals; in a longer one samples are missing. Stamps that are a quarter of an interval early or late are at
# most 1.5 intervals apart, and at least 1.5 where a row is missing between them.
LONGEST = 1.75
MOST_INSTANTS = 10  # instants of the grid for each row


@dataclass(frozen=True)
class Resampling:
    """The time stamps of one experiment, and how they were resampled.

    Parameters
    ----------
    method
        "none" if the stamps were uniform, "linear" if the channels were interpolated.
    mean_interval
        Mean of the original intervals, in seconds.
    jitter_max, jitter_rms
        Largest and RMS deviation of the original intervals from their median, in seconds.
    n_original
        Number of samples before resampling.
    curvature_error
        Per channel, in its unit: estimate ``max |second difference| / 8`` of the error that linear interpolation adds
        to a sample. It contains the noise of the samples (up to D / 2), so it is rather too large.

    Examples
    --------
    >>> Resampling("linear", 0.1, 0.02, 0.01, 500, {"pressure": 0.003}).method
    'linear'
    """

    method: Literal["none", "linear"]
    mean_interval: float
    jitter_max: float
    jitter_rms: float
    n_original: int
    curvature_error: Mapping[str, float] = field(default_factory=dict, hash=False)

    def __str__(self) -> str:
        done = "uniform time stamps" if self.method == "none" else "resampled linearly"
        text = (
            f"{done}: {self.n_original} samples, mean interval {self.mean_interval:.6g} s, "
            f"jitter {self.jitter_max:.3g} s max, {self.jitter_rms:.3g} s rms"
        )
        errors = ", ".join(f"{name} {error:.3g}" for name, error in self.curvature_error.items())
        return f"{text}; estimated interpolation error: {errors}" if errors else text

    def to_dict(self) -> dict[str, Any]:
        """Return plain numbers and strings; `Resampling(**record.to_dict())` is the same record."""
        return {**vars(self), "curvature_error": dict(self.curvature_error)}


def _instants(stamps: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the number of each stamp on a grid of the usual interval, from 0; missing rows leave numbers out."""
    steps = np.diff(stamps)
    return np.concatenate([[0.0], np.cumsum(np.rint(steps / np.median(steps)))])


def _fits(stamps: NDArray[np.float64], instants: NDArray[np.float64], interval: float, resolution: float) -> bool:
    """Tell whether a uniform grid of this interval meets every stamp to within tolerance and rounding."""
    deviation = stamps - interval * instants
    # The first stamp is rounded too, so the grid may be shifted, which leaves half the spread.
    half_spread = 0.5 * float(np.max(deviation) - np.min(deviation))
    rounding = resolution + 4 * np.finfo(np.float64).eps * float(np.max(np.abs(stamps)))
    return half_spread <= RELATIVE_TOLERANCE * interval + min(rounding, LARGEST_ROUNDING_SHARE * interval)


def uniform_interval(stamps: NDArray[np.float64], resolution: float = 0.0) -> float | None:
    """Return the shortest decimal number that fits uniform stamps, in seconds; None if they are not uniform.

    Rows may be missing. ``resolution`` is the unit of the last printed digit of the stamps, in seconds.

    Examples
    --------
    >>> import numpy as np
    >>> uniform_interval(np.array([0.0, 0.1, 0.2, 0.30000000000000004, 0.6]))
    0.1
    """
    instants = _instants(stamps)
    centred = instants - np.mean(instants)
    slope = float(centred @ (stamps - np.mean(stamps)) / (centred @ centred))
    if (np.diff(instants) < 1).any() or not _fits(stamps, instants, slope, resolution):
        return None
    for digits in range(1, 16):
        shortest = float(f"{slope:.{digits}g}")
        if _fits(stamps, instants, shortest, resolution):
            return shortest
    return slope


def check_increasing(stamps: NDArray[np.float64], origin: str) -> None:
    """Refuse stamps that are too few, not finite, unsorted or repeated; DataError names the first bad row from 1."""
    if stamps.size < 2:
        raise DataError(f"{origin}: {stamps.size} time stamps define no interval; give at least two rows")
    bad = np.flatnonzero(~np.isfinite(stamps))
    if bad.size:
        raise DataError(f"{origin}: the time stamp of row {bad[0] + 1} is not finite; correct or drop the row")
    steps = np.diff(stamps)
    backward = np.flatnonzero(steps <= 0)
    if backward.size:
        row = int(backward[0]) + 2
        if steps[row - 2] == 0:
            raise DataError(
                f"{origin}: row {row} repeats the time stamp {stamps[row - 1]:.12g} s of row {row - 1}; "
                "keep one row per time stamp"
            )
        raise DataError(
            f"{origin}: the time stamp of row {row} ({stamps[row - 1]:.12g} s) lies before that "
            f"of row {row - 1} ({stamps[row - 2]:.12g} s); sort the rows by time, "
            "or load the parts as separate experiments"
        )


def _curvature_error(stamps: NDArray[np.float64], values: NDArray[np.float64], longest: float) -> float:
    steps = np.diff(stamps)
    widest = np.maximum(steps[1:], steps[:-1])
    second_derivative = 2.0 * np.diff(np.diff(values) / steps) / (stamps[2:] - stamps[:-2])
    errors = np.abs(second_derivative) * widest**2 / 8.0
    known = errors[np.isfinite(errors) & (widest <= longest)]
    return float(np.max(known, initial=0.0))


def resample(
    stamps: NDArray[np.float64],
    values: Mapping[str, NDArray[np.float64]],
    sampling_time: float,
    resolution: float = 0.0,
) -> tuple[dict[str, NDArray[np.float64]], Resampling]:
    """Return channels on a uniform grid from the first stamp on, and the record of it.

    The samples stay as they are if the stamps already lie on the grid. A missing sample is NaN, also where no row is
    near. All times are in seconds; ``resolution`` is the
    unit of the last printed digit of the stamps.

    Examples
    --------
    >>> import numpy as np
    >>> values, record = resample(np.array([0.0, 1.0, 2.0, 4.0]), {"y": np.array([0.0, 2, 4, 8])}, 1.0)
    >>> values["y"], record.method
    (array([ 0.,  2.,  4., nan,  8.]), 'none')
    """
    steps = np.diff(stamps)
    usual = float(np.median(steps))
    longest = LONGEST * max(usual, sampling_time)
    jitter = (steps - usual)[steps <= LONGEST * usual]
    instants = _instants(stamps)
    uniform = _fits(stamps, instants, sampling_time, resolution)
    record = Resampling(
        method="none" if uniform else "linear",
        mean_interval=float(np.mean(steps)),
        jitter_max=float(np.max(np.abs(jitter))),
        jitter_rms=float(np.sqrt(np.mean(jitter**2))),
        n_original=stamps.size,
        curvature_error={}
        if uniform
        else {name: _curvature_error(stamps, array, longest) for name, array in values.items()},
    )
    # A last stamp that misses its instant by rounding must still give a sample; np.interp holds the end value.
    n_intervals = int(np.floor((stamps[-1] - stamps[0]) / sampling_time + RELATIVE_TOLERANCE))
    n_intervals = int(instants[-1]) if uniform else n_intervals
    if n_intervals < 1:
        raise DataError(
            f"sampling_time = {sampling_time:g} s is longer than the record ({stamps[-1] - stamps[0]:g} s); "
            "check the units of time and sampling_time (both are taken in seconds)"
        )
    if n_intervals > MOST_INSTANTS * (stamps.size + 100):
        raise DataError(
            f"{stamps.size} rows over {stamps[-1] - stamps[0]:g} s are few for a sampling time of {sampling_time:g} s; "
            f"check the units of time and sampling_time, or save the parts beside the longest gap "
            f"({np.max(steps):g} s) as files of their own"
        )
    if uniform:
        if instants.size == n_intervals + 1:
            return dict(values), record
        return {name: _placed(array, instants.astype(np.int64)) for name, array in values.items()}, record
    grid = stamps[0] + sampling_time * np.arange(n_intervals + 1)
    before = np.clip(np.searchsorted(stamps, grid, side="right") - 1, 0, stamps.size - 2)
    slack = RELATIVE_TOLERANCE * sampling_time
    on_stamp = np.minimum(np.abs(grid - stamps[before]), np.abs(grid - stamps[before + 1])) <= slack
    lost = (steps[before] > longest) & ~on_stamp
    return {name: np.where(lost, np.nan, _interpolated(grid, stamps, array)) for name, array in values.items()}, record


def _placed(array: NDArray[np.float64], instants: NDArray[np.int64]) -> NDArray[np.float64]:
    """Return samples at their instants, and NaN where there is no row."""
    whole = np.full(int(instants[-1]) + 1, np.nan)
    whole[instants] = array
    return whole


def _interpolated(
    grid: NDArray[np.float64], stamps: NDArray[np.float64], array: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Interpolate linearly; a value is NaN if a missing sample has a share in it."""
    missing = np.isnan(array)
    share = np.interp(grid, stamps, missing.astype(np.float64))
    return np.where(share > RELATIVE_TOLERANCE, np.nan, np.interp(grid, stamps, np.where(missing, 0.0, array)))
