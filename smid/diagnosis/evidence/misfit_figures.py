"""The figure of a misfit: the error against each quantity that it may depend on."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from relaxations.algebra.arrays import Array
from smid.data.gaps import bridged
from smid.diagnosis.evidence.misfit import Misfit
from smid.diagnosis.evidence.structure import DIRECTIONS, Structure, input_direction
from smid.display.style import BLUE, GREEN, GRID, INK, ORANGE, PAPER, RED, SKY, WIDTH, style

_KINDS = ("time", "frequency", "input level", "output level", "velocity", "channel")
_MOST_POINTS = 2500
_MOST_CHANNELS = 4
_COLOURS = (ORANGE, BLUE, SKY, SKY, GRID)  # rises, falls, holds, holds, never moved


def misfit_figure(misfit: Misfit) -> Figure:
    """Draw the error against time, spectrum, input, output, velocity and further channels.

    Examples
    --------
    >>> from smid.data import Dataset
    >>> from smid.diagnosis.evidence.misfit import misfit
    >>> u = np.sin(0.1 * np.arange(100))
    >>> data = Dataset.from_arrays(input={"u": u}, output={"y": u + u**2}, sampling_time=1.0)
    >>> len(misfit_figure(misfit(data, "y", [u])).axes)
    5
    """
    data, start = misfit.data, misfit.start
    others = [c.name for c in data.channels if c.name not in (misfit.input, misfit.channel)]
    names = [name for name in others if any(np.ptp(bridged(run.values[name])) > 0 for run in data.experiments)][
        :_MOST_CHANNELS
    ]
    error = np.concatenate([e[start:] for e in misfit.residual])
    free = [run.values[misfit.channel] - e for run, e in zip(data.experiments, misfit.residual, strict=True)]
    velocity = np.concatenate([np.gradient(y)[start:] if y.size > 1 else np.zeros(1) for y in free])
    directions = np.concatenate([input_direction(run.values[misfit.input])[start:] for run in data.experiments])
    unit = f" [{misfit.unit}]" if misfit.unit else ""
    # All points of a long record would cover each other and make a large page.
    shown = np.arange(0, error.size, max(1, error.size // _MOST_POINTS))

    def joined(name: str) -> Array:
        return np.concatenate([run.values[name][start:] for run in data.experiments])

    panels: list[tuple[str, str, Array, str, NDArray[np.str_] | str]] = [
        (
            "input level",
            misfit.input,
            joined(misfit.input),
            str(data.channel(misfit.input)),
            np.array(_COLOURS)[directions],
        ),
        (
            "output level",
            misfit.channel,
            np.concatenate([y[start:] for y in free]),
            f"simulated {misfit.channel}{unit}",
            GREEN,
        ),
        (
            "velocity",
            misfit.channel,
            velocity / data.sampling_time,
            f"velocity of simulated {misfit.channel} [{misfit.unit or '1'}/s]",
            GREEN,
        ),
        *(("channel", name, joined(name), str(data.channel(name)), GREEN) for name in names),
    ]
    rows = (len(panels) + 2) // 2
    with style():
        figure = Figure(figsize=(WIDTH, 1.7 + 1.65 * rows), layout="constrained")
        grid = figure.add_gridspec(1 + rows, 2)
        _over_time(figure.add_subplot(grid[0, :]), misfit, unit)
        _spectrum(figure.add_subplot(grid[1, 0]), misfit, bridged(error), unit)
        for k, (kind, against, x, label, colour) in enumerate(panels, start=1):
            axes = figure.add_subplot(grid[1 + k // 2, k % 2])
            for one in dict.fromkeys(np.atleast_1d(colour).tolist()):
                chosen = shown[np.broadcast_to(colour, x.shape)[shown] == one]
                axes.plot(x[chosen], error[chosen], ".", markersize=1.0, color=one, zorder=1)
            _dressed(axes, misfit, _found(misfit, kind, against))
            axes.set_xlabel(label)
            axes.set_ylabel(f"error{unit}")
            if kind == "input level":
                seen = {DIRECTIONS[d].split()[0]: _COLOURS[d] for d in np.unique(directions) if d < 4}
                for word, ink in seen.items():
                    axes.plot([], [], linestyle="", marker="o", markersize=3, color=ink, label=f"{misfit.input} {word}")
                handles, labels = axes.get_legend_handles_labels()
                figure.legend(handles, labels, loc="outside lower center", ncols=3, title="points over the input level")
        figure.align_ylabels()
    return figure


def shows_something(misfit: Misfit) -> bool:
    """Return whether a panel of `misfit_figure` shows a significant share of the error."""
    return any(found.share > 0 for found in misfit.structure if found.kind in _KINDS)


def _over_time(axes: Axes, misfit: Misfit, unit: str) -> None:
    bound, offset, step = misfit.noise_bound, 0.0, misfit.data.sampling_time
    several = len(misfit.residual) > 1
    if bound is not None:
        axes.axhspan(-bound, bound, color=SKY, alpha=0.3, linewidth=0, label="± noise bound")
    for number, residual in enumerate(misfit.residual):
        # Experiments may all begin at zero: they are drawn one after the other.
        time = offset + step * np.arange(residual.size) if several else misfit.data.time(number)
        time, error = time[misfit.start :], residual[misfit.start :]
        axes.plot(time, error, color=INK, linewidth=0.6)
        if bound is not None:
            outside = np.abs(error) > bound
            label = "outside" if number == 0 else "_"
            axes.plot(time[outside], error[outside], color=RED, marker=".", markersize=3, linestyle="", label=label)
        offset += step * residual.size
        if several and number + 1 < len(misfit.residual):
            axes.axvline(offset, color=INK, linewidth=0.6, linestyle=":")
    axes.set_xlabel("time, one experiment after the other [s]" if several else "time [s]")
    axes.set_ylabel(f"error{unit}")
    axes.grid(True, linewidth=0.4)
    axes.margins(x=0.01)
    _titled(axes, _found(misfit, "time", ""))
    if bound is not None:
        axes.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=2, borderpad=0, borderaxespad=0.2)


def _spectrum(axes: Axes, misfit: Misfit, error: Array, unit: str) -> None:
    amplitude = 2 * np.abs(np.fft.rfft((error - error.mean()) * np.hanning(error.size))) / (0.5 * error.size)
    lines = np.fft.rfftfreq(error.size, misfit.data.sampling_time)
    amplitude, lines = amplitude[1:], lines[1:]
    if lines.size:
        # With more lines than pixels, each pixel shows the highest of its lines.
        width = max(1, lines.size // 1000)
        cut = lines.size // width * width
        axes.semilogx(
            lines[:cut].reshape(-1, width).mean(axis=1), amplitude[:cut].reshape(-1, width).max(axis=1), color=INK
        )
    found = _found(misfit, "frequency", "")
    if found is not None and found.share > 0 and found.at is not None:
        axes.axvline(found.at, color=RED, linewidth=0.8, linestyle="--")
    axes.set_ylim(bottom=0)
    axes.grid(True, linewidth=0.4)
    axes.set_xlabel("frequency [Hz]")
    axes.set_ylabel(f"amplitude{unit}")
    _titled(axes, found)


def _dressed(axes: Axes, misfit: Misfit, found: Structure | None) -> None:
    """Add the noise bound, the means of the bins and the share."""
    if misfit.noise_bound is not None:
        for end in (-misfit.noise_bound, misfit.noise_bound):
            axes.axhline(end, color=RED, linewidth=0.7, linestyle="--")
    if found is not None:
        centres = [(b.lower + b.upper) / 2 for b in found.bins]
        axes.plot(
            centres,
            [b.mean for b in found.bins],
            color=INK,
            marker="s",
            markersize=3.5,
            markerfacecolor=PAPER,
            zorder=5,
        )
    axes.grid(True, linewidth=0.4)
    _titled(axes, found)


def _titled(axes: Axes, found: Structure | None) -> None:
    if found is not None:
        said = f"{100 * found.share:.0f} % of the variance" if found.share > 0 else "not significant"
        axes.set_title(f"{found.kind}: {said}", loc="left", fontsize=8)


def _found(misfit: Misfit, kind: str, against: str) -> Structure | None:
    return next((s for s in misfit.structure if (s.kind, s.against) == (kind, against)), None)
