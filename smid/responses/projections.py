"""Projections of the feasible set on pairs of parameters: certified polygons, and verified points inside.

For a direction d in the plane of two parameters, scaled by the half widths of their intervals, a relaxation bounds
``d'p`` over the feasible set: a half-plane that holds every pair of values that fits. With the intervals themselves the
half-planes make a polygon. Verified points are pairs that do fit; between them and the edges nothing is known.
"""

from __future__ import annotations

import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from relaxations.algebra.arrays import Array
from relaxations.deadline import STOPS, limited
from smid.data import Dataset
from smid.display.from_plain import Plain, read
from smid.display.progress import Shows, counted, spoken, with_bar
from smid.display.result import Part, Tabular, plain
from smid.display.table import Table, figure
from smid.identification.estimate import Estimate
from smid.models import ModelError
from smid.responses.outer_set import OuterSet

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_ROUNDING = 1e-12  # of the interval: corners are drawn a little outside


@dataclass(frozen=True, eq=False)
class Projection:
    """The feasible set seen on the plane of two parameters.

    Parameters
    ----------
    names
        Of the two parameters.
    directions, ends
        Shapes (m, 2) and (m,). Certified: every pair of values that fits has ``directions @ pair <= ends``.
    points
        Shape (k, 2). Values at verified points of the feasible set.
    """

    names: tuple[str, str]
    directions: Array
    ends: Array
    points: Array

    @property
    def corners(self) -> Array:
        """Return the corners of the polygon, shape (n, 2), counter-clockwise; rounded, for drawings."""
        # The first four half-planes are the intervals.
        (right, top), (left, bottom) = self.ends[:2], -self.ends[2:4]
        size = np.array([right - left, top - bottom])
        corners = np.array([[left, bottom], [right, bottom], [right, top], [left, top]])
        for direction, end in zip(self.directions[4:], self.ends[4:], strict=True):
            corners = _cut(corners, direction, end + _ROUNDING * float(np.abs(direction) @ size))
        return corners

    @property
    def area_percent(self) -> float:
        """Return the area of the polygon in percent of the box of the two intervals."""
        x, y = self.corners.T
        area = 0.5 * abs(float(x @ np.roll(y, -1) - y @ np.roll(x, -1)))
        return 100 * area / float((self.ends[0] + self.ends[2]) * (self.ends[1] + self.ends[3]))

    @property
    def gap_percent(self) -> float:
        """Return the largest distance from an edge to the verified points, in percent of the width that way; or NaN."""
        if not len(self.points):
            return float("nan")
        reached = self.points @ self.directions.T
        width = self.ends - reached.min(axis=0)
        return 100 * float(np.max((self.ends - reached.max(axis=0)) / width))


def _cut(corners: Array, direction: Array, end: float) -> Array:
    """Return the part of a convex polygon in a half-plane (Sutherland and Hodgman)."""
    room = end - corners @ direction
    kept = []
    for k, corner in enumerate(corners):
        after = (k + 1) % len(corners)
        if room[k] >= 0:
            kept.append(corner)
        if (room[k] >= 0) != (room[after] >= 0):
            kept.append(corner + room[k] / (room[k] - room[after]) * (corners[after] - corner))
    return np.array(kept).reshape(-1, 2)


@dataclass(frozen=True, eq=False, repr=False)
class Projections(Tabular):
    """Projections of the feasible set of an estimate on pairs of its parameters.

    Parameters
    ----------
    complete
        False where the time limit, or the user, ended the work: the polygons are certified, and larger.
    solves
        Certified bounds that were computed.
    seconds
        Wall clock.
    """

    SCHEMA: ClassVar = "smid.projection-set/1"

    estimate: Estimate
    pairs: tuple[Projection, ...]
    complete: bool
    solves: int
    seconds: float

    def __len__(self) -> int:
        return len(self.pairs)

    def __iter__(self) -> Iterator[Projection]:
        return iter(self.pairs)

    def __getitem__(self, names: tuple[str, str]) -> Projection:
        for pair in self.pairs:
            if pair.names == tuple(names):
                return pair
        raise KeyError(f"no pair {names!r}: there is {', '.join(str(pair.names) for pair in self.pairs)}")

    @property
    def parameters(self) -> tuple[str, ...]:
        """Return the names of the parameters, in the order of the model."""
        return tuple(dict.fromkeys(name for pair in self.pairs for name in pair.names))

    @property
    def table(self) -> Table:
        """Return a row for each pair."""
        rows = tuple(
            (*pair.names, str(len(pair.ends)), figure(pair.area_percent), figure(pair.gap_percent))
            for pair in self.pairs
        )
        header = ("parameter", "parameter", "edges", "area %", "gap %")
        return Table("Pairs of parameters that fit the data", header, rows, "llrrr")

    @property
    def notes(self) -> tuple[str, ...]:
        """Return what is proven, in sentences."""
        told = [
            "Certified: every pair of values that fits the data within the noise bound lies in its polygon.",
            "Area: of the polygon, in percent of the box of both intervals. Gap: the largest distance from an edge to "
            "the verified points, in percent of the width of the set that way.",
            f"{self.solves} certified solves in {self.seconds:.3g} s.",
        ]
        return (*told, *(() if self.complete else ("The work was stopped early: more time makes polygons smaller.",)))

    def _content(self) -> Iterator[Part]:
        yield self.table
        yield from self.notes

    def _rows(self) -> Iterator[dict[str, Any]]:
        for pair in self.pairs:
            reached = (pair.points @ pair.directions.T).max(axis=0, initial=-np.inf)
            for direction, end, inner in zip(pair.directions, pair.ends, reached, strict=True):
                names = {"x": pair.names[0], "y": pair.names[1]}
                yield {**names, "x_factor": direction[0], "y_factor": direction[1], "end": end, "inner_end": inner}

    def to_dict(self) -> dict[str, Any]:
        """Return plain data: the ``projection set`` of the versioned JSON schema in docs/json.md."""
        return {
            "schema": self.SCHEMA,
            "estimate": self.estimate.to_dict(),
            "edges": plain(list(self._rows())),
            "points": [{"x": p.names[0], "y": p.names[1], "values": plain(p.points)} for p in self.pairs],
            "complete": self.complete,
            "solves": self.solves,
            "seconds": self.seconds,
        }

    @staticmethod
    def from_dict(content: Mapping[str, Any], data: Dataset | None = None) -> Projections:
        """Return the projections that `to_dict` described."""
        edges = read(content, "edges", tuple[Plain, ...])
        pairs = []
        for told in read(content, "points", tuple[Plain, ...]):
            names = (read(told, "x", str), read(told, "y", str))
            own = [edge for edge in edges if (read(edge, "x", str), read(edge, "y", str)) == names]
            directions = np.array([[read(edge, f"{axis}_factor", float) for axis in "xy"] for edge in own])
            ends = np.array([read(edge, "end", float) for edge in own])
            pairs.append(Projection(names, directions, ends, read(told, "values", Array).reshape(-1, 2)))
        return Projections(
            Estimate.from_dict(read(content, "estimate", Plain), data),
            tuple(pairs),
            read(content, "complete", bool),
            read(content, "solves", int),
            read(content, "seconds", float),
        )

    def plot(self) -> Figure:
        """Return a matrix of figures, one for each pair: polygon, verified points and centre."""
        from smid.responses.figures import projections_figure

        return projections_figure(self)


@with_bar
@limited
def projections(
    estimate: Estimate,
    parameters: Sequence[str] | None = None,
    directions: int = 8,
    *,
    seconds: float = np.inf,  # noqa: ARG001  (read by the decorator)
    progress: Shows = None,
) -> Projections:
    """Bound the pairs of parameter values that fit the data, by a certified polygon for each pair.

    Parameters
    ----------
    estimate
        With certified intervals, from this session or loaded with its record.
    parameters
        Two names or more, of which all pairs are taken; by default all parameters whose interval is no point.
    directions
        Edges of a polygon at most, a multiple of four: four are the intervals, each further one takes a solve.
    seconds
        Time allowed, wall clock; then the polygons proven so far are returned.
    progress
        Called with a line of text now and then; True shows a bar, in a terminal or a notebook.

    Raises
    ------
    ModelError
        Where the intervals are not proven, the model has Max, Min, Abs or sign that stay open, a name is unknown or its
        value known, or ``directions`` is no multiple of four.

    Examples
    --------
    >>> from smid import Dataset, OutputError, identify
    >>> u, y = [1.0, 0, 1, 1, 0, 0, 1, 0], [0.0, 1, 0.5, 1.3, 1.6, 0.8, 0.4, 1.2]
    >>> data = Dataset.from_arrays(input={"u": u}, output={"y": y}, sampling_time=1.0)
    >>> pair = projections(identify(OutputError(stable=True), data, noise_bound=0.1))["a1", "b0"]
    >>> bool((pair.directions @ [-0.5, 1.0] < pair.ends).all()), pair.area_percent < 80
    (True, True)
    """
    if directions < 4 or directions % 4:
        raise ModelError(f"directions = {directions}: give a multiple of four; four are the intervals themselves")
    names = _chosen(estimate, parameters)
    started = time.perf_counter()
    outer = OuterSet(estimate, names)
    radius = 0.5 * (outer.upper - outer.lower)
    angles = [2 * np.pi * k / directions for k in range(directions) if 4 * k % directions]
    planes = list(combinations(range(len(names)), 2))
    found: dict[tuple[int, int], list[tuple[Array, float]]] = {plane: [] for plane in planes}
    say = counted(spoken(progress) or (lambda _: None), "bounds", len(planes) * len(angles))
    complete = True
    try:
        for i, j in planes:
            for angle in angles:
                direction = np.zeros(len(names))
                direction[[i, j]] = np.array([np.cos(angle), np.sin(angle)]) / radius[[i, j]]
                before = len(outer.ends)
                outer.push(direction)
                if len(outer.ends) > before:
                    found[i, j].append((direction[[i, j]], float(outer.ends[-1])))
                say(f"{names[i]}, {names[j]}")
    except STOPS:
        complete = False
    pairs = []
    box = np.vstack([np.eye(2), -np.eye(2)])
    for (i, j), edges in found.items():
        ends = [outer.upper[i], outer.upper[j], -outer.lower[i], -outer.lower[j], *(end for _, end in edges)]
        rows = np.array([*box, *(direction for direction, _ in edges)])
        pairs.append(Projection((names[i], names[j]), rows, np.array(ends), outer.points[:, [i, j]]))
    return Projections(estimate, tuple(pairs), complete, outer.solves, time.perf_counter() - started)


def _chosen(estimate: Estimate, parameters: Sequence[str] | None) -> tuple[str, ...]:
    """Return the parameters to project on, in the order of the model."""
    free = [i.name for i in estimate.intervals if i.lower < i.upper]
    asked = free if parameters is None else list(parameters)
    for name in asked:
        if name not in free:
            why = "has a known value" if name in estimate else "is no parameter of the model"
            raise ModelError(f"{name!r} {why}: choose among {', '.join(free)}")
    if len(set(asked)) < 2:
        raise ModelError(f"a pair needs two parameters whose intervals are no points: choose among {', '.join(free)}")
    return tuple(name for name in free if name in asked)
