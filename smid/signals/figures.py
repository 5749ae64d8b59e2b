"""Figures of a spectrum, and of the evidence for a delay."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

from smid.display.style import BLUE, GRID, INK, ORANGE, SKY, WIDTH, style

if TYPE_CHECKING:
    from smid.signals.delay import Delay
    from smid.signals.spectrum import Spectrum


def spectrum_figure(spectrum: Spectrum) -> Figure:
    """Draw the spectrum of each output and input, and the coherences with the level of chance."""
    with style():
        count = len(spectrum.density) + len(spectrum.coherence)
        figure = Figure(figsize=(WIDTH, 0.5 + 1.25 * count), layout="constrained")
        axes = figure.subplots(count, 1, sharex=True, squeeze=False)[:, 0]
        for panel, name in zip(axes, spectrum.density, strict=False):
            draw_density(panel, spectrum, name, BLUE if name in spectrum.data.outputs else ORANGE)
        for panel, pair in zip(axes[len(spectrum.density) :], spectrum.coherence, strict=True):
            draw_coherence(panel, spectrum, pair)
        axes[-1].set_xlabel("frequency [Hz]")
        figure.align_ylabels()
    return figure


def draw_density(axes: Axes, spectrum: Spectrum, name: str, colour: str) -> None:
    """Draw the spectrum of a channel on logarithmic axes."""
    unit = spectrum.data.channel(name).unit
    axes.loglog(spectrum.frequency, spectrum.density[name], color=colour)
    axes.set_ylabel(f"{name} [{unit}²/Hz]" if unit else f"{name} [1/Hz]")
    _frame(axes, spectrum)


def draw_coherence(axes: Axes, spectrum: Spectrum, pair: tuple[str, str]) -> None:
    """Draw a coherence, with the band that independent signals keep at 99 % of the frequencies."""
    axes.axhspan(0, spectrum.level, color=SKY, alpha=0.3, linewidth=0)
    axes.semilogx(spectrum.frequency, spectrum.coherence[pair], color=INK)
    axes.set_ylim(0, 1.02)
    axes.set_yticks((0, 0.5, 1))
    axes.set_ylabel(f"coherence\n{pair[0]} → {pair[1]}")
    _frame(axes, spectrum)


def _frame(axes: Axes, spectrum: Spectrum) -> None:
    axes.grid(True, linewidth=0.4, color=GRID)
    axes.set_xlim(spectrum.frequency[0], spectrum.frequency[-1])
    # Ticks at 1, 2, 5, 10 where they have room; over many decades at powers of ten.
    decades = np.log10(spectrum.frequency[-1] / spectrum.frequency[0])
    axes.xaxis.set_major_locator(LogLocator(subs=(1, 2, 5) if decades < 2.5 else (1,)))
    axes.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axes.xaxis.set_minor_formatter(NullFormatter())


def delay_figure(delay: Delay) -> Figure:
    """Draw the rise of the error variance over the assumed delay, with the band of chance."""
    lags = np.arange(delay.longest + 1)
    rise, band = 100 * delay.rise[:-1], 100 * delay.band[:-1]
    with style():
        figure = Figure(figsize=(WIDTH, 2.2), layout="constrained")
        axes = figure.subplots()
        axes.fill_between(lags, 0, band, color=SKY, alpha=0.4, linewidth=0, label="99 % band of chance")
        axes.plot(lags, rise, color=BLUE, marker="o", markersize=3, label="rise of the one-step error variance")
        if delay.samples is not None:
            axes.axvline(delay.samples, color=INK, linewidth=0.8, linestyle="--", label=f"delay: {delay.samples}")
        if rise.max() > 3 * band.max():  # then a linear scale would hide the band
            axes.set_yscale("symlog", linthresh=max(float(band.max()), 1e-9))
            axes.set_ylim(0, 2 * rise.max())
        else:
            axes.set_ylim(0, None)
        axes.set_xlabel(f"assumed delay from {delay.input} to {delay.output} [samples]")
        axes.set_ylabel("rise [%]")
        axes.grid(True, linewidth=0.4, color=GRID)
        axes.margins(x=0.01)
        figure.legend(loc="outside upper center", ncols=3)
    return figure
