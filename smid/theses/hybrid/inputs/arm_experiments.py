"""Experiments on the rotating arm: families of voltages, and their Fisher information and certified widths.

The arm's friction jumps, and a change of a constant shifts the jumps in time. Sensitivities of the differential
equations do not include this. Against the exact motion over 12 s, with ten Runge-Kutta steps per sample, their errors
were 70 to 96 % for Ws and 20 to 60 % for 1/J. The slopes here are central differences of the exact motion.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from relaxations.algebra.arrays import Array
from smid.data import Dataset
from smid.design.family import InputFamily
from smid.design.fisher import FisherInformation, fisher_information
from smid.signals import sum_of_sines, tailored
from smid.theses.hybrid.arm.exact_motion import ARM, exact_motion
from smid.theses.hybrid.arm.proven import CONSTANTS, prove_arm

__all__ = ["arm_information", "arm_sines", "arm_tailored", "arm_widths"]

DIFFERENCE = 1e-6  # of each constant
CREEPING = 0.07  # V; c times it is just below Ws


def arm_sines(
    n: int,
    sampling_time: float,
    *,
    frequencies: Sequence[float] = (0.4, 0.9, 1.4, 1.9, 2.4, 2.9),
    amplitude: float = 1.0,
) -> InputFamily:
    """Return the family of sums of sines with any amplitudes (in V), as in table F.1.

    Parameters
    ----------
    sampling_time
        In seconds.
    frequencies
        In rad/s.
    amplitude
        Largest voltage, in V.

    Examples
    --------
    >>> bool(np.abs(arm_sines(100, 0.02).signal(np.ones(6))).max() <= 1)
    True
    """

    def build(choice: Array) -> Array:
        return sum_of_sines(n, frequencies=frequencies, amplitudes=choice.tolist(), sampling_time=sampling_time)

    count = len(frequencies)
    names = tuple(f"amplitude at {w:g} rad/s" for w in frequencies)
    return InputFamily("sum of sines", build, names, (-amplitude,) * count, (amplitude,) * count, amplitude)


def arm_tailored(n: int, sampling_time: float, *, amplitude: float = 1.0) -> InputFamily:
    """Return the family of tailored signals, section 7.4: a sine, a constant, then switching and creeping.

    Its choices: amplitude in V and frequency in rad/s of the sine, the constant in V, the switching level in V, its
    half period relative to the last part, and the shares of sine and constant.

    Parameters
    ----------
    sampling_time
        In seconds.
    amplitude
        Largest voltage, in V.

    Examples
    --------
    >>> len(arm_tailored(100, 0.02).names)
    7
    """

    def build(choice: Array) -> Array:
        size, speed, level, switching, half, first, second = choice.tolist()
        last = (1 - first - second) * n
        return tailored(
            n,
            sampling_time=sampling_time,
            frequency=speed / (2 * np.pi),
            amplitude=size,
            level=level,
            switching=-switching,
            half_period=sampling_time * max(1, round(half * last)),
            shares=(first, second),
        )

    names = ("amplitude", "frequency", "level", "switching", "half period", "share of sine", "share of constant")
    lower = (0.1, 0.5, 0.03, 0.01, 0.2, 0.1, 0.1)
    upper = (amplitude, 6.0, amplitude, CREEPING, 0.8, 0.4, 0.4)
    return InputFamily("tailored", build, names, lower, upper, amplitude)


def arm_information(
    u: ArrayLike, sampling_time: float, deviation: float, *, names: Sequence[str] = CONSTANTS
) -> FisherInformation:
    """Return the Fisher information of the angle on the arm's constants; first angle and speed are unknown.

    Parameters
    ----------
    u
        Shape (n,). Voltage in V, held between samples.
    sampling_time
        In seconds.
    deviation
        Standard deviation of the measured angle, in rad.
    names
        Unknown constants among theta, b, Wd, Ws.

    Examples
    --------
    >>> from smid.signals import TABLE_F1
    >>> information = arm_information(TABLE_F1["six_equal"].signal(300, 0.02), 0.02, 0.001)
    >>> bool(information.relative_deviations[0] < information.relative_deviations[3])
    True
    """
    inputs = np.asarray(u, dtype=np.float64)

    def angle(values: dict[str, float], start: tuple[float, float] = (0.0, 0.0)) -> Array:
        return exact_motion(inputs, sampling_time, values=values, start=start)[:, 0]

    slopes = []
    for name in names:
        step = DIFFERENCE * ARM[name]
        slopes.append((angle({name: ARM[name] + step}) - angle({name: ARM[name] - step})) / (2 * step))
    by_speed = (angle({}, (0.0, DIFFERENCE)) - angle({}, (0.0, -DIFFERENCE))) / (2 * DIFFERENCE)
    return fisher_information(
        np.stack(slopes, axis=1),
        names,
        [ARM[name] for name in names],
        deviation,
        nuisance=np.stack([np.ones(len(inputs)), by_speed], axis=1),
    )


def arm_widths(
    u: ArrayLike,
    sampling_time: float,
    noise_bound: float,
    *,
    seed: int = 0,
    prior: dict[str, tuple[float, float]] | None = None,
) -> dict[str, float]:
    """Return the relative widths of the arm's certified intervals from one simulated record.

    Parameters
    ----------
    u
        Shape (n,). Voltage in V, held between samples.
    sampling_time
        In seconds.
    noise_bound
        Of the uniform noise, in rad.
    prior
        See `prove_arm`.

    Examples
    --------
    >>> from smid.signals import TABLE_F1
    >>> u = TABLE_F1["six_unequal"].signal(150, 0.02)
    >>> arm_widths(u, 0.02, 0.001, prior={"theta": (15.0, 30.0)})["theta"] < 0.05
    True
    """
    inputs = np.asarray(u, dtype=np.float64)
    angle = exact_motion(inputs, sampling_time)[:, 0]
    noise = np.random.default_rng(seed).uniform(-noise_bound, noise_bound, len(inputs))
    data = Dataset.from_arrays(input=inputs, output=angle + noise, sampling_time=sampling_time)
    found = prove_arm(data, noise_bound, prior=prior)
    return {name: found[name].width_percent / 100 for name in CONSTANTS}
