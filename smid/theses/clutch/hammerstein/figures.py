"""The figures of the Hammerstein study."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from smid.display.style import BLUE, GREEN, GRID, INK, ORANGE, RED, SKY, WIDTH, style
from smid.theses.clutch.hammerstein.free_runs import FreeRuns
from smid.theses.clutch.hammerstein.printed import PRINTED, PrintedComparison
from smid.validation.scores import Validation

__all__ = ["free_runs_figure", "printed_figure", "validation_figure"]


def validation_figure(validation: Validation) -> Figure:
    """Draw output and error of a free run, a row per record, ramps first: figures 3.3 and 3.4 of the thesis."""
    data, scores = validation.data, validation.scores
    order = sorted(range(len(scores)), key=lambda k: "step" in scores[k].experiment)
    unit = data.channel(data.output).unit
    with style():
        figure = Figure(figsize=(WIDTH, 0.7 + 1.05 * len(scores)), layout="constrained")
        panels = figure.subplots(len(scores), 2, sharex=True, sharey="col", squeeze=False)
        for (left, right), k in zip(panels, order, strict=True):
            # Output on the left, error with the noise bound on the right.
            score = scores[k]
            measured, simulated = data.values(score.channel, k), validation.simulated[k][score.channel]
            left.plot(data.time(k), measured, color=INK, linewidth=2.2, alpha=0.3, label="measured")
            left.plot(data.time(k), simulated, color=BLUE, linewidth=0.8, label="free run")
            left.set_title(score.experiment, loc="left", fontsize=8)
            if score.noise_bound is not None:
                span = (-score.noise_bound, score.noise_bound)
                right.axhspan(*span, color=SKY, alpha=0.45, linewidth=0, label="± noise bound")
            right.plot(data.time(k), measured - simulated, color=INK, linewidth=0.6)
            right.set_title(f"RMSE {score.rmse:.2f} {unit}", loc="left", fontsize=8)
            for axes in (left, right):
                _finish(axes)
        panels[-1, 0].set_xlabel("time [s]")
        panels[-1, 1].set_xlabel("time [s]")
        figure.supylabel(f"{data.output} on the left, error on the right [{unit}]", fontsize=8)
        handles = [*panels[0, 0].get_legend_handles_labels()[0], *panels[0, 1].get_legend_handles_labels()[0]]
        figure.legend(handles=handles, loc="outside upper center", ncols=3)
    return figure


def free_runs_figure(runs: FreeRuns) -> Figure:
    """Draw the RMSE of every model on every record."""
    unit = runs.data.channel(runs.data.output).unit
    names = list(runs.validations)
    places = np.arange(len(runs.records))
    with style():
        figure = Figure(figsize=(WIDTH, 3.0), layout="constrained")
        axes = figure.subplots()
        axes.set_prop_cycle(color=[BLUE, SKY, GREEN, ORANGE, RED, INK])
        for k, (name, marker) in enumerate(zip(names, "os^vDP", strict=False)):
            shift = 0.6 * ((k + 0.5) / len(names) - 0.5)
            axes.plot(places + shift, runs.rmse(name), marker, markersize=4, label=name)
        for edge in places[1:] - 0.5:
            axes.axvline(edge, color=GRID, linewidth=0.6)
        axes.set_ylim(bottom=0)
        axes.set_xlim(-0.5, len(places) - 0.5)
        axes.set_xticks(places, runs.records, rotation=35, ha="right")
        axes.set_ylabel(f"RMSE [{unit}]")
        axes.grid(True, axis="y", linewidth=0.4, color=GRID)
        handles, labels = axes.get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside upper center", ncols=2)
    return figure


def printed_figure(comparison: PrintedComparison) -> Figure:
    """Draw printed intervals and models over certified intervals, each row on its own scale."""
    shown = [p for p in PRINTED if p.name in {i.name for i in comparison.known.intervals}]
    with style():
        figure = Figure(figsize=(WIDTH, 0.7 + 0.55 * len(shown)), layout="constrained")
        for axes, p in zip(figure.subplots(len(shown), 1, squeeze=False)[:, 0], shown, strict=True):
            # Certified interval, attained values, printed interval, printed model.
            interval = comparison.known[p.name]
            axes.barh(0, interval.width, left=interval.lower, height=1.0, color=SKY)
            axes.barh(
                0, interval.inner_upper - interval.inner_lower, left=interval.inner_lower, height=0.45, color=BLUE
            )
            axes.plot([p.lower, p.upper], [0, 0], color=RED, linewidth=4, solid_capstyle="butt")
            axes.plot([p.lower, p.upper], [0, 0], "|", color=RED, markersize=14)
            axes.plot(p.model, 0, "D", color=ORANGE, markersize=5)
            axes.set_ylim(-0.8, 0.8)
            axes.use_sticky_edges = False
            axes.margins(x=0.04)
            axes.set_yticks([])
            axes.locator_params(axis="x", nbins=5)
            axes.ticklabel_format(axis="x", useOffset=False)
            axes.set_ylabel(p.name, rotation=0, ha="right", va="center")
            axes.spines["left"].set_visible(False)
        keys = [
            Patch(color=SKY, label="certified"),
            Patch(color=BLUE, label="attained"),
            Line2D([], [], color=RED, marker="|", markersize=10, linestyle="", label="thesis: interval"),
            Line2D([], [], color=ORANGE, marker="D", markersize=5, linestyle="", label="thesis: model"),
        ]
        figure.legend(handles=keys, loc="outside lower center", ncols=len(keys))
    return figure


def _finish(axes: Axes) -> None:
    axes.grid(True, linewidth=0.4, color=GRID)
    axes.margins(x=0.01)
