"""Figures of hybrid models."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.figure import Figure

from smid.display.style import BLUE, INK, RED, SKY, WIDTH, style

if TYPE_CHECKING:
    from smid.hybrid.cost_surface import CostSurface
    from smid.hybrid.learned_curve import LearnedCurve
    from smid.hybrid.read_law import ReadLaw

__all__ = ["curve_figure", "surface_figure"]


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


def curve_figure(curve: LearnedCurve, law: ReadLaw | None = None) -> Figure:
    """Return a figure of a learned curve, with a band of two standard deviations and the law that was read."""
    with style():
        figure = Figure(figsize=(WIDTH, 2.9), layout="constrained")
        axes = figure.subplots()
        if np.isfinite(curve.deviation).all():
            low, high = curve.y - 2 * curve.deviation, curve.y + 2 * curve.deviation
            axes.fill_between(curve.x, low, high, color=SKY, alpha=0.45, linewidth=0, label="± 2 standard deviations")
        axes.plot(curve.x, curve.y, color=BLUE, label=f"network {curve.network}")
        if law is not None:
            axes.plot(curve.x, law(curve.x), color=RED, linestyle="--", label=" + ".join(law.names))
        axes.set(xlabel=f"x = {curve.argument}", ylabel="output of the network")
        axes.legend()
    return figure
