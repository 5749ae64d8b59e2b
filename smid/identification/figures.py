"""Figures of intervals, and of the search for the lowest order."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.markers import CARETDOWNBASE, CARETUPBASE
from matplotlib.patches import Patch
from matplotlib.ticker import MaxNLocator

from relaxations.search.enclosure import Proof
from smid.display.style import BLUE, GRID, INK, ORANGE, RED, SKY, WIDTH, style
from smid.identification.estimate import Estimate, ParameterInterval, round_down, round_up, shown_digits

if TYPE_CHECKING:
    from smid.identification.lowest_order import LowestOrder

# The scale goes from -1 to 1; the rest of a row is for the numbers.
_EDGE = 1.8
_LINEAR = 20  # ratio of the largest width to the smallest that a linear scale shows
_MOST = 100.0  # percent of the centre: an interval that reaches farther holds zero, and is cut there


@dataclass(frozen=True)
class _Scale:
    """Deviations from the centre in percent, on one scale for all rows.

    Parameters
    ----------
    least, most
        Half widths of the narrowest and of the widest interval.
    """

    least: float
    most: float

    @staticmethod
    def of(intervals: Sequence[ParameterInterval]) -> _Scale:
        halves = [0.5 * i.width_percent for i in intervals if i.width_percent > 0]
        known = np.minimum(halves, _MOST) if halves else np.ones(1)
        return _Scale(float(known.min()), float(known.max()))

    @property
    def is_linear(self) -> bool:
        return self.most <= _LINEAR * self.least

    def place(self, percent: float) -> float:
        """Return where a deviation is drawn: linear, or like a logarithm beyond the narrowest interval."""
        share = percent / self.most if self.is_linear else self._bent(percent) / self._bent(self.most)
        return float(np.clip(share, -1.0, 1.0))

    def _bent(self, percent: float) -> float:
        return float(np.arcsinh(percent / self.least))

    @property
    def ticks(self) -> list[float]:
        """Return the deviations to print, zero in the middle."""
        if self.is_linear:
            marks = MaxNLocator(4, symmetric=True).tick_values(-self.most, self.most)
            return [float(mark) for mark in marks if abs(mark) <= self.most]
        decades = 10.0 ** np.arange(np.ceil(np.log10(self.least)), np.floor(np.log10(self.most)) + 1)
        kept = decades[:: -max(1, -(-len(decades) // 2))]
        return sorted([0.0, *kept, *(-kept)])


def intervals_figure(estimate: Estimate, truth: Mapping[str, float] | None = None) -> Figure:
    """Draw the intervals of an estimate, one row per parameter, all on one scale: deviations in percent of the centre.

    The scale is like a logarithm where the widths differ much. Each row shows the certified interval (light), the
    verified one (dark) and the centre. A line across marks an end that the prior box sets. Printed ends are rounded
    outwards. ``truth`` are the parameters that made simulated data.
    """
    truth, scale = truth or {}, _Scale.of(estimate.intervals)
    with style():
        count = len(estimate.intervals)
        figure = Figure(figsize=(WIDTH, 0.9 + 0.42 * count), layout="constrained")
        rows = figure.subplots(count, 1, squeeze=False)[:, 0]
        for axes, interval in zip(rows, estimate.intervals, strict=True):
            _row(axes, interval, truth.get(interval.name), scale)
        rows[-1].set_xticks([scale.place(tick) for tick in scale.ticks], [f"{tick:g} %" for tick in scale.ticks])
        rows[-1].set_xlabel("deviation from the centre, in percent of it")
        keys: list[Patch | Line2D] = [
            Patch(color=SKY, label="certified"),
            Patch(color=BLUE, label="witnessed"),
            Line2D([], [], color=ORANGE, marker="D", linestyle="", label="centre"),
        ]
        if any(Proof.BOX in (i.proof_lower, i.proof_upper) for i in estimate.intervals):
            keys.append(Line2D([], [], color=RED, marker="|", markersize=10, linestyle="", label="prior box"))
        if truth:
            keys.append(Line2D([], [], color=INK, marker="x", linestyle="", label="true value"))
        figure.legend(handles=keys, loc="outside lower center", ncols=len(keys) if len(keys) < 5 else 3)
    return figure


def _row(axes: Axes, interval: ParameterInterval, truth: float | None, scale: _Scale) -> None:
    axes.set_xlim(-_EDGE, _EDGE)
    axes.set_ylim(-1, 1)
    axes.set_xticks([])
    axes.set_yticks([])
    for spine in axes.spines.values():
        spine.set_visible(False)
    label = f"{interval.name} [{interval.unit}]" if interval.unit else interval.name
    axes.set_ylabel(label, rotation=0, ha="right", va="center")
    digits = shown_digits(interval)
    ends = (round_down(interval.lower, digits), round_up(interval.upper, digits))
    axes.text(-1.06, 0, ends[0], ha="right", va="center")
    axes.text(1.06, 0, ends[1], ha="left", va="center")
    if not np.isfinite(interval.width):
        axes.text(0, 0, "no bounds proven", ha="center", va="center")
        return
    # Around a centre of zero there is no share: the row is as wide as the scale.
    size = abs(interval.centre) / 100 if interval.centre else max(interval.width / 2 / scale.most, np.finfo(float).tiny)

    def place(value: float) -> float:
        return scale.place((value - interval.centre) / size)

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
        figure = Figure(figsize=(WIDTH, 2.8), layout="constrained")
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
