"""Input signals of the blind cases, between -1 and 1, at the tempo of the plant they excite.

``tempo`` is the plant's slowest time constant in samples: holding times and periods are drawn around it, so that the
signals neither rush past the plant nor leave it at rest. The signals are those of the hybrid thesis, section 2.4.2
(sums of sines, noise, staircases, quantised pseudo random trinary signals) and of the clutch thesis (ramps, steps).
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from relaxations.algebra.arrays import Array

__all__ = ["BINARY", "SIGNALS", "SMOOTH", "make_signal"]

Rng = np.random.Generator


def _whole(value: float) -> int:
    return max(2, round(value))


def multisine(rng: Rng, n: int, tempo: float) -> Array:
    """Sum of three to eight sines of random phase; periods from one and a half tempos (five samples) up."""
    count = int(rng.integers(3, 9))
    periods = np.exp(rng.uniform(np.log(max(5.0, 1.5 * tempo)), np.log(max(60.0, 14.0 * tempo)), count))
    phases = rng.uniform(0, 2 * np.pi, count)
    weights = rng.uniform(0.4, 1.0, count)
    waves = np.sin(2 * np.pi * np.arange(n)[:, None] / periods + phases) @ weights
    return np.asarray(waves / np.max(np.abs(waves)))


def held_noise(rng: Rng, n: int, tempo: float) -> Array:
    """Uniform noise, each value held for the same few samples."""
    hold = _whole(tempo * rng.uniform(0.5, 2.0))
    return np.repeat(rng.uniform(-1, 1, n // hold + 1), hold)[:n]


def staircase(rng: Rng, n: int, tempo: float) -> Array:
    """Flights of five to nine levels, up and down again and again; at least two flights fit in the record."""
    levels = int(rng.integers(5, 10))
    dwell = max(2, min(_whole(tempo * rng.uniform(0.8, 3.0)), n // (4 * levels)))
    flight = np.linspace(-1, 1, levels)
    period = np.repeat(np.concatenate([flight, flight[-2:0:-1]]), dwell)
    begin = int(rng.integers(len(period)))
    return np.resize(np.roll(period, -begin), n)


def noisy_staircase(rng: Rng, n: int, tempo: float) -> Array:
    """Give a staircase that carries short-held uniform noise."""
    part = rng.uniform(0.15, 0.4)
    hold = int(rng.integers(1, 4)) + round(0.3 * tempo)
    noise = np.repeat(rng.uniform(-1, 1, n // hold + 1), hold)[:n]
    return (1 - part) * staircase(rng, n, tempo) + part * noise


def prbs(rng: Rng, n: int, tempo: float) -> Array:
    """Pseudo random binary signal of an eleven stage shift register with a random clock."""
    clock = _whole(tempo * rng.uniform(0.6, 2.0))
    register = [int(bit) for bit in rng.integers(0, 2, 11)]
    register[0] = 1  # the register of zeros never moves
    bits = []
    for _ in range(n // clock + 1):
        bits.append(register[-1])
        register = [register[10] ^ register[8], *register[:-1]]
    return np.repeat(2.0 * np.array(bits) - 1.0, clock)[:n]


def qprts(rng: Rng, n: int, tempo: float) -> Array:
    """Sum of three ternary sequences whose clocks differ, quantised to the sum's levels."""
    total = np.zeros(n)
    for weight, slowness in ((0.5, 2.5), (0.3, 1.2), (0.2, 0.6)):
        clock = _whole(tempo * slowness * rng.uniform(0.7, 1.4))
        total += weight * np.repeat(rng.integers(-1, 2, n // clock + 1).astype(float), clock)[:n]
    return total


def ramps(rng: Rng, n: int, tempo: float) -> Array:
    """Ramps up and down between random corners with random slopes, some followed by a rest."""
    times, values, now, level = [0.0], [-1.0], 0.0, -1.0
    while now < n:
        corner = rng.uniform(0.2, 1.0) if level < 0 else rng.uniform(-1.0, -0.2)
        now += max(4.0, tempo * float(np.exp(rng.uniform(np.log(0.6), np.log(4.0)))))
        times.append(now)
        values.append(corner)
        if rng.random() < 0.5:
            now += max(2.0, tempo * rng.uniform(0.5, 2.0))
            times.append(now)
            values.append(corner)
        level = corner
    return np.asarray(np.interp(np.arange(n), times, values))


def steps(rng: Rng, n: int, tempo: float) -> Array:
    """Step to random levels after random times."""
    out = np.empty(n)
    at = 0
    while at < n:
        length = _whole(tempo * rng.uniform(1.0, 4.0))
        out[at : at + length] = rng.uniform(-1, 1)
        at += length
    return out


SIGNALS: dict[str, Callable[[Rng, int, float], Array]] = {
    function.__name__: function
    for function in (multisine, held_noise, staircase, noisy_staircase, prbs, qprts, ramps, steps)
}
# Two levels show of a static curve two points only; signals without edges show of fast dynamics little.
BINARY = ("prbs",)
SMOOTH = ("multisine", "ramps")


def make_signal(name: str, rng: Rng, n: int, tempo: float) -> Array:
    """Draw a signal.

    Parameters
    ----------
    name : str
        Key of `SIGNALS`.
    rng : numpy.random.Generator
        Source of every choice.
    n : int
        Number of samples.
    tempo : float
        Time constant to excite, in samples.

    Returns
    -------
    numpy.ndarray
        Shape (n,), within [-1, 1].

    Examples
    --------
    >>> bool(abs(make_signal("steps", np.random.default_rng(1), 50, 5.0)).max() <= 1)
    True
    """
    return SIGNALS[name](rng, n, tempo)
