"""The figures of a report. Each is a plain matplotlib figure: no window, no global state."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.markers import CARETDOWNBASE, CARETUPBASE
from matplotlib.patches import Patch

from relaxations.hierarchy import Proof
from smid.data import Dataset
from smid.estimate import Estimate, ParameterInterval, round_down, round_up, shown_digits
from smid.lowest_order import LowestOrder
from smid.reports.style import BLUE, GRID, INK, NARROW, ORANGE, RED, SKY, WIDTH, style
from smid.validate import Validation

# In a row the certified interval goes from 0 to 1; the rest of the row is for the numbers.
_LEFT, _RIGHT = -0.4, 1.4


def intervals_figure(estimate: Estimate, truth: Mapping[str, float] | None = None) -> Figure:
    """Draw the intervals of an estimate, one row per parameter, each row on its own scale.

    Parameters
    ----------
    estimate : Estimate
    truth : mapping str -> float, optional
        The parameters that made simulated data; marked where given.

    Returns
    -------
    Figure
        Certified interval (light), witnessed interval (dark) and centre. A line across marks an end that the
        prior box sets. Printed ends are rounded outwards.
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


def data_figure(dataset: Dataset) -> Figure:
    """Draw every channel over time, outputs on top.

    Parameters
    ----------
    dataset : Dataset

    Returns
    -------
    Figure
    """
    with style():
        figure = dataset.plot()
        figure.set_size_inches(WIDTH, 0.6 + 1.3 * len(figure.axes))
    return figure


def simulation_figure(validation: Validation, number: int = 0) -> Figure:
    """Draw the measured output over the free run, and the error below.

    Parameters
    ----------
    validation : Validation
    number : int
        Which of its scores: one for each experiment and output.

    Returns
    -------
    Figure
        The band around the free run, and the lines around the error, are the noise bound.
    """
    score = validation.scores[number]
    names = [e.name for e in validation.data.experiments]
    k = names.index(score.experiment)
    time = validation.data.time(k)
    measured = validation.data.values(score.channel, k)
    simulated = validation.simulated[k][score.channel]
    unit = f" [{score.unit}]" if score.unit else ""
    with style():
        figure = Figure(figsize=(WIDTH, 3.3), layout="constrained")
        top, below = figure.subplots(2, 1, sharex=True, height_ratios=(2, 1))
        error = measured - simulated
        if score.noise_bound is not None:
            bound = score.noise_bound
            top.fill_between(
                time,
                simulated - bound,
                simulated + bound,
                color=SKY,
                alpha=0.45,
                linewidth=0,
                label="± noise bound",
            )
            below.axhline(bound, color=RED, linewidth=0.8, linestyle="--", label="noise bound")
            below.axhline(-bound, color=RED, linewidth=0.8, linestyle="--")
            outside = np.abs(error) > bound
            outside[: len(error) - score.samples] = False  # the samples that start the run are not scored
            if outside.any():
                below.plot(time[outside], error[outside], color=RED, marker=".", markersize=3, linestyle="")
        top.plot(time, simulated, color=BLUE, label="free run")
        top.plot(time, measured, color=INK, linestyle="", marker=".", markersize=1.8, label="measured")
        below.plot(time, error, color=INK, linewidth=0.6)
        top.set_ylabel(f"{score.channel}{unit}")
        below.set_ylabel(f"error{unit}")
        below.set_xlabel("time [s]")
        for axes in (top, below):
            axes.grid(True, linewidth=0.4, color=GRID)
            axes.margins(x=0.01)
        figure.align_ylabels()
        handles, labels = top.get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside upper center", ncols=3)
    return figure


def lowest_order_figure(found: LowestOrder) -> Figure:
    """Draw what is known of the least noise bound of each candidate, beside the bound that was allowed.

    Parameters
    ----------
    found : LowestOrder

    Returns
    -------
    Figure
        Arrows point to where the least bound lies: up from its certified lower end where a candidate is proven wrong,
        down from the allowed bound where it is feasible. A candidate of which neither is known has none.
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
