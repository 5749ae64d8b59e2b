"""The figure of a sensor on records."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.figure import Figure

from smid.data import Channel
from smid.display.style import GRID, INK, SKY, WIDTH, style

if TYPE_CHECKING:
    from smid.sensors.check import SensorCheck

__all__ = ["check_figure"]

_SHOWN = 2000  # samples of a record
_MOST = 8  # records


def check_figure(check: SensorCheck) -> Figure:
    """Draw the first samples of each record with the interval on the left, and less the sensor on the right."""
    runs = check.data.experiments[:_MOST]
    output = check.output
    with style():
        figure = Figure(figsize=(WIDTH, 0.7 + 1.3 * len(runs)), layout="constrained")
        panels = figure.subplots(len(runs), 2, squeeze=False, sharey="col")
        for k, run in enumerate(runs):
            measured = check.prediction.prediction.measured(check.data)[k][:_SHOWN]
            time = check.data.sampling_time * np.arange(measured.size)
            said = check.prediction.position[k][:_SHOWN]
            for axes, level in zip(panels[k], (np.zeros(measured.size), said), strict=True):
                low, high = check.prediction.lower[k][:_SHOWN] - level, check.prediction.upper[k][:_SHOWN] - level
                axes.fill_between(time, low, high, color=SKY, alpha=0.6, linewidth=0, label="interval")
                axes.plot(time, measured - level, color=INK, linewidth=0.5, label="measured")
                axes.grid(True, linewidth=0.4, color=GRID)
                axes.margins(x=0.01)
            panels[k, 0].set_title(run.name, loc="left", fontsize=8)
        shown = str(Channel(output.name, output.unit))
        for axes, title in zip(panels[0], (shown, f"{shown} less sensor"), strict=True):
            axes.set_title(title, loc="right", fontsize=8)
        for axes in panels[-1]:
            axes.set_xlabel("time [s]")
        figure.legend(*panels[0, 0].get_legend_handles_labels(), loc="outside upper center", ncols=2)
    return figure
