"""Figures of hybrid models."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.figure import Figure

from smid.display.style import INK, RED, WIDTH, style

if TYPE_CHECKING:
    from smid.hybrid.cost_surface import CostSurface

__all__ = ["surface_figure"]


def surface_figure(surface: CostSurface) -> Figure:
    """Return a figure of a cost surface: the surface in three dimensions, and contours with the minimum."""
    one, two = surface.names
    height = np.log10(np.where(np.isfinite(surface.rmse), surface.rmse, np.nan))
    across, along = np.meshgrid(surface.second, surface.first)
    with style():
        figure = Figure(figsize=(WIDTH, 2.9))
        # Surface, placed by hand: constrained layout cuts the labels of three-dimensional axes.
        space: Any = figure.add_axes((0.02, 0.14, 0.46, 0.76), projection="3d")
        space.plot_surface(along, across, height, cmap="viridis", linewidth=0.0, rcount=80, ccount=80)
        space.set(title="log10 of the RMS error", xlabel=one, ylabel=two)
        space.view_init(elev=38, azim=-60)
        space.tick_params(labelsize=8)
        for axis in (space.xaxis, space.yaxis, space.zaxis):
            axis.set_pane_color("none")  # light panes are visible on a dark page
        # Contours.
        flat = figure.add_axes((0.62, 0.16, 0.36, 0.7))
        flat.contourf(along, across, height, levels=24, cmap="viridis")
        flat.plot(*surface.least, "o", markersize=4, color=RED, markeredgecolor=INK, markeredgewidth=0.5)
        flat.set(xlabel=one, ylabel=two, title=f"minimum: {surface.rmse.min():.3g}")
    return figure
