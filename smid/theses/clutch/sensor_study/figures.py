"""The figures of the sensors."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.figure import Figure

from relaxations.algebra.arrays import Array
from smid.display.style import BLUE, GREEN, GRID, INK, ORANGE, RED, SKY, WIDTH, style

if TYPE_CHECKING:
    from smid.theses.clutch.sensor_study.cross import ErrorTable
    from smid.theses.clutch.sensor_study.foreign import ForeignStudy
    from smid.theses.clutch.sensor_study.intervals import IntervalStudy
    from smid.theses.clutch.sensor_study.structures import StructureTable
    from smid.theses.clutch.sensor_study.traces import SensorTraces

__all__ = ["error_figure", "foreign_figure", "interval_figure", "structure_figure", "traces_figure"]

_COLOURS = (ORANGE, BLUE, GREEN, RED)
_CURVE = "5.14"
_MOST_POINTS = 3000
_STRETCHES = 280  # over the width of a figure; a line is half as wide as a stretch
_SHOWN = 600  # samples of a record in the figure of intervals


def structure_figure(study: StructureTable) -> Figure:
    """Draw our errors and the thesis's, each divided by the error of its first row."""
    rows = [row for row in study.rows if row.printed is not None]
    places = np.arange(len(rows))
    with style():
        figure = Figure(figsize=(WIDTH, 1.0 + 0.3 * len(rows)), layout="constrained")
        axes = figure.subplots()
        for marker, size, colour, label, errors in (
            ("s", 8, ORANGE, "thesis, its data", [row.printed for row in rows]),
            ("o", 5, BLUE, "ours, simulated records", [row.mse for row in rows]),
        ):
            shares = np.array(errors) / errors[0]
            axes.plot(shares, places, marker, markersize=size, color=colour, label=label)
        axes.set_xscale("log")
        axes.set_yticks(places, [row.name for row in rows])
        axes.invert_yaxis()
        axes.set_xlabel(f"MSE over that of {rows[0].name}, table {study.number}")
        axes.grid(True, linewidth=0.4, color=GRID)
        figure.legend(*axes.get_legend_handles_labels(), loc="outside upper center", ncols=2)
    return figure


def traces_figure(traces: SensorTraces) -> Figure:
    """Draw the positions of a figure of the thesis."""
    with style():
        if traces.number == _CURVE:
            return _curve(traces)
        figure = Figure(figsize=(WIDTH, 3.2), layout="constrained")
        upper, lower = figure.subplots(2, sharex=True, height_ratios=(2, 1))
        upper.plot(*_thinned(traces.time, traces.measured), color=INK, label="measured")
        for colour, (name, simulated) in zip(_COLOURS, traces.simulated.items(), strict=False):
            upper.plot(*_thinned(traces.time, simulated), color=colour, label=name, linewidth=0.7)
            lower.plot(*_thinned(traces.time, traces.measured - simulated), color=colour, linewidth=0.6)
        upper.set_ylabel("position [mm]")
        lower.set_ylabel("error [mm]")
        lower.set_xlabel("time, one record after the other [s]" if len(traces.records) > 1 else "time [s]")
        for axes in (upper, lower):
            axes.grid(True, linewidth=0.4, color=GRID)
            axes.margins(x=0.01)
        figure.align_ylabels()
        figure.legend(*upper.get_legend_handles_labels(), loc="outside upper center", ncols=3)
    return figure


def _thinned(time: Array, values: Array) -> tuple[Array, Array]:
    """Return the smallest and the largest value of each stretch: the line looks the same, and the page is smaller."""
    length = max(1, values.size // _STRETCHES)
    whole = values.size // length * length
    blocks = values[:whole].reshape(-1, length)
    places = np.arange(0, whole, length)[:, None] + np.stack([blocks.argmin(axis=1), blocks.argmax(axis=1)], axis=1)
    kept = np.union1d(places, np.arange(whole, values.size))
    return time[kept], values[kept]


def _curve(traces: SensorTraces) -> Figure:
    figure = Figure(figsize=(WIDTH, 2.6), layout="constrained")
    axes = figure.subplots()
    kept = slice(None, None, max(1, traces.measured.size // _MOST_POINTS))
    axes.plot(traces.pressure[kept], traces.measured[kept], ".", markersize=1.5, color=BLUE)
    axes.set_xlabel("pressure [bar]")
    axes.set_ylabel("position [mm]")
    axes.grid(True, linewidth=0.4, color=GRID)
    return figure


def error_figure(errors: ErrorTable) -> Figure:
    """Draw errors as shades with their numbers, in the layout of their table."""
    down, across, values = errors.records, errors.sensors, errors.rmse
    if len(across) > len(down):
        down, across, values = across, down, values.T
    with style():
        figure = Figure(figsize=(max(WIDTH, 1.4 + 0.55 * len(across)), 1.0 + 0.26 * len(down)), layout="constrained")
        axes = figure.subplots()
        shades = np.log10(np.maximum(values, 1e-6))
        image = axes.imshow(shades, cmap="YlOrBr", aspect="auto")
        for (row, column), error in np.ndenumerate(values):
            red, green, blue, _ = image.to_rgba(shades[row, column])
            # The shades are the same on a dark page, so the ink does not follow the page.
            ink = "black" if 0.2126 * red**2.2 + 0.7152 * green**2.2 + 0.0722 * blue**2.2 > 0.18 else "white"
            axes.text(column, row, f"{error:.2f}", ha="center", va="center", fontsize=8, color=ink)
        axes.set_xticks(range(len(across)), across, rotation=40, ha="right", rotation_mode="anchor")
        axes.set_yticks(range(len(down)), down)
        axes.tick_params(length=0)
        axes.spines[:].set_visible(False)
        axes.set_title("RMSE [mm]", loc="left")
    return figure


def foreign_figure(study: ForeignStudy) -> Figure:
    """Draw the errors of PTX and of its best rivals, a panel for each plant."""
    plants = list(dict.fromkeys(row.plant for row in study.rows))
    with style():
        figure = Figure(figsize=(WIDTH, 0.9 + 1.0 * len(plants)), layout="constrained")
        panels = figure.subplots(len(plants), 1, sharex=True, squeeze=False)[:, 0]
        for axes, plant in zip(panels, plants, strict=True):
            rows = [row for row in study.rows if row.plant == plant]
            places = np.arange(len(rows))
            for marker, colour, label, errors in (
                ("s", ORANGE, "best CPX or PX", [row.rival[1] for row in rows]),
                ("|", RED, "best of those trained on the record too", [row.favoured[1] for row in rows]),
                ("o", SKY, "PTX without effects", [row.plain for row in rows]),
                ("o", BLUE, "PTX", [row.error for row in rows]),
            ):
                axes.plot(errors, places, marker, color=colour, label=label, markersize=6)
            axes.set_yticks(places, [row.record for row in rows], fontsize=7)
            axes.set_ylim(len(rows) - 0.5, -0.5)
            axes.set_title(plant, loc="left", fontsize=8)
            axes.grid(True, linewidth=0.4, color=GRID)
        panels[-1].set_xlim(left=0.0)
        panels[-1].set_xlabel("RMSE on the held-out record [mm]")
        figure.legend(*panels[0].get_legend_handles_labels(), loc="outside upper center", ncols=2)
    return figure


def interval_figure(study: IntervalStudy) -> Figure:
    """Draw a part of each record with its interval."""
    said = study.predictions()
    with style():
        figure = Figure(figsize=(WIDTH, 0.7 + 1.2 * len(said.records)), layout="constrained")
        panels = figure.subplots(len(said.records), 2, squeeze=False, sharex="col", sharey="col")
        for k, run in enumerate(study.data.experiments):
            # The middle of the record, with the position on the left and the error on the right.
            begin = max(0, (run.n_samples - _SHOWN) // 2)
            part = slice(begin, begin + _SHOWN)
            measured = run.values["position"][part]
            time = 1e3 * study.data.sampling_time * np.arange(measured.size)
            for axes, level in zip(panels[k], (np.zeros(measured.size), said.position[k][part]), strict=True):
                lower, upper = said.lower[k][part] - level, said.upper[k][part] - level
                axes.fill_between(time, lower, upper, color=SKY, alpha=0.6, linewidth=0, label="interval")
                axes.plot(time, measured - level, color=INK, linewidth=0.5, label="measured")
                axes.grid(True, linewidth=0.4, color=GRID)
                axes.margins(x=0.01)
            panels[k, 0].set_title(run.name, loc="left", fontsize=8)
        for axes, title in zip(panels[0], ("position [mm]", "position less sensor [mm]"), strict=True):
            axes.set_title(title, loc="right", fontsize=8)
        for axes in panels[-1]:
            axes.set_xlabel("time [ms]")
        figure.legend(*panels[0, 0].get_legend_handles_labels(), loc="outside upper center", ncols=2)
    return figure
