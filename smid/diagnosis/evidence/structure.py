r"""What the error of a simulation depends on: shares of its variance, corrected for chance.

**Binned means.**  The samples are sorted into B bins by a quantity (time, input, velocity ...).  With bin means
:math:`\bar e_b` of :math:`n_b` samples, the part of the error that the quantity explains is

.. math:: \eta^2 = \frac{\sum_b n_b (\bar e_b - \bar e)^2}{\sum_t (e_t - \bar e)^2}

for *any* shape of the dependence.  An error that has nothing to do with the quantity also gives
:math:`\eta^2 > 0`: with white samples about (B - 1)/(n - 1), and much more when the error and the quantity both move
slowly.  Its expectation follows from the spectrum S of the error *within* the bins and the transforms :math:`I_b` of
the bins' indicators,

.. math:: E\Bigl[\sum_b n_b \bar e_b^2\Bigr] = \sum_b \frac{1}{n_b} \frac1M \sum_\omega S(\omega) |I_b(\omega)|^2
          = \lambda (B - 1) \sigma^2 + \ldots,

so that each bin counts :math:`n_b / \lambda` independent samples.  The share is :math:`\eta^2` minus that expectation
(:math:`\omega^2` in the analysis of variance). It is zero where an F test with the effective numbers of samples finds
it not significant.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import uniform_filter1d
from scipy.stats import f

from relaxations.algebra.arrays import Array
from smid.diagnosis.effects.parts.naming import quantity
from smid.diagnosis.evidence.autoregression import autoregression
from smid.validation.correlation import FEWEST

CHANCE = 1e-3
"""Probability by chance above which a dependence has share zero."""
DIRECTIONS = ("rises", "falls", "holds after a rise", "holds after a fall", "has not moved yet")
_SMALLEST_BIN = 5
_FEW_VALUES = 10


@dataclass(frozen=True)
class Bin:
    """One bin of the error.

    Parameters
    ----------
    label
        In words, such as "current from 0.1 to 0.3 A".
    lower, upper
        Ends of the bin in the unit of the quantity; equal for a class, such as a direction.
    samples
        Samples inside; lines for a band of frequencies.
    mean
        Mean error inside, in the output's unit.
    rms
        Root mean square of the error inside, in the output's unit.
    """

    label: str
    lower: float
    upper: float
    samples: int
    mean: float
    rms: float


@dataclass(frozen=True)
class Structure:
    """How much of the error one quantity explains.

    Parameters
    ----------
    kind
        "mean", "time", "input level", "input direction", "output level", "velocity", "velocity sign", "channel",
        "frequency", "own past" or "past inputs".
    against
        The channel, or "".
    share
        Explained part of the error variance, 0 to 1, corrected for chance; zero where not significant. For the mean,
        part of the mean square.
    bins
        Empty for "mean", "own past" and "past inputs".
    chance
        Probability that an error without this dependence looks like this.
    at
        Frequency of the highest line in Hz; correlation time in s; delay in s of the input that explains most.
    """

    kind: str
    against: str
    share: float
    sentence: str
    bins: tuple[Bin, ...] = ()
    chance: float = 1.0
    at: float | None = None


def level_codes(x: Array) -> NDArray[np.int64] | None:
    """Sort samples into bins by their value.

    Shape (n,): one bin per value where there are few, else up to eight bins of equally many samples. None for a
    constant or too short a record.

    Parameters
    ----------
    x
        Shape (n,).

    Examples
    --------
    >>> level_codes(np.repeat([2.0, 5.0], 30))[[0, -1]]
    array([0, 1])
    """
    if x.size < FEWEST or np.ptp(x) <= 1e-12 * np.abs(x).max():
        return None
    values, counts = np.unique(x, return_counts=True)
    if values.size <= _FEW_VALUES and counts.min() >= _SMALLEST_BIN:
        return np.searchsorted(values, x).astype(np.int64)
    edges = np.unique(np.quantile(x, np.linspace(0, 1, int(np.clip(x.size // 25, 2, 8)) + 1)))
    codes = np.searchsorted(edges[1:-1], x, side="right")
    return _used(codes)


def input_direction(u: Array) -> NDArray[np.int64]:
    """Return for each sample whether the input rises, falls, or holds after a rise or a fall.

    Shape (N,), index into `DIRECTIONS`.

    Parameters
    ----------
    u
        Shape (N,).

    Examples
    --------
    >>> input_direction(np.array([0.0, 0.0, 1.0, 1.0, 0.5])).tolist()
    [4, 4, 0, 2, 1]
    """
    smooth = u
    # Noise changes the direction of a measured input at every sample: average until it does not. An input that
    # always changes direction (white noise) is taken as it is.
    for width in (1, 3, 5, 9, 17, 33):
        candidate = uniform_filter1d(u, width, mode="nearest")
        moves = np.sign(np.diff(candidate))
        turns = np.count_nonzero(moves[1:] * moves[:-1] < 0)
        if turns < max(2.0, 0.25 * moves.size):
            smooth = candidate
            break
    change = np.diff(smooth, prepend=smooth[:1])
    dead = 1e-3 * np.abs(change).max()
    rising, falling = change > dead, change < -dead
    last = np.where(rising, 2, np.where(falling, 3, 0))
    moved = np.maximum.accumulate(np.where(last > 0, np.arange(u.size), -1))
    held = np.where(moved >= 0, last[moved], 4)
    return np.where(rising, 0, np.where(falling, 1, held)).astype(np.int64)


def _used(codes: NDArray[np.int64]) -> NDArray[np.int64] | None:
    """Return the bins numbered anew, each with enough samples: a bin of too few joins the one before it."""
    present, counts = np.unique(codes, return_counts=True)
    kept = present[counts >= _SMALLEST_BIN]
    if kept.size < 2:
        return None
    return np.clip(np.searchsorted(kept, codes, side="right") - 1, 0, None).astype(np.int64)


def explained(e: Array, codes: NDArray[np.int64]) -> tuple[float, float]:
    """Return the corrected share of the variance that bins explain, and the chance of it.

    Parameters
    ----------
    e
        Shape (n,).
    codes
        Shape (n,). The bin of each sample: 0 ... B - 1, none of them empty.

    Examples
    --------
    >>> noise = np.random.default_rng(1).standard_normal(400)
    >>> half = np.arange(400) // 200
    >>> explained(noise, half)[0], round(explained(noise + 2 * half, half)[0], 1)
    (0.0, 0.5)
    """
    n, counts = e.size, np.bincount(codes)
    count = counts.size
    centred = e - e.mean()
    total = float(centred @ centred)
    means = np.bincount(codes, weights=centred) / counts
    between, inside = float(counts @ means**2), centred - means[codes]
    if total <= 0 or count < 2:
        return 0.0, 1.0
    within = float(inside @ inside)
    if within <= 1e-12 * total:
        return 1.0, 0.0
    description = autoregression(inside)
    size = 1 << (2 * n - 1).bit_length()
    spectrum = description.spectrum(size) / description.variance

    def power(indicator: Array) -> float:
        lines = np.abs(np.fft.rfft(indicator, size)) ** 2 * spectrum
        return float(2 * lines.sum() - lines[0] - lines[-1]) / size

    expected = sum(power((codes == b).astype(np.float64)) / counts[b] for b in range(count)) - power(np.ones(n)) / n
    inflation = max(expected / (count - 1), 0.1)
    free = n - 1 - inflation * (count - 1)
    independent = min(n / max(inflation, 1.0), n) - count
    if free < 0.3 * n or independent < 3:
        return 0.0, 1.0  # such a slow error has too few independent samples
    variance = within / free
    chance = float(f.sf(between / ((count - 1) * inflation * variance), count - 1, independent))
    share = float(max(between - inflation * (count - 1) * variance, 0.0) / total)
    return (min(share, 1.0) if chance < CHANCE else 0.0), chance


def binned(
    kind: str,
    against: str,
    e: Array,
    x: Array | None,
    codes: NDArray[np.int64] | None,
    labels: Sequence[str] | None,
    name: str,
    units: tuple[str, str],
) -> Structure | None:
    """Measure how much of the error a quantity explains by its bins.

    Parameters
    ----------
    e
        Shape (n,). The error.
    x
        Shape (n,). The quantity; None for classes.
    codes
        Shape (n,). The bin of each sample; None where the quantity is constant.
    units
        Of x, and of the error.

    Examples
    --------
    >>> x = np.linspace(0, 1, 300)
    >>> e = np.where(x > 0.75, 1.0, 0.0) + 0.1 * np.random.default_rng(0).standard_normal(300)
    >>> print(binned(  # doctest: +ELLIPSIS
    ...     "input level", "u", e, x, level_codes(x), None, "u", ("A", "bar")).sentence)
    u explains 95 % of the error variance: it is +0.994 bar where u is 0.753 to 0.873 A, ...
    """
    if codes is None:
        return None
    bins = []
    used = np.unique(codes)
    if used.size < 2:
        return None
    for b in used:
        inside = codes == b
        ends = (float(x[inside].min()), float(x[inside].max())) if x is not None else (float(b), float(b))
        label = f"{name} is {range_of(*ends, units[0])}" if labels is None else labels[b]
        part = e[inside]
        bins.append(Bin(label, *ends, part.size, float(part.mean()), float(np.sqrt(np.mean(part**2)))))
    share, chance = explained(e, np.searchsorted(used, codes))
    sentence = f"the error does not depend significantly on {name}"
    if share > 0:
        high, low = sorted((max(bins, key=_mean), min(bins, key=_mean)), key=lambda one: -abs(one.mean))
        sentence = (
            f"{name} explains {100 * share:.0f} % of the error variance: it is {quantity(high.mean, units[1], True)} "
            f"where {high.label}, {quantity(low.mean, units[1], True)} where {low.label}"
        )
    return Structure(kind, against, share, sentence, tuple(bins), chance)


def _mean(one: Bin) -> float:
    return one.mean


def range_of(lower: float, upper: float, unit: str) -> str:
    """Print a range with its unit.

    Examples
    --------
    >>> range_of(0.1, 0.25, "A")
    '0.1 to 0.25 A'
    """
    return quantity(lower, unit) if lower == upper else f"{lower:.3g} to {quantity(upper, unit)}"
