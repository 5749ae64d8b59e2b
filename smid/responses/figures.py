"""Figures of certified bands and of projections of the feasible set."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.figure import Figure

from smid.display.style import BLUE, GRID, INK, SKY, WIDTH, style

if TYPE_CHECKING:
    from smid.responses.band import Band, ResponseBand


def band_figure(response: ResponseBand) -> Figure:
    """Draw each band: certified (light), verified (dark) and the central model (line)."""
    with style():
        figure = Figure(figsize=(WIDTH, 0.8 + 1.9 * len(response.bands)), layout="constrained")
        rows = figure.subplots(len(response.bands), 1, sharex=True, squeeze=False)[:, 0]
        for axes, band in zip(rows, response.bands, strict=True):
            finite = np.isfinite(band.lower) & np.isfinite(band.upper)
            # What is infinite has no place on the axes: a gap.
            for low, high, colour, label in (
                (band.lower, band.upper, SKY, "certified"),
                (band.inner_lower, band.inner_upper, BLUE, "verified"),
            ):
                axes.fill_between(response.at, low, high, where=finite, color=colour, linewidth=0, label=label)
            axes.plot(response.at, band.centre, color=INK, label="central model")
            axes.set_ylabel(band.label)
            axes.grid(True, which="both", linewidth=0.4, color=GRID)
            axes.set_axisbelow(True)
            axes.margins(x=0.01)
            if response.kind == "bode":
                axes.set_xscale("log")
            if band.quantity == "gain" and _all_positive(band):
                axes.set_yscale("log")
        rows[-1].set_xlabel(f"{response.axis} [{response.axis_unit}]")
        figure.align_ylabels()
        handles, labels = rows[0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside upper center", ncols=3)
    return figure


def _all_positive(band: Band) -> bool:
    return bool((band.lower[np.isfinite(band.lower)] > 0).all())
