"""Input signals for a plant, each a function of its options and its seed; spectrum, delay and filter of records."""

from collections.abc import Callable

from relaxations.algebra.arrays import Array
from smid.signals.constant import constant
from smid.signals.delay import Delay, delay_estimate
from smid.signals.modulating_filter import ModulatingFilter
from smid.signals.multisine import multisine
from smid.signals.noise import noise
from smid.signals.noisy_staircase import noisy_staircase
from smid.signals.prbs import prbs
from smid.signals.qprs import qprs
from smid.signals.qprts import qprts
from smid.signals.ramp import ramp
from smid.signals.sine import sine
from smid.signals.spectrum import Spectrum, spectrum
from smid.signals.spread import plot_spread
from smid.signals.staircase import staircase
from smid.signals.step import step
from smid.signals.sum_of_sines import TABLE_F1, Sines, sum_of_sines
from smid.signals.tailored import tailored

SIGNALS: dict[str, Callable[..., Array]] = {
    function.__name__: function
    for function in (
        *(constant, sine, multisine, noise, staircase, noisy_staircase),
        *(prbs, qprs, qprts, ramp, step, sum_of_sines, tailored),
    )
}
"""Every signal by its name; a new one is one line here."""

__all__ = [
    "SIGNALS",
    "TABLE_F1",
    "Delay",
    "ModulatingFilter",
    "Sines",
    "Spectrum",
    "constant",
    "delay_estimate",
    "multisine",
    "noise",
    "noisy_staircase",
    "plot_spread",
    "prbs",
    "qprs",
    "qprts",
    "ramp",
    "sine",
    "spectrum",
    "staircase",
    "step",
    "sum_of_sines",
    "tailored",
]
