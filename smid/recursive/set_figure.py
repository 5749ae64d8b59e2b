"""The figure of a recursive set: intervals over time, the true parameters if known, and the certified changes."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import ArrayLike

from relaxations.algebra.arrays import Array
from smid.data import DataError
from smid.display.style import BLUE, GRID, INK, RED, SKY, WIDTH, style
from smid.recursive.set_history import SetHistory

__all__ = ["set_figure"]

_WIDE = 10.0
"""Intervals wider than this multiple of the median width do not set the axis limits."""


def set_figure(history: SetHistory, truth: ArrayLike | None, sampling_time: float | None) -> Figure:
    """Draw the certified intervals over time; raise `DataError` if the truth is not of shape (n,) or (N, n)."""
    samples, n = history.lower.shape
    known = None if truth is None else np.asarray(truth, dtype=np.float64)
    if known is not None and known.shape not in ((n,), (samples, n)):
        raise DataError(f"the truth has shape {known.shape}: give ({n},) for constant parameters, or ({samples}, {n})")
    step = 1.0 if sampling_time is None else sampling_time
    time = step * np.arange(samples)
    with style():
        figure = Figure(figsize=(WIDTH, 0.5 + 1.25 * n), layout="constrained")
        panels = figure.subplots(n, 1, sharex=True, squeeze=False)[:, 0]
        # One panel for each parameter: interval, truth, changes.
        for k, panel in enumerate(panels):
            lower, upper = history.lower[:, k], history.upper[:, k]
            panel.fill_between(time, lower, upper, color=SKY, alpha=0.45, linewidth=0, step="post", label="certified")
            for end in (lower, upper):
                panel.step(time, end, where="post", color=BLUE, linewidth=0.7)
            if known is not None:
                values = np.broadcast_to(known, (samples, n))[:, k]
                panel.step(time, values, where="post", color=INK, linewidth=0.9, linestyle="--", label="truth")
            for change in history.changes:
                panel.axvline(step * change.sample, color=RED, linewidth=1.0, label="certified change")
            _limit(panel, lower, upper, None if known is None else np.atleast_2d(known)[:, k])
            panel.set_ylabel(history.names[k])
            panel.grid(True, linewidth=0.4, color=GRID)
            panel.margins(x=0.01)
        # One legend for all panels, each label once.
        panels[-1].set_xlabel("sample" if sampling_time is None else "time [s]")
        figure.align_ylabels()
        handles, labels = panels[0].get_legend_handles_labels()
        once = dict(zip(labels, handles, strict=True))
        figure.legend(once.values(), once.keys(), loc="outside upper center", ncols=3)
    return figure


def _limit(panel: Axes, lower: Array, upper: Array, truth: Array | None) -> None:
    """Limit the axis to the informative intervals."""
    finite = np.isfinite(upper - lower)
    if not finite.any():
        return
    width = (upper - lower)[finite]
    narrow = width <= _WIDE * np.median(width)
    low, high = float(lower[finite][narrow].min()), float(upper[finite][narrow].max())
    if truth is not None:
        low, high = min(low, float(truth.min())), max(high, float(truth.max()))
    margin = 0.15 * (high - low) or 1.0
    panel.set_ylim(low - margin, high + margin)
