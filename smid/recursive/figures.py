"""Figures of recursive estimation: one run, a gain study, and a comparison of estimators."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import zip_longest
from typing import Literal

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from smid.display.style import BLUE, GREEN, GRID, INK, ORANGE, RED, SKY, WIDTH, style
from smid.recursive.comparison import Comparison
from smid.recursive.gain_study import GainStudy
from smid.recursive.tracking import Tracking

__all__ = ["comparison_figure", "gain_figure", "traces_figure", "tracking_figure"]

_KINDS = (("free run", ORANGE, "s"), ("one step ahead", BLUE, "o"), ("a posteriori", GREEN, "v"))
_PARAMETERS = (BLUE, ORANGE, GREEN, RED, SKY)
_FLOOR = 1e-18
"""Smaller errors are drawn at this value on the logarithmic scale."""


def tracking_figure(tracking: Tracking) -> Figure:
    """Draw the output with the free run, the three errors on one logarithmic scale, and the parameters.

    Each parameter is divided by its largest magnitude in the second half of the record, which the legend shows.
    """
    time, unit = tracking.data.time(tracking.experiment), _bracket(tracking.unit)
    with style():
        figure = Figure(figsize=(WIDTH, 5.4), layout="constrained")
        # Top: measured output and free run.
        top, middle, below = figure.subplots(3, 1, sharex=True)
        measured = tracking.measured
        top.plot(time, measured, color=INK, linewidth=2.0, alpha=0.3, label="measured")
        top.plot(time, tracking.frozen.output, color=ORANGE, linewidth=0.9, label="free run")
        # The axis covers the measured range, even if the free run leaves it.
        reach = 0.6 * (float(np.ptp(measured)) or 1.0)
        top.set_ylim(float(measured.min()) - reach, float(measured.max()) + reach)
        top.set_ylabel(f"{tracking.data.output}{unit}")
        # Middle: the three errors.
        for name, colour, _ in _KINDS:
            size = np.maximum(np.abs(tracking.residuals[name].samples), _FLOOR)
            middle.plot(time, size, ".", markersize=1.4, color=colour, label=name)
        middle.set_yscale("log")
        middle.set_ylabel(f"error{unit}")
        # Bottom: the parameters, each scaled.
        below.set_prop_cycle(color=_PARAMETERS)
        n = len(tracking.history.parameters)
        for name, values in zip(tracking.arx.names, tracking.history.parameters.T, strict=True):
            largest = float(np.abs(values[n // 2 :]).max(initial=0.0)) or 1.0
            below.plot(time[:n], values / largest, linewidth=0.9, label=f"{name} / {largest:.3g}")
        below.set_ylim(-1.6, 1.6)  # the first samples may give extreme values
        below.set_ylabel("parameters")
        below.set_xlabel("time [s]")
        for axes in (top, middle, below):
            _finish(axes)
            axes.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0), markerscale=5)
        figure.align_ylabels()
        figure.suptitle(f"{tracking.method} on {tracking.record}", fontsize=9)
    return figure


def traces_figure(trackings: Sequence[Tracking], title: Literal["method", "record"]) -> Figure:
    """Draw the measured output, the output after each update and the free run, one panel for each tracking.

    The axis of a panel covers the measured range, even if the free run leaves it.
    """
    rows = -(-len(trackings) // 2)
    with style():
        figure = Figure(figsize=(1.5 * WIDTH, 0.6 + 1.5 * rows), layout="constrained")
        panels = figure.subplots(rows, 2, squeeze=False).ravel()
        for axes, tracking in zip(panels, trackings, strict=False):
            time, measured = tracking.data.time(tracking.experiment), tracking.measured
            after = measured - tracking.a_posteriori.samples
            axes.plot(time, measured, color=INK, linewidth=2.0, alpha=0.3, label="measured")
            axes.plot(time, tracking.frozen.output, color=ORANGE, linewidth=0.8, label="free run")
            axes.plot(time, after, color=GREEN, linewidth=0.6, label="after the update")
            reach = 0.2 * (float(np.ptp(measured)) or 1.0)
            axes.set_ylim(float(measured.min()) - reach, float(measured.max()) + reach)
            axes.set_title(str(tracking.method if title == "method" else tracking.record), loc="left")
            _finish(axes)
        for axes in panels[len(trackings) :]:
            axes.set_axis_off()
        figure.supxlabel("time [s]", fontsize=8)
        figure.supylabel(f"{trackings[0].data.output}{_bracket(trackings[0].unit)}", fontsize=8)
        handles, labels = panels[0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside upper center", ncols=3)
    return figure


def gain_figure(study: GainStudy) -> Figure:
    """Draw the RMSE of the three errors over the adaptation gain, with the limit of the stability rule.

    A gain without a point diverged.
    """
    first = study.trackings[0]
    with style():
        figure = Figure(figsize=(WIDTH, 2.6), layout="constrained")
        axes = figure.subplots()
        for name, colour, marker in _KINDS:
            errors = np.array([tracking.residuals[name].rmse for tracking in study.trackings])
            axes.loglog(study.gains, errors, marker=marker, markersize=4, color=colour, label=name)
        axes.axhline(first.held.rmse, color=INK, linewidth=0.7, linestyle=":", label="last output held")
        axes.axvline(study.largest_gain, color=RED, linewidth=0.8, linestyle="--", label="stability rule")
        axes.set_xlabel("adaptation gain")
        axes.set_ylabel(f"RMSE{_bracket(first.unit)}")
        _finish(axes)
        axes.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0))
    return figure


def comparison_figure(comparison: Comparison) -> Figure:
    """Draw the RMSE of the three errors of every method on every record, one panel for each model.

    A method without a point diverged.
    """
    trackings = comparison.trackings
    models = list(dict.fromkeys(str(t.arx) for t in trackings))
    methods = [list(dict.fromkeys(str(t.method) for t in trackings if str(t.arx) == model)) for model in models]
    records = list(dict.fromkeys(t.record for t in trackings))
    with style():
        figure = Figure(figsize=(WIDTH, 1.0 + 2.2 * len(models)), layout="constrained")
        panels = figure.subplots(len(models), 1, sharex=True, squeeze=False)[:, 0]
        # One panel for each model; methods side by side within a record.
        for axes, model, own in zip(panels, models, methods, strict=True):
            chosen = [t for t in trackings if str(t.arx) == model]
            places = [records.index(t.record) + _shift(own.index(str(t.method)), len(own)) for t in chosen]
            for name, colour, marker in _KINDS:
                errors = np.maximum([t.residuals[name].rmse for t in chosen], _FLOOR)
                axes.plot(places, errors, marker, markersize=3, color=colour, label=name)
            axes.set_yscale("log")
            axes.set_title(model, loc="left")
            axes.set_ylabel(f"RMSE{_bracket(trackings[0].unit)}")
            axes.grid(True, axis="y", linewidth=0.4, color=GRID)
            for edge in range(1, len(records)):
                axes.axvline(edge - 0.5, color=GRID, linewidth=0.6)
        # The common legend and the order of the methods.
        panels[-1].set_xticks(range(len(records)), records, rotation=35, ha="right")
        handles, labels = panels[0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside upper center", ncols=3)
        places_of = [dict.fromkeys(name for name in names if name) for names in zip_longest(*methods)]
        order = "\n".join(f"{k}. {' or '.join(names)}" for k, names in enumerate(places_of, start=1))
        figure.supxlabel(f"within each record, from left to right:\n{order}", fontsize=8)
    return figure


def _bracket(unit: str) -> str:
    return f" [{unit}]" if unit else ""


def _finish(axes: Axes) -> None:
    axes.grid(True, linewidth=0.4, color=GRID)
    axes.margins(x=0.01)


def _shift(place: int, count: int) -> float:
    return 0.7 * ((place + 0.5) / count - 0.5)
