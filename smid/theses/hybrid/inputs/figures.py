"""The figure of the arm's inputs."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.figure import Figure

from smid.display.style import BLUE, INK, ORANGE, WIDTH, style
from smid.theses.hybrid.arm.exact_motion import ARM
from smid.theses.hybrid.arm.proven import CONSTANTS, is_told

if TYPE_CHECKING:
    from smid.theses.hybrid.inputs.input_study import InputStudy

__all__ = ["intervals_figure"]

TITLES = {"theta": "1/J", "b": "b", "Wd": "Wd", "Ws": "Ws"}


def intervals_figure(study: InputStudy) -> Figure:
    """Draw the intervals of each constant relative to the true value, one line per input."""
    rows = study.rows
    with style():
        figure = Figure(figsize=(1.35 * WIDTH, 0.8 + 0.24 * len(rows)), layout="constrained")
        axes = figure.subplots(1, len(CONSTANTS), sharey=True)
        places = np.arange(len(rows))[::-1]
        for axis, name in zip(axes, CONSTANTS, strict=True):
            ends = np.array([(row.arm[name].lower, row.arm[name].upper) for row in rows])
            if name == "Ws":
                axis.set_xscale("log")
                axis.set_xlabel("Ws [Nm]")
                axis.axvline(ARM[name], color=INK, linewidth=0.6)
            else:
                ends = 100 * (ends / ARM[name] - 1)
                axis.set_xlabel(f"{TITLES[name]}: off by [%]")
                axis.axvline(0, color=INK, linewidth=0.6)
            colours = [BLUE if is_told(row.arm[name]) else ORANGE for row in rows]
            axis.hlines(places, ends[:, 0], ends[:, 1], colors=colours, linewidth=4)
        axes[0].set_yticks(places, [row.name for row in rows])
    return figure
