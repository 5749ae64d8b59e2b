"""A figure over time as numbers, for the plot of an HTML page that can be zoomed.

The figure itself is read: its lines, bands and shades have the labels, units and colours already. A panel with anything
else in it, such as a text, stays a picture.
"""

from __future__ import annotations

import re
from base64 import b64encode
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.colors import to_hex
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from relaxations.algebra.arrays import Array
from smid.display.style import VARIABLES

LONG = 1000  # samples; the picture shows fewer well enough
MOST_POINTS = 20_000  # of a series
_TIME = re.compile(r"(time.*) \[(?:s|min|h|d)\]$", re.DOTALL)
_PIXELS = 4 / 3  # of a page per point of a figure
_SPARSE = 4  # instants of the axis per sample; records that lie years apart would be mostly gap
_OFF_GRID = 0.01  # of the sampling time; instants are rounded


@dataclass(frozen=True)
class Trace:
    """A line, dots, a staircase or a band.

    Parameters
    ----------
    rows
        The values of a line, or the lower and the upper edge of a band; shape (N,), or (1,) for a constant.
    look
        Label, colour, width and so on, for the script.
    """

    rows: tuple[Array, ...]
    look: dict[str, Any]


@dataclass(frozen=True)
class Panel:
    """One plot of a figure; ``shades`` are parts of the time, in seconds, and their looks."""

    label: str
    traces: tuple[Trace, ...]
    shades: tuple[tuple[float, float, dict[str, Any]], ...]


@dataclass(frozen=True)
class Traces:
    """The panels of a figure over their common time: ``start``, ``start + step`` and so on, in seconds.

    Parameters
    ----------
    whole
        Whether the figure has no other panels.
    """

    label: str
    start: float
    step: float
    samples: int
    panels: tuple[Panel, ...]
    whole: bool

    def to_dict(self) -> dict[str, Any]:
        """Return plain data for the script: at most ``MOST_POINTS`` points a series, as base64 of 32-bit numbers."""
        size = bin_size(self.samples)
        note = (
            f"Each bin of {size * self.step:.4g} s is shown by its least and its largest sample. " if size > 1 else ""
        )
        return {
            "label": self.label,
            "start": self.start,
            "step": self.step * (size / 2 if size > 1 else 1),
            "points": self.samples if size == 1 else 2 * -(-self.samples // size),
            "note": note,
            "whole": self.whole,
            "panels": [
                {
                    "label": panel.label,
                    "shades": panel.shades,
                    "traces": [
                        {**trace.look, "rows": [_packed(row, size) for row in trace.rows]} for trace in panel.traces
                    ],
                }
                for panel in self.panels
            ],
        }


def bin_size(samples: int) -> int:
    """Return how many samples share a bin of two points, or 1 if each sample is a point.

    Examples
    --------
    >>> bin_size(20_000), bin_size(20_001), bin_size(100_000)
    (1, 3, 10)
    """
    return 1 if samples <= MOST_POINTS else -(-samples // (MOST_POINTS // 2))


def thinned(values: Array, size: int) -> Array:
    """Return the least and the largest value of each bin, in the order in which they occur.

    NaN is a missing sample, and a bin of nothing else is NaN.

    Examples
    --------
    >>> thinned(np.array([1.0, 5, 2, 9, 0, 3, np.nan, np.nan, np.nan]), 3).tolist()
    [1.0, 5.0, 9.0, 0.0, nan, nan]
    """
    if size == 1 or len(values) == 1:
        return values
    padded = np.pad(values, (0, -len(values) % size), constant_values=np.nan).reshape(-1, size)
    known = ~np.isnan(padded)
    least, largest = np.where(known, padded, np.inf), np.where(known, padded, -np.inf)
    places = np.sort([least.argmin(axis=1), largest.argmax(axis=1)], axis=0)
    found: Array = np.take_along_axis(padded, places.T, axis=1).ravel()
    found[np.repeat(~known.any(axis=1), 2)] = np.nan
    return found


def traces_of(figure: Figure) -> Traces | None:
    """Return the panels over time of a figure, or None if there are none of many samples that can be zoomed."""
    named = [(axes, found) for axes in figure.axes if (found := _TIME.match(axes.get_xlabel()))]
    if not named:
        return None
    below, found = named[-1]
    shared = below.get_shared_x_axes()
    group = [axes for axes in figure.axes if axes is below or shared.joined(below, axes)]
    if any(axes not in group for axes, _ in named) or not all(map(_is_plain, group)):
        return None
    lines = [line for axes in group for line in axes.lines if _in_data(line, axes) == (True, True)]
    times = [np.asarray(line.get_xdata(), dtype=np.float64) for line in lines]
    longest = max(times, key=len, default=np.empty(0))
    if len(longest) <= LONG:
        return None
    instants = np.concatenate(times)
    start, end, step = (
        float(instants.min()),
        float(instants.max()),
        float(longest[-1] - longest[0]) / (len(longest) - 1),
    )
    if not (np.isfinite(end - start) and step > 0 and end - start <= _SPARSE * len(instants) * step):
        return None
    grid = _Grid(start, step, round((end - start) / step) + 1)
    if not all(map(grid.holds, times)):
        return None
    panels = tuple(_panel(axes, grid) for axes in group)
    return Traces(_flat(found[1]), start, step, grid.count, panels, len(group) == len(figure.axes))


@dataclass(frozen=True)
class _Grid:
    start: float
    step: float
    count: int

    def places(self, time: Array) -> Array:
        return (time - self.start) / self.step

    def holds(self, time: Array) -> bool:
        places = self.places(time)
        return bool(np.all(np.abs(places - np.round(places)) < _OFF_GRID) and np.all(np.diff(places) > 0.5))

    def row(self, time: Array, values: Any) -> Array:
        row = np.full(self.count, np.nan)
        row[np.round(self.places(time)).astype(int)] = np.ma.filled(np.ma.asarray(values, dtype=np.float64), np.nan)
        return row


def _is_plain(axes: Axes) -> bool:
    """Return whether all that a panel shows can be drawn by the script."""
    titled = any(axes.get_title(loc) for loc in ("left", "center", "right"))
    bands = all(isinstance(group, PolyCollection) for group in axes.collections)
    spans = not any(_in_data(patch, axes) == (True, True) for patch in axes.patches)
    linear = axes.get_xscale() == axes.get_yscale() == "linear"
    return linear and bands and spans and not (titled or axes.texts or axes.images)


def _in_data(artist: Artist, axes: Axes) -> tuple[bool, bool]:
    """Return whether x and y are data; if not, they are shares of the panel, as x is in ``axhline`` and ``axhspan``."""
    x, y = artist.get_transform().contains_branch_seperately(axes.transData)
    return bool(x), bool(y)


def _panel(axes: Axes, grid: _Grid) -> Panel:
    traces, shades = list[Trace](), list[tuple[float, float, dict[str, Any]]]()
    for group in axes.collections:
        edges, steps = _edges(group, grid)
        traces.append(Trace(edges, _look(group, group.get_facecolor()[0]) | {"steps": steps}))
    for patch in axes.patches:
        corners = patch.get_patch_transform().transform(patch.get_path().vertices)
        look = _look(patch, patch.get_facecolor())
        if not _in_data(patch, axes)[0]:
            traces.append(Trace(tuple(np.array([end]) for end in (corners[:, 1].min(), corners[:, 1].max())), look))
        else:
            shades.append((float(corners[:, 0].min()), float(corners[:, 0].max()), look))
    for line in sorted(axes.lines, key=lambda one: one.get_zorder()):
        look = _look(line, line.get_color())
        time, values = np.asarray(line.get_xdata(), dtype=np.float64), line.get_ydata()
        over_time, has_values = _in_data(line, axes)
        if not over_time:
            # Only levels are dashed: between dashes a peak could be lost.
            traces.append(Trace((np.asarray(values, dtype=np.float64)[:1],), look | _stroke(line) | {"dash": [6, 4]}))
        elif not has_values:
            shades.append((float(time[0]), float(time[0]), look))
        else:
            traces.append(Trace((grid.row(time, values),), look | _stroke(line)))
    return Panel(_flat(axes.get_ylabel()), tuple(traces), tuple(shades))


def _edges(group: Any, grid: _Grid) -> tuple[tuple[Array, Array], bool]:
    """Return the edges of a band that ``fill_between`` drew, and whether they are staircases.

    Each polygon goes along one edge and back along the other. A staircase passes an instant twice, the second time with
    the value that holds from there on.
    """
    edges, steps = np.full((2, grid.count), np.nan), False
    for path in group.get_paths():
        half = (len(path.vertices) - 3) // 2
        there, back = path.vertices[1 : half + 1], path.vertices[half + 2 : 2 * half + 2][::-1]
        instants, again = np.unique(there[::-1, 0], return_index=True)
        last = half - 1 - again
        places = np.round(grid.places(instants)).astype(int)
        edges[:, places] = np.sort([there[last, 1], back[last, 1]], axis=0)
        steps = steps or len(instants) < half
    return (edges[0], edges[1]), steps


def _look(artist: Artist, colour: Any) -> dict[str, Any]:
    code, label = to_hex(colour), str(artist.get_label())
    alpha = artist.get_alpha()
    return {
        "label": "" if label.startswith("_") else label,
        "colour": f"--{VARIABLES[code]}" if code in VARIABLES else code,
        "alpha": 1.0 if alpha is None else alpha,
    }


def _stroke(line: Line2D) -> dict[str, Any]:
    dots = line.get_marker() not in (None, "", " ", "None")
    return {
        "width": _PIXELS * line.get_linewidth() * (line.get_linestyle() not in ("", " ", "None")),
        "dots": _PIXELS * line.get_markersize() * dots,
        "steps": line.get_drawstyle() == "steps-post",
    }


def _flat(label: str) -> str:
    return " ".join(label.split())


def _packed(row: Array, size: int) -> tuple[float, str]:
    """Return an offset, and the numbers above it: near a large pressure 32 bits would lose small changes."""
    known = row[np.isfinite(row)]
    offset = float(known[0]) if len(known) else 0.0
    with np.errstate(over="ignore", invalid="ignore"):
        kept = (thinned(np.where(np.isfinite(row), row, np.nan), size) - offset).astype("<f4")
    kept[~np.isfinite(kept)] = np.nan
    return offset, b64encode(kept.tobytes()).decode()
