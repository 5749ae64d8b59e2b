"""Dead zones between measured channels: up to which input the output stays at rest, with certified thresholds.

    y = rest + slope max(0, u - threshold) + e,    |e| <= noise bound

1. The record is cut into blocks, and each becomes a point, the means of input and output. Left out are blocks after a
   jump of the input, where the output lags behind, and blocks in which the input is lower than it has been since it was
   last at its least, where the output is on another branch of a hysteresis.
2. Only points near the rest are kept, where the curve beyond the threshold is close to a straight line. In each bin
   of the input, the points of the least and the largest output count: they decide which lines fit.
3. The intervals of rest and threshold are those of the kinked model (`smid.identification.piecewise`).

No threshold outside its interval fits the points within the noise bound. By default this is 1.2 times the least one,
which is computed by linear programs over a grid of thresholds. It must contain the noise of the output, that of the
input times the slope, what is left of the lag, and the deviation of the curve from the line. Where the output
rises from rest very gradually, the threshold is where the line leaves it.

Reference: clutch thesis, section 5.1 (three dead zones, without their thresholds).
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linprog

from relaxations.algebra.arrays import Array
from relaxations.deadline import Progress
from smid.data import Channel, DataError, Dataset
from smid.display.result import Part, Tabular
from smid.display.table import Table
from smid.identification.identify import EmptyFeasibleSetError, identify
from smid.models import ModelError, OwnModel

__all__ = ["DeadZoneThreshold", "DeadZones", "dead_zones"]

BLOCK = 5  # samples of a point
JUMP = 0.02  # of the range of the input: a block after a larger change is left out
NEAR = 0.05  # of the range of the output: points farther from rest are left out
BINS = 20  # of the input, each with the points of its least and its largest output
GRID = 120
FACTOR = 1.2


@dataclass(frozen=True)
class DeadZoneThreshold:
    """The dead zone between two channels.

    Parameters
    ----------
    threshold, rest
        Certified intervals, in the units of input and output.
    noise_bound
        Largest deviation of a point from the line, in the unit of the output, for which the intervals hold.
    begin
        Least input of the points.
    points
        Number of points.

    Examples
    --------
    >>> zone = DeadZoneThreshold(Channel("P", "bar"), Channel("x", "mm"), (3.1, 3.4), (0.0, 0.1), 0.1, 0.0, 80)
    >>> zone.proven
    True
    """

    input: Channel
    output: Channel
    threshold: tuple[float, float]
    rest: tuple[float, float]
    noise_bound: float
    begin: float
    points: int

    @property
    def proven(self) -> bool:
        """Whether every threshold that fits lies above the least input: there is a dead zone."""
        return self.threshold[0] > self.begin


@dataclass(frozen=True, eq=False, repr=False)
class DeadZones(Tabular):
    """The dead zones between several pairs of channels."""

    zones: tuple[DeadZoneThreshold, ...]

    def _content(self) -> Iterator[Part]:
        rows = tuple(
            (
                str(zone.input),
                str(zone.output),
                f"{zone.threshold[0]:.4g}",
                f"{zone.threshold[1]:.4g}",
                f"{zone.noise_bound:.3g}",
                str(zone.points),
                "proven" if zone.proven else "not proven",
            )
            for zone in self.zones
        )
        header = ("input", "output", "threshold from", "to", "noise bound", "points", "dead zone")
        caption = "Dead zones: the output is at rest up to a threshold of the input, which is certified to lie in:"
        yield Table(caption, header, rows, "llrrrrl")

    def _rows(self) -> Iterator[dict[str, Any]]:
        for zone in self.zones:
            yield {
                "input": zone.input.name,
                "output": zone.output.name,
                "threshold_lower": zone.threshold[0],
                "threshold_upper": zone.threshold[1],
                "rest_lower": zone.rest[0],
                "rest_upper": zone.rest[1],
                "noise_bound": zone.noise_bound,
                "points": zone.points,
                "proven": zone.proven,
            }

    def to_dict(self) -> dict[str, Any]:
        """Return the rows as plain data."""
        return {"zones": list(self._rows())}


def dead_zones(
    data: Dataset,
    pairs: Sequence[tuple[str, str]],
    *,
    noise_bounds: Sequence[float | None] | None = None,
    progress: Progress | None = None,
) -> DeadZones:
    """Return the certified thresholds of dead zones, for inputs that rise from rest.

    Parameters
    ----------
    pairs
        Input and output of each dead zone.
    noise_bounds
        For each pair, in the unit of the output; None for 1.2 times the least one.

    Raises
    ------
    DataError
        If a channel is missing or does not vary, or there are fewer than ten slow points near the rest.
    ModelError
        If a noise bound is not positive, or so small that no dead zone fits.

    Examples
    --------
    >>> u = np.linspace(0.0, 6.0, 300)
    >>> y = np.maximum(0.0, u - 2.5) + 0.02 * np.cos(np.arange(300.0))
    >>> data = Dataset.from_arrays(input={"u": u}, output={"y": y}, sampling_time=0.1)
    >>> zone = dead_zones(data, [("u", "y")]).zones[0]
    >>> zone.proven, zone.threshold[0] < 2.5 < zone.threshold[1]
    (True, True)
    """
    bounds = [None] * len(pairs) if noise_bounds is None else list(noise_bounds)
    if len(bounds) != len(pairs):
        raise ModelError(f"{len(bounds)} noise bounds for {len(pairs)} pairs: give one for each, or None")
    if any(bound is not None and not bound > 0 for bound in bounds):
        raise ModelError("a noise bound is not positive: give it in the unit of the output, or leave it out")
    chosen = [_points(data, *pair) for pair in pairs]  # refuse all bad channels before the first solve
    zones = []
    for pair, (u, y), bound in zip(pairs, chosen, bounds, strict=True):
        if progress is not None:
            progress(f"dead zone from {pair[0]} to {pair[1]}")
        zones.append(_zone(data.channel(pair[0]), data.channel(pair[1]), u, y, bound))
    return DeadZones(tuple(zones))


def _points(data: Dataset, input: str, output: str) -> tuple[Array, Array]:
    """Return the points near the rest, sorted by the input."""
    spans = []
    for name in (input, output):
        samples = data.stacked(name)
        spans.append(float(np.nanmax(samples) - np.nanmin(samples)))
        if not spans[-1] > 0:
            raise DataError(f"{data.channel(name)} does not vary: give a record that leaves the dead zone")
    found = []
    for run in data.experiments:
        count = run.n_samples // BLOCK
        u, y = (run.values[n][: count * BLOCK].reshape(count, BLOCK).mean(axis=1) for n in (input, output))
        slow = (np.diff(u, prepend=u[:1]) <= JUMP * spans[0]) & _rising(u, JUMP * spans[0]) & np.isfinite(u + y)
        found.append(np.stack([u[slow], y[slow]]))
    u, y = np.concatenate(found, axis=1)
    # The rest is where the input is least.
    lowest = u <= np.quantile(u, 0.05) if u.size else np.zeros(0, dtype=bool)
    near = np.abs(y - np.median(y[lowest])) <= NEAR * spans[1] if u.size else lowest
    u, y = u[near], y[near]
    if u.size < 10 or not np.ptp(u) > 0:
        raise DataError(
            f"{u.size} slow points of {input} and {output} near the rest, and a dead zone needs 10: give a record with "
            "slow ramps out of the rest"
        )
    # In each bin of the input the points of the least and the largest output: they decide which lines fit.
    bins = np.minimum((BINS * ((u - u.min()) / np.ptp(u))).astype(int), BINS - 1)
    ends = [f(np.flatnonzero(bins == k), key=y.__getitem__) for k in np.unique(bins) for f in (min, max)]
    order = np.unique(ends)
    order = order[np.argsort(u[order], kind="stable")]
    return u[order], y[order]


def _rising(u: Array, tolerance: float) -> NDArray[np.bool_]:
    """Return where an input is about as high as it has been since it was last at its least."""
    peak, found = math.inf, []
    least = float(np.nanmin(u)) + tolerance
    for value in u.tolist():
        peak = value if value <= least else max(peak, value)
        found.append(value >= peak - tolerance)
    return np.array(found)


def _zone(input: Channel, output: Channel, u: Array, y: Array, bound: float | None) -> DeadZoneThreshold:
    """Return the certified dead zone of points, which are scaled so that units do not matter."""
    low, scale_u, centre, scale_y = float(u[0]), float(np.ptp(u)), float(np.median(y)), float(np.ptp(y)) or 1.0
    sign = 1.0 if y[-1] >= y[0] else -1.0
    v, z = (u - low) / scale_u, sign * (y - centre) / scale_y
    least = _least_bound(v, z)
    used = FACTOR * max(least, 1e-6) if bound is None else bound / scale_y
    model = OwnModel(
        ["x[t] = rest + slope*Max(0, v[t] - threshold)"],
        {"z": "x"},
        ["v"],
        {"rest": (-2.0, 2.0), "slope": (0.0, 100.0), "threshold": (0.0, 1.0)},
    )
    points = Dataset.from_arrays(input={"v": v}, output={"z": z}, sampling_time=1.0)
    try:
        found = identify(model, points, noise_bound=used)
    except EmptyFeasibleSetError:
        raise ModelError(
            f"no dead zone from {input.name} to {output.name} fits within {used * scale_y:g} {output.unit}".rstrip()
            + f" (proven): give a noise bound of {FACTOR * least * scale_y:.3g} or more"
        ) from None
    ends = {name: (found[name].lower, found[name].upper) for name in ("threshold", "rest")}
    rest = sorted(centre + sign * scale_y * end for end in ends["rest"])
    threshold = [low + scale_u * end for end in ends["threshold"]]
    return DeadZoneThreshold(
        input, output, _outwards(*threshold), _outwards(*rest), used * scale_y, math.nextafter(low, math.inf), u.size
    )


def _outwards(lower: float, upper: float) -> tuple[float, float]:
    """Return ends that were scaled back, with the rounding of the scaling."""
    slack = 1e-12 * (abs(lower) + abs(upper))
    return lower - slack, upper + slack


def _least_bound(v: Array, z: Array) -> float:
    """Return the least largest error over a grid of thresholds, then over a finer one."""

    def error(threshold: float) -> float:
        beyond = np.maximum(0.0, v - threshold)
        columns = np.stack([np.ones_like(v), beyond], axis=1)
        rows = np.vstack([np.column_stack([s * columns, -np.ones_like(v)]) for s in (1.0, -1.0)])
        limits = [(None, None), (0.0, None), (0.0, None)]
        found = linprog([0, 0, 1], A_ub=rows, b_ub=np.concatenate([z, -z]), bounds=limits, method="highs")
        return float(np.asarray(found.x)[-1])

    grid = np.linspace(0.0, 1.0, GRID, endpoint=False)
    coarse = [error(x) for x in grid]
    best = float(grid[int(np.argmin(coarse))])
    return min(min(coarse), *(error(x) for x in np.linspace(max(0.0, best - 1 / GRID), best + 1 / GRID, 21)))
