"""The figure of the bundled records: a panel for each."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from smid.data import Dataset
from smid.display.style import BLUE, GREEN, GRID, INK, WIDTH, style

__all__ = ["overview_figure"]

_COLUMNS = 2
_COLOURS = {"current": INK, "pressure": BLUE, "position": GREEN}


def overview_figure(data: Dataset) -> Figure:
    """Draw current, pressure and position of each record, in percent of the largest value of all records."""
    largest = {name: float(np.abs(data.stacked(name)).max()) or 1.0 for name in _COLOURS}
    rows = -(-len(data.experiments) // _COLUMNS)
    with style():
        figure = Figure(figsize=(WIDTH, 0.6 + 1.2 * rows), layout="constrained")
        panels = figure.subplots(rows, _COLUMNS, sharex=True, sharey=True, squeeze=False)
        for axes in panels.flat[len(data.experiments) :]:
            axes.set_axis_off()
        for k, (axes, run) in enumerate(zip(panels.flat, data.experiments, strict=False)):
            for name, colour in _COLOURS.items():
                label = f"{name} (largest: {largest[name]:.3g} {data.channel(name).unit})"
                axes.plot(data.time(k), 100 * run.values[name] / largest[name], color=colour, label=label)
            axes.set_title(run.name, loc="left", fontsize=8)
            axes.grid(True, linewidth=0.4, color=GRID)
            axes.margins(x=0.01)
        for axes in panels[-1]:
            axes.set_xlabel("time [s]")
        figure.supylabel("% of the largest value", fontsize=8)
        handles, labels = panels[0, 0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside upper center", ncols=len(_COLOURS))
    return figure
