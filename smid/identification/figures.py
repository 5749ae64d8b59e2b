"""Figures of intervals, and of the search for the lowest order."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.markers import CARETDOWNBASE, CARETUPBASE
from matplotlib.patches import Patch

from relaxations.search.enclosure import Proof
from smid.display.style import BLUE, GRID, INK, NARROW, ORANGE, RED, SKY, style
from smid.identification.estimate import Estimate, ParameterInterval, round_down, round_up, shown_digits

if TYPE_CHECKING:
    from smid.identification.lowest_order import LowestOrder

# In a row the certified interval goes from 0 to 1; the rest of the row is for the numbers.
_LEFT, _RIGHT = -0.4, 1.4


def intervals_figure(estimate: Estimate, truth: Mapping[str, float] | None = None) -> Figure:
    """Draw the intervals of an estimate, one row per parameter, each row on its own scale.

    Each row shows the certified interval (light), the verified one (dark) and the centre. A line across marks an end
    that the prior box sets. Printed ends are rounded outwards. ``truth`` are the parameters that made simulated data.
    """
    truth = truth or {}
    with style():
        count = len(estimate.intervals)
        figure = Figure(figsize=(NARROW, 0.5 + 0.42 * count), layout="constrained")
        rows = figure.subplots(count, 1, squeeze=False)[:, 0]
        for axes, interval in zip(rows, estimate.intervals, strict=True):
            _row(axes, interval, truth.get(interval.name))
        keys: list[Patch | Line2D] = [
            Patch(color=SKY, label="certified"),
            Patch(color=BLUE, label="witnessed"),
            Line2D([], [], color=ORANGE, marker="D", linestyle="", label="centre"),
        ]
        if any(Proof.BOX in (i.proof_lower, i.proof_upper) for i in estimate.intervals):
            keys.append(Line2D([], [], color=RED, marker="|", markersize=10, linestyle="", label="prior box"))
        if truth:
            keys.append(Line2D([], [], color=INK, marker="x", linestyle="", label="true value"))
        figure.legend(handles=keys, loc="outside lower center", ncols=len(keys))
    return figure


def _row(axes: Axes, interval: ParameterInterval, truth: float | None) -> None:
    axes.set_xlim(_LEFT, _RIGHT)
    axes.set_ylim(-1, 1)
    axes.set_xticks([])
    axes.set_yticks([])
    for spine in axes.spines.values():
        spine.set_visible(False)
    label = f"{interval.name} [{interval.unit}]" if interval.unit else interval.name
    axes.set_ylabel(label, rotation=0, ha="right", va="center")
    digits = shown_digits(interval)
    ends = (round_down(interval.lower, digits), round_up(interval.upper, digits))
    axes.text(-0.04, 0, ends[0], ha="right", va="center")
    axes.text(1.04, 0, ends[1], ha="left", va="center")
    if not np.isfinite(interval.width):
        axes.text(0.5, 0, "no bounds proven", ha="center", va="center")
        return
    scale = interval.width if interval.width > 0 else 1.0
    shift = interval.lower if interval.width > 0 else interval.lower - 0.5

    def place(value: float) -> float:
        return (value - shift) / scale

    axes.barh(0, place(interval.upper) - place(interval.lower), left=place(interval.lower), height=1.0, color=SKY)
    if np.isfinite(interval.inner_lower):
        inner = place(interval.inner_upper) - place(interval.inner_lower)
        axes.barh(0, inner, left=place(interval.inner_lower), height=0.45, color=BLUE)
    for end, proof in ((interval.lower, interval.proof_lower), (interval.upper, interval.proof_upper)):
        if proof is Proof.BOX:
            axes.plot([place(end)] * 2, [-0.85, 0.85], color=RED, linewidth=2)
    axes.plot(place(interval.centre), 0, color=ORANGE, marker="D", markersize=5)
    if truth is not None:
        axes.plot(place(truth), 0, color=INK, marker="x", markersize=6, markeredgewidth=1.4)


def lowest_order_figure(found: LowestOrder) -> Figure:
    """Draw the least noise bound of each candidate, and the bound that was allowed.

    Arrows point to the side of the least bound: up from its certified lower end where a candidate is proven infeasible,
    down from the allowed bound where it is feasible. An undecided candidate has none.
    """
    allowed = found.noise_bound
    refused = [(k, s.least_bound) for k, s in enumerate(found.steps) if s.least_bound]
    feasible = [(k, allowed) for k, s in enumerate(found.steps) if s.feasible]
    with style():
        figure = Figure(figsize=(NARROW, 2.8), layout="constrained")
        axes = figure.subplots()
        axes.axhline(allowed, color=RED, linewidth=0.8, linestyle="--", label="allowed")
        for points, marker, colour, label in (
            (refused, CARETUPBASE, BLUE, "proven: no less"),
            (feasible, CARETDOWNBASE, ORANGE, "verified: no more"),
        ):
            if points:
                axes.plot(*zip(*points, strict=True), color=colour, marker=marker, markersize=10, ls="", label=label)
        axes.set_yscale("log")
        axes.margins(y=0.25)
        axes.set_xticks(range(len(found.steps)), [f"{s.model.name}\n{s.size}" for s in found.steps])
        axes.set_xlim(-0.5, len(found.steps) - 0.5)
        axes.set_ylabel(f"least noise bound of {found.channel}" + (f" [{found.unit}]" if found.unit else ""))
        axes.grid(True, axis="y", linewidth=0.4, color=GRID)
        figure.legend(loc="outside upper center", ncols=3)
    return figure
