"""Input signals to excite a plant with, each a pure function of its options and its seed."""

from collections.abc import Callable

from smid.signals.constant import constant
from smid.signals.generators import Array
from smid.signals.multisine import multisine
from smid.signals.noise import noise
from smid.signals.noisy_staircase import noisy_staircase
from smid.signals.prbs import prbs
from smid.signals.qprts import qprts
from smid.signals.ramp import ramp
from smid.signals.sine import sine
from smid.signals.staircase import staircase
from smid.signals.step import step

SIGNALS: dict[str, Callable[..., Array]] = {
    function.__name__: function
    for function in (
        *(constant, sine, multisine, noise, staircase, noisy_staircase),
        *(prbs, qprts, ramp, step),
    )
}
"""Every signal by its name; a new one is one line here."""

__all__ = [
    "SIGNALS",
    "constant",
    "multisine",
    "noise",
    "noisy_staircase",
    "prbs",
    "qprts",
    "ramp",
    "sine",
    "staircase",
    "step",
]
