"""The figure of the widths of intervals over the noise bound."""

from __future__ import annotations

from matplotlib.figure import Figure

from smid.display.style import GRID, RED, WIDTH, style
from smid.study.widths import WidthStudy

__all__ = ["width_figure"]


def width_figure(study: WidthStudy) -> Figure:
    """Draw the widths over the noise bound, in percent of the centre at the largest bound, and the least bound."""
    bounds = [study.noise_bound(k) for k in range(len(study.factors))]
    with style():
        figure = Figure(figsize=(WIDTH, 2.6), layout="constrained")
        axes = figure.subplots()
        for name, marker in zip(study.names, "os^vDP", strict=False):
            centre = abs(study.estimates[-1][name].centre)
            widths = [100 * estimate[name].width / centre for estimate in study.estimates]
            axes.semilogy(bounds, widths, marker=marker, markersize=4, label=name)
        axes.axvline(study.least.upper, color=RED, linestyle="--", linewidth=0.8, label="least noise bound")
        axes.set_xlabel(f"noise bound [{study.least.unit}]")
        axes.set_ylabel("width [% of the centre]")
        axes.grid(True, linewidth=0.4, color=GRID)
        axes.margins(x=0.01)
        axes.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0))
    return figure
