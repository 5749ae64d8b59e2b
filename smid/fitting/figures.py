"""Figure of a free run and the measured output."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.figure import Figure

from smid.display.style import BLUE, GRID, INK, RED, SKY, WIDTH, style
from smid.fitting.validate import scored_samples

if TYPE_CHECKING:
    from smid.fitting.validate import Validation


def simulation_figure(validation: Validation, number: int = 0) -> Figure:
    """Return a figure of measured output, free run and error, with the noise bound if there is one."""
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
            scored = scored_samples(validation.model, validation.data, k, score.channel, simulated)
            outside = (np.abs(error) > bound) & scored
            if outside.any():
                below.plot(time[outside], error[outside], color=RED, marker=".", markersize=3, linestyle="")
        # Signals, axes and one legend for both axes.
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
