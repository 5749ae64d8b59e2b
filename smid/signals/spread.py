"""The spread of an experiment: the pairs of input and output, beside the input and its autocovariance.

The model has to extrapolate where there are no pairs. Reference: hybrid thesis, section 2.4.2, figure 2.5.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from smid.data import DataError, excitation
from smid.signals.generators import check_samples

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["plot_spread"]

LONGEST_LAG = 40


def plot_spread(
    records: Mapping[str, tuple[ArrayLike, ArrayLike]],
    sampling_time: float,
    *,
    input_label: str = "input",
    output_label: str = "output",
) -> Figure:
    """Draw a row for each experiment: input, pairs of input and output, autocovariance and order of excitation.

    Parameters
    ----------
    records
        Input and output of each experiment, shape (n,) each.
    sampling_time
        In seconds.
    input_label, output_label
        With their units.

    Raises
    ------
    DataError
        If there is no record, or input and output differ in length.

    Examples
    --------
    >>> u = np.sin(0.3 * np.arange(100))
    >>> len(plot_spread({"sine": (u, np.roll(u, 3))}, 1.0).axes)
    3
    """
    from matplotlib.figure import Figure

    from smid.display.style import BLUE, GRID, ORANGE, WIDTH, style

    pairs = {name: (np.asarray(u, dtype=float), np.asarray(y, dtype=float)) for name, (u, y) in records.items()}
    if not pairs:
        raise DataError("no record to draw: give at least one")
    for name, (u, y) in pairs.items():
        if u.ndim != 1 or u.shape != y.shape:
            raise DataError(f"{name!r}: input of shape {u.shape}, output of shape {y.shape}; give series of one length")
        check_samples(len(u), sampling_time)
    with style():
        figure = Figure(figsize=(1.35 * WIDTH, 0.5 + 1.15 * len(pairs)), layout="constrained")
        rows = figure.subplots(len(pairs), 3, squeeze=False, width_ratios=(2.4, 1.2, 1.4))
        for (name, (u, y)), (time, plane, lags) in zip(pairs.items(), rows, strict=True):
            time.plot(sampling_time * np.arange(len(u)), u, color=ORANGE, drawstyle="steps-post")
            time.set_title(name, loc="left")
            time.margins(x=0)
            plane.plot(u, y, ".", color=BLUE, markersize=1.5)
            found = excitation(u, max_order=LONGEST_LAG)
            order = f"at least {found.order}" if found.order == found.max_order else f"{found.order}"
            lags.axhline(0, color=GRID, linewidth=0.6)
            lags.plot(sampling_time * np.arange(len(found.autocovariance)), found.autocovariance, color=BLUE)
            lags.set_title(f"excites order {order}", loc="left")
            lags.margins(x=0)
        for axis, label in zip(rows[-1], ("time [s]", input_label, "lag [s]"), strict=True):
            axis.set_xlabel(label)
        middle = rows[len(pairs) // 2]
        squared = re.sub(r".*\[(.+)\]$|.*", lambda unit: f" [{unit[1]}²]" if unit[1] else "", input_label, count=1)
        for axis, label in zip(middle, (input_label, output_label, f"autocovariance{squared}"), strict=True):
            axis.set_ylabel(label)
    return figure
