"""The figures of the arm: 1/J of the runs, friction curves, motions, and the filter's response."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator
from numpy.typing import ArrayLike

from smid.display.style import BLUE, GREEN, GRID, INK, ORANGE, RED, SKY, WIDTH, style
from smid.theses.hybrid.arm.embedded_arm import true_friction
from smid.theses.hybrid.arm.exact_motion import ARM

if TYPE_CHECKING:
    from smid.signals import ModulatingFilter
    from smid.theses.hybrid.arm.arm_study import NetworkRuns
    from smid.theses.hybrid.arm.embedded_study import EmbeddedStudy
    from smid.theses.hybrid.arm.traces import Trace

__all__ = ["alternating_figure", "friction_figure", "inertia_figure", "response_figure", "trace_figure"]

CEILING = 30.0  # of 1/J, where bad runs are drawn that end beyond
COLUMNS = 2
COLOURS = (BLUE, ORANGE, GREEN, RED, SKY)


def inertia_figure(study: EmbeddedStudy) -> Figure:
    """Draw 1/J of every run, as figures F.3 and F.7; runs outside 0 to 30 / (kg m2) are drawn at the edge."""
    rows = -(-len(study.runs) // COLUMNS)
    with style():
        figure = Figure(figsize=(WIDTH, 0.4 + 1.5 * rows), layout="constrained")
        grid = figure.subplots(rows, COLUMNS, sharex=True, sharey=True, squeeze=False)
        for axes, runs in zip(grid.flat, study.runs, strict=False):
            number, theta = np.arange(runs.theta.size), np.clip(runs.theta, 0.0, CEILING)
            middle = ~(runs.good | runs.bad)
            axes.axhline(ARM["theta"], color=INK, linewidth=0.6, zorder=0)
            for chosen, marker, colour, label in (
                (runs.good, "o", BLUE, "good"),
                (middle, "s", ORANGE, "moderate"),
                (runs.bad, "x", RED, "bad"),
            ):
                axes.plot(number[chosen], theta[chosen], marker, markersize=2.6, color=colour, label=label)
            axes.set_title(f"{runs.input.replace('_', ' ')}: {runs.way}")
            axes.set_ylim(-1.0, CEILING + 1.0)
        for axes in grid.flat[len(study.runs) :]:
            axes.set_axis_off()
        for axes in grid[-1]:
            axes.set_xlabel("run")
        for row in grid:
            row[0].set_ylabel("1/J [1/(kg m²)]")
        handles, labels = grid[0, 0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside lower center", ncols=3)
    return figure


def alternating_figure(runs: NetworkRuns, band: tuple[float, float]) -> Figure:
    """Draw 1/J of every seed, as figure F.12, with the thesis's range."""
    with style():
        figure = Figure(figsize=(WIDTH, 2.4), layout="constrained")
        axes = figure.subplots()
        axes.axhspan(*band, color=SKY, alpha=0.4, linewidth=0.0)
        axes.axhline(ARM["theta"], color=INK, linewidth=0.6)
        axes.plot(np.arange(runs.theta.size), runs.theta, "o", markersize=2.6, color=BLUE)
        axes.xaxis.set_major_locator(MaxNLocator(integer=True))
        axes.set(xlabel="seed", ylabel="1/J [1/(kg m²)]")
    return figure


def friction_figure(curves: Mapping[str, ArrayLike], speed: ArrayLike) -> Figure:
    """Draw networks and the plant's friction, figure 6.8: all speeds, and those near rest.

    Parameters
    ----------
    curves
        Shape (n,). Torques in Nm by label.
    speed
        Shape (n,). In rad/s, rising.
    """
    v = np.asarray(speed, dtype=np.float64)
    with style():
        figure = Figure(figsize=(WIDTH, 2.8), layout="constrained")
        whole, near = figure.subplots(1, 2)
        for axes in (whole, near):
            axes.plot(v, true_friction(v), color=INK, linewidth=2.4, alpha=0.3, label="plant")
            for (label, torque), colour in zip(curves.items(), COLOURS, strict=False):
                axes.plot(v, np.asarray(torque), color=colour, label=label)
            axes.grid(color=GRID, linewidth=0.4)
            axes.set_xlabel("speed [rad/s]")
        near.set(xlim=(-8, 8), ylim=(-2.2, 2.2), title="near rest")
        whole.set(ylabel="friction and drag [Nm]", title="visited speeds")
        whole.legend()
    return figure


def response_figure(modulating: ModulatingFilter, sampling_time: float) -> Figure:
    """Draw the magnitude of a modulating filter as smoother and differentiator, with ideal ones dashed."""
    omega = np.linspace(0.0, np.pi / sampling_time, 1001)[1:-1]
    with style():
        figure = Figure(figsize=(WIDTH, 3.0), layout="constrained")
        axes = figure.subplots()
        for order, colour in zip(range(modulating.order), COLOURS, strict=False):
            axes.plot(omega, omega**order, color=colour, linestyle="--", linewidth=0.7)
            size = np.abs(modulating.response(omega, sampling_time, order))
            axes.plot(omega, np.maximum(size, 1e-6), color=colour, label=f"derivative {order}")
        axes.set(xscale="log", yscale="log", xlabel="frequency [rad/s]", ylabel="gain [1/s per derivative]")
        axes.set_ylim(1e-3, None)
        axes.grid(color=GRID, linewidth=0.4)
        axes.legend(title="ideal dashed")
    return figure


def trace_figure(traces: Mapping[str, Trace]) -> Figure:
    """Draw for each embedded arm its motions beside the plant's, and its network with the single neurons."""
    count = len(next(iter(traces.values())).motions)
    with style():
        figure = Figure(figsize=(WIDTH, 0.3 + 1.4 * (count + 1)), layout="constrained")
        panels = figure.subplots(count + 1, len(traces), squeeze=False)
        for column, (label, trace) in zip(panels.T, traces.items(), strict=True):
            for axes, (name, (time, plant, model)) in zip(column, trace.motions.items(), strict=False):
                axes.plot(time, plant, color=INK, linewidth=2.4, alpha=0.3, label="plant")
                axes.plot(time, model, color=BLUE, label="embedded arm")
                axes.set(xlabel="time [s]", ylabel="angle [rad]")
                axes.set_title(name, loc="left", fontsize=7)
            column[0].set_title(f"{label}\n{next(iter(trace.motions))}", loc="left", fontsize=7)
            axes = column[-1]
            axes.plot(trace.speed, true_friction(trace.speed), color=INK, linewidth=2.4, alpha=0.3)
            for k, neuron in enumerate(trace.neurons):
                axes.plot(trace.speed, neuron, color=ORANGE, linewidth=0.6, label=None if k else "single neurons")
            axes.plot(trace.speed, trace.network, color=BLUE)
            reach = 1.5 * np.abs(true_friction(trace.speed)).max()
            axes.set(xlabel="speed [rad/s]", ylabel="torque [Nm]", ylim=(-reach, reach))
        for axes in panels.flat:
            axes.grid(color=GRID, linewidth=0.4)
        drawn = {
            label: line
            for axes in (panels[0, 0], panels[-1, 0])
            for line, label in zip(*axes.get_legend_handles_labels(), strict=True)
        }
        figure.legend(list(drawn.values()), list(drawn), loc="outside lower center", ncols=3)
    return figure
