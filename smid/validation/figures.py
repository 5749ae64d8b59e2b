"""Figures of free runs and measured outputs, and of the tests of residuals."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from smid.display.style import BLUE, GREEN, GRID, INK, ORANGE, RED, SKY, WIDTH, style
from smid.signals.figures import draw_coherence, draw_density

if TYPE_CHECKING:
    from smid.validation.compare import Comparison
    from smid.validation.correlation import Correlation
    from smid.validation.fit import ModelFit
    from smid.validation.residuals import Residuals
    from smid.validation.scores import Validation

_COLOURS, _STROKES = (BLUE, ORANGE, GREEN, RED, SKY), ("-", "--", "-.", ":")


def simulation_figure(validation: Validation | ModelFit, number: int = 0) -> Figure:
    """Return a figure of measured output, free run and error, with the noise bound if there is one."""
    score = validation.scores[number]
    k = validation.experiment(number)
    time = validation.data.time(k)
    measured = validation.data.values(score.channel, k)
    simulated = validation.simulated[k][score.channel]
    unit = f" [{score.unit}]" if score.unit else ""
    with style():
        figure = Figure(figsize=(WIDTH, 3.3), layout="constrained")
        top, below = figure.subplots(2, 1, sharex=True, height_ratios=(2, 1))
        # Noise bound: a band around the free run, lines and marked violations in the error.
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
            outside = np.abs(validation.error(number)) > bound
            if outside.any():
                below.plot(time[outside], error[outside], color=RED, marker=".", markersize=3, linestyle="")
        # Signals, axes and one legend for both axes.
        top.plot(time, simulated, color=BLUE, label="free run")
        top.plot(time, measured, color=INK, linestyle="", marker=".", markersize=1.8, label="measured")
        below.plot(time, error, color=INK, linewidth=0.6)
        top.set_ylabel(f"{score.channel}{unit}")
        below.set_ylabel(f"error{unit}")
        below.set_xlabel("time [s]")
        _frame(figure, top, below)
        handles, labels = top.get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside upper center", ncols=3)
    return figure


def comparison_figure(comparison: Comparison, number: int = 0) -> Figure:
    """Return a figure of the measured output and all free runs, with the errors below; the best one lies on top."""
    first = next(iter(comparison.validations.values()))
    score, k = first.scores[number], first.experiment(number)
    time, measured = comparison.data.time(k), comparison.data.values(score.channel, k)
    unit = f" [{score.unit}]" if score.unit else ""
    with style():
        figure = Figure(figsize=(WIDTH, 3.6), layout="constrained")
        top, below = figure.subplots(2, 1, sharex=True, height_ratios=(2, 1))
        top.plot(time, measured, color=INK, linewidth=2.2, alpha=0.3, label="measured")
        for rank, (name, run) in enumerate(comparison.validations.items()):
            look = {
                "color": _COLOURS[rank % len(_COLOURS)],
                "linestyle": _STROKES[rank % len(_STROKES)],
                "zorder": 3 - 0.01 * rank,
            }
            simulated = run.simulated[k][score.channel]
            top.plot(time, simulated, label=f"{name} ({run.scores[number].fit_percent:.1f} %)", **look)
            below.plot(time, measured - simulated, linewidth=0.7, **look)
        top.set_ylabel(f"{score.channel}{unit}")
        below.set_ylabel(f"error{unit}")
        below.set_xlabel("time [s]")
        _frame(figure, top, below)
        figure.legend(*top.get_legend_handles_labels(), loc="outside upper center", ncols=3)
    return figure


def residuals_figure(residuals: Residuals, number: int = 0) -> Figure:
    """Return a figure of the residual, its correlations, spectrum and coherences, for the output of this number."""
    found, spectrum = residuals.outputs[number], residuals.spectrum
    tests = (found.own, *found.with_inputs)
    unit = f" [{found.unit}]" if found.unit else ""
    with style():
        rows = 1 + len(tests)
        figure = Figure(figsize=(WIDTH, 1.6 * rows), layout="constrained")
        grid = figure.add_gridspec(rows, 2)
        # Over time, one experiment after the other.
        panel = figure.add_subplot(grid[0, :])
        runs, step = residuals.errors.experiments, found.sampling_time
        start = runs[0].start_time if len(runs) == 1 else 0.0
        for run in runs:
            time = start + step * np.arange(run.n_samples)
            panel.plot(time, run.values[found.channel], color=INK, linewidth=0.6)
            start = float(time[-1]) + step
        panel.grid(True, linewidth=0.4, color=GRID)
        panel.margins(x=0.01)
        panel.set_ylabel(f"residual of\n{found.channel}{unit}")
        panel.set_xlabel("time [s]" if len(runs) == 1 else "time, one experiment after the other [s]")
        # Correlations on the left; spectrum and coherences on the right.
        for k, one in enumerate(tests):
            left = figure.add_subplot(grid[1 + k, 0])
            draw_correlation(left, one, step, BLUE)
            left.set_ylabel(f"with {one.against}" if one.against else "with its past")
        right = figure.add_subplot(grid[1, 1])
        level = float(np.mean(spectrum.density[found.channel]))
        low, high = spectrum.white
        right.axhspan(level * low, level * high, color=SKY, alpha=0.3, linewidth=0)
        draw_density(right, spectrum, found.channel, BLUE)
        right.set_xlabel("frequency [Hz]")
        for k, one in enumerate(found.with_inputs):
            right = figure.add_subplot(grid[2 + k, 1])
            draw_coherence(right, spectrum, (one.against, found.channel))
            right.set_xlabel("frequency [Hz]")
    return figure


def draw_correlation(axes: Axes, found: Correlation, step: float, colour: str) -> None:
    """Draw a correlation over the lag in seconds, with its 99 % band."""
    lags = step * found.lags
    axes.axhspan(-found.band, found.band, color=SKY, alpha=0.3, linewidth=0)
    axes.vlines(lags, 0, found.values, color=colour, linewidth=1.2)
    axes.axhline(0, color=INK, linewidth=0.6)
    axes.set_ylim(-1, 1)
    axes.set_xlabel("lag [s]")


def _frame(figure: Figure, *panels: Axes) -> None:
    for axes in panels:
        axes.grid(True, linewidth=0.4, color=GRID)
        axes.margins(x=0.01)
    figure.align_ylabels()
