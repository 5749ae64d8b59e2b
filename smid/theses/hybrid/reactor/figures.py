"""The figures of the reactor studies."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.figure import Figure

from smid.display.style import BLUE, GREEN, GRID, INK, ORANGE, RED, SKY, WIDTH, style
from smid.hybrid.estimate import ERRORS
from smid.theses.hybrid.reactor.records import SAMPLING_TIME, SIGNALS, reactor_record

if TYPE_CHECKING:
    from smid.theses.hybrid.reactor.conditions import OtherConditions
    from smid.theses.hybrid.reactor.output_errors import OutputErrors
    from smid.theses.hybrid.reactor.requirements import RequirementStudy

__all__ = ["mismatch_figure", "output_error_figure", "records_figure", "requirement_figure", "training_figure"]

_TITLES = {"prediction": "trained one step ahead", "simulation": "trained in free run"}
_COLOURS = (RED, BLUE, ORANGE, SKY, GREEN, INK)
_SMALLEST, _LARGEST = 1e-6, 10.0
_ACROSS = 3  # panels
_SHOWN = 100  # s, of figure 6.1
_DRAWN = {"first principles": "--", "series, extra": "-", "parallel, as analysed": ":", "network alone": "-."}


def records_figure(plant: str) -> Figure:
    """Draw input and output of a plant under each of the thesis's inputs, as in figure 6.1."""
    rows = -(-len(SIGNALS) // _ACROSS)
    with style():
        figure = Figure(figsize=(WIDTH, 0.4 + 1.6 * rows), layout="constrained")
        panels = figure.subplots(rows, _ACROSS, sharex=True, sharey=True)
        for axes in panels.flat[len(SIGNALS) :]:
            axes.set_axis_off()
        for axes, signal in zip(panels.flat, SIGNALS, strict=False):
            record = reactor_record(plant, signal)
            time = SAMPLING_TIME * np.arange(record.n_samples)
            axes.step(time, record.values("u"), where="post", color=ORANGE, linewidth=0.9, label="input")
            axes.plot(time, record.values("y"), color=BLUE, label="output")
            axes.set_title(signal.replace("_", " ").replace("qprts", "QPRTS"), loc="left", fontsize=8)
            axes.set(xlim=(0, _SHOWN))
            axes.grid(True, linewidth=0.4, color=GRID)
        for axes in panels.flat[len(SIGNALS) - _ACROSS : len(SIGNALS)]:
            axes.set_xlabel("time [s]")
            axes.tick_params(labelbottom=True)
        figure.supylabel("concentration [mol/m³]", fontsize=8)
        handles, labels = panels[0, 0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside upper center", ncols=2)
    return figure


def output_error_figure(study: OutputErrors) -> Figure:
    """Draw the largest output errors of every plant."""
    from smid.theses.hybrid.reactor.output_errors import AXIS, CELLS

    count = len(study.plants)
    with style():
        figure = Figure(figsize=(WIDTH, 1.1 + 0.34 * count), layout="constrained")
        panels = figure.subplots(1, len(ERRORS), sharex=True, sharey=True)
        for axes, error in zip(panels, ERRORS, strict=True):
            axes.axvline(AXIS, color=GRID, linewidth=0.9)
            for k, (column, colour) in enumerate(zip(CELLS, _COLOURS, strict=True)):
                places = np.arange(count) + 0.13 * (k - 2.5)
                values = np.clip(study.largest[error, column], _SMALLEST, _LARGEST)
                axes.plot(values, places, "o", color=colour, markersize=4, label=column)
            axes.plot(study.alone, np.arange(count), "|", color=INK, markersize=12, label="first principles alone")
            axes.set_xscale("log")
            axes.set_title(_TITLES[error], loc="left")
            axes.grid(True, axis="x", linewidth=0.4, color=GRID)
            axes.set_xlabel("largest output error [mol/m³]")
        panels[0].set_yticks(np.arange(count), [plant.replace("_", " ") for plant in study.plants])
        panels[0].set_ylim(count - 0.5, -0.5)
        handles, labels = panels[0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside upper center", ncols=3)
    return figure


def requirement_figure(study: RequirementStudy) -> Figure:
    """Draw the learned and the required responses of networks trained in free run."""
    from smid.theses.hybrid.reactor.output_errors import CELLS

    colours = dict(zip(CELLS, _COLOURS, strict=True))
    shown = [item for item in study.learned if item.error == "simulation"]
    plants = list(dict.fromkeys(item.plant for item in shown))
    topologies = list(dict.fromkeys(item.requirement.topology for item in shown))
    with style():
        figure = Figure(figsize=(WIDTH, 0.7 + 1.5 * len(plants)), layout="constrained")
        panels = figure.subplots(len(plants), len(topologies), sharex=True, squeeze=False)
        drawn = {}
        for item in shown:
            axes = panels[plants.index(item.plant), topologies.index(item.requirement.topology)]
            time = SAMPLING_TIME * np.arange(item.response.size)
            (line,) = axes.plot(time, item.response, color=colours[item.column], label=item.column, zorder=3)
            (wanted,) = axes.plot(time, item.wanted, "o", color=INK, markersize=2.2, label="required", zorder=2)
            drawn.update({item.column: line, "required": wanted})
            axes.set_title(f"{item.plant.replace('_', ' ')}, {item.requirement.topology}", loc="left", fontsize=8)
            axes.grid(True, linewidth=0.4, color=GRID)
        for axes in panels[-1]:
            axes.set_xlabel("time [s]")
        figure.supylabel("output of the network [mol/m³]", fontsize=8)
        figure.legend(list(drawn.values()), list(drawn), loc="outside upper center", ncols=3)
    return figure


def training_figure(study: OtherConditions) -> Figure:
    """Draw plant, first principles, network and hybrid model of figure 6.2, by training record."""
    with style():
        rows = -(-len(study.runs) // _ACROSS)
        figure = Figure(figsize=(WIDTH, 0.4 + 2.0 * rows), layout="constrained")
        panels = figure.subplots(rows, _ACROSS, sharex=True, sharey=True, squeeze=False)
        for axes in panels.flat[len(study.runs) :]:
            axes.set_axis_off()
        for axes, (training, (plant, white, hybrid)) in zip(panels.flat, study.runs.items(), strict=False):
            time = SAMPLING_TIME * np.arange(plant.size)
            axes.plot(time, plant, color=INK, linewidth=2.4, alpha=0.3, label="plant")
            axes.plot(time, white, color=ORANGE, linestyle="--", label="first principles")
            axes.plot(time, hybrid - white, color=GREEN, linestyle=":", label="network")
            axes.plot(time, hybrid, color=BLUE, label="hybrid")
            axes.set_title(training, loc="left", fontsize=8)
            axes.set(xlabel="time [s]", xlim=(0, 30))
            axes.grid(True, linewidth=0.4, color=GRID)
        for axes in panels.flat[max(0, len(study.runs) - _ACROSS) : len(study.runs)]:
            axes.tick_params(labelbottom=True)
        figure.supylabel("concentration [mol/m³]", fontsize=8)
        handles, labels = panels[0, 0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside upper center", ncols=4)
    return figure


def mismatch_figure(study: OutputErrors) -> Figure:
    """Draw plant, first principles and the models with enough back couplings under a constant, for each mismatch."""
    rows = -(-len(study.plants) // _ACROSS)
    with style():
        figure = Figure(figsize=(WIDTH, 0.6 + 1.5 * rows), layout="constrained")
        panels = figure.subplots(rows, _ACROSS, sharex=True, squeeze=False)
        for axes in panels.flat[len(study.plants) :]:
            axes.set_axis_off()
        for axes, plant in zip(panels.flat, study.plants, strict=False):
            runs = study.runs[plant]
            time = SAMPLING_TIME * np.arange(runs["plant"].size)
            axes.plot(time, runs["plant"], color=INK, linewidth=2.4, alpha=0.3, label="plant")
            for (label, dash), colour in zip(_DRAWN.items(), (ORANGE, BLUE, GREEN, RED), strict=True):
                axes.plot(time, runs[label], dash, color=colour, linewidth=0.9, label=label)
            axes.set_title(plant.replace("_", " "), loc="left", fontsize=8)
            axes.set(xlim=(0, 30))
            axes.grid(True, linewidth=0.4, color=GRID)
        for axes in panels.flat[max(0, len(study.plants) - _ACROSS) : len(study.plants)]:
            axes.set_xlabel("time [s]")
            axes.tick_params(labelbottom=True)
        figure.supylabel("concentration [mol/m³]", fontsize=8)
        handles, labels = panels[0, 0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside upper center", ncols=3)
    return figure
