r"""Dependence of the error on time order: mean, own past, past inputs, and lines of the spectrum.

**Mean.**  Its variance is S(0) / n with the spectrum S of the error, so that a slow error is not taken for an offset.

**Own past.**  The test of Ljung and Box shows whether there is any; an autoregression shows how much.

**Past inputs.**  Error and input are whitened by the autoregression of the error; then the regression on lagged inputs
has white errors and its F test holds for every input (Ljung, System Identification, 2nd ed., section 16.6).

**Frequency.**  The highest line of the periodogram over the median of its neighbourhood, by Fisher's test.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.ndimage import median_filter
from scipy.stats import chi2, f

from relaxations.algebra.arrays import Array
from smid.diagnosis.effects.parts.naming import quantity
from smid.diagnosis.evidence.autoregression import autocovariance, autoregression
from smid.diagnosis.evidence.structure import CHANCE, Bin, Structure, range_of
from smid.validation.correlation import FEWEST

LARGEST_LAG = 30


def mean_structure(e: Array, unit: str) -> Structure:
    """Return the mean error, with the correlation of the samples in its uncertainty.

    Examples
    --------
    >>> e = 1 + np.random.default_rng(0).standard_normal(200)
    >>> round(mean_structure(e, "V").share, 1)
    0.5
    """
    description = autoregression(e)
    long_run = float(description.spectrum(2)[0]) / e.size
    mean, square = float(e.mean()), float(np.mean(e**2))
    chance = float(chi2.sf(mean**2 / long_run, 1)) if long_run > 0 else float(mean == 0)
    share = max(mean**2 - long_run, 0.0) / square if chance < CHANCE and square > 0 else 0.0
    said = f"the mean error is {quantity(mean, unit, True)}" + ("" if share > 0 else ", not significant")
    return Structure("mean", "", share, said, (), chance)


def own_past_structure(e: Array, sampling_time: float) -> Structure:
    """Return how much of the error its own past predicts (Ljung-Box test over 20 lags).

    Examples
    --------
    >>> own_past_structure(np.random.default_rng(0).standard_normal(300), 0.1).share
    0.0
    """
    n, lags = e.size, min(20, e.size // 5)
    gamma = autocovariance(e, n - 1)
    if gamma[0] <= 0:
        return Structure("own past", "", 0.0, "the error is constant")
    r = gamma / gamma[0]
    statistic = n * (n + 2) * float(np.sum(r[1 : lags + 1] ** 2 / (n - np.arange(1, lags + 1))))
    chance = float(chi2.sf(statistic, lags))
    forgets = float(np.argmax(np.abs(r) < np.exp(-1)) * sampling_time)
    share = autoregression(e).explained if chance < CHANCE else 0.0
    said = (
        f"its own past explains {100 * share:.0f} % of the error variance one sample ahead; correlation time: about "
        f"{quantity(forgets, 's')}"
        if share > 0
        else "the error is white"
    )
    return Structure("own past", "", share, said, (), chance, forgets)


def past_inputs_structure(e: Sequence[Array], u: Sequence[Array], name: str, sampling_time: float) -> Structure | None:
    """Return how much of the error the last 30 samples of the input explain linearly.

    Parameters
    ----------
    e, u
        Shape (n,). Error and input of each experiment.
    sampling_time
        In seconds.

    Examples
    --------
    >>> random = np.random.default_rng(0)
    >>> u = random.standard_normal(500)
    >>> e = np.roll(u, 3) + random.standard_normal(500)
    >>> found = past_inputs_structure([e], [u], "u", 0.1)
    >>> round(found.share, 1), found.at
    (0.5, 0.3)
    """
    lags = min(LARGEST_LAG, min(x.size for x in u) // 10)
    rows = [np.lib.stride_tricks.sliding_window_view(x, lags + 1)[:, ::-1] for x in u]
    phi, target = np.concatenate(rows), np.concatenate([x[lags:] for x in e])
    phi, target = phi - phi.mean(axis=0), target - target.mean()
    if lags < 1 or target.size < FEWEST or np.abs(phi).max() <= 0 or not np.any(target):
        return None
    whitener = autoregression(target)
    white_phi, white = whitener.whiten(phi), whitener.whiten(target)
    gains, _, rank, _ = np.linalg.lstsq(white_phi, white, rcond=1e-5)
    left, free = float(np.sum((white - white_phi @ gains) ** 2)), white.size - int(rank) - 1
    if rank == 0 or free < rank:
        return None
    if left <= 1e-12 * float(white @ white):
        chance = 0.0
    else:
        chance = float(f.sf((float(white @ white) - left) / rank / (left / free), rank, free))
    # The whitened fit may explain nothing of a slow error; then what it explains of the innovation counts.
    raw = float(np.sum((target - phi @ gains) ** 2) / (target @ target))
    fresh = (1.0 - left / free * white.size / float(white @ white)) * (1.0 - whitener.explained)
    share = max(1.0 - raw * white.size / free, fresh, 0.0) if chance < CHANCE else 0.0
    tells = np.abs(white_phi.T @ white) / np.maximum(np.linalg.norm(white_phi, axis=0), 1e-300)
    delay = float(np.argmax(tells)) * sampling_time
    said = f"past values of {name} do not explain the error linearly: not significant"
    if share > 0:
        said = (
            f"the last {lags} samples of {name} explain {100 * share:.0f} % of the error variance linearly, most "
            f"{quantity(delay, 's')} back: the linear part of the model is not right"
        )
    return Structure("past inputs", name, share, said, (), chance, round(delay, 12))


def frequency_structure(e: Array, sampling_time: float) -> Structure:
    """Return the share of the error that is one line of its spectrum, and how flat the rest is.

    Examples
    --------
    >>> t = 0.1 * np.arange(500)
    >>> e = np.sin(2 * np.pi * 1.2 * t) + 0.1 * np.random.default_rng(0).standard_normal(500)
    >>> found = frequency_structure(e, 0.1)
    >>> round(found.at, 1), found.share > 0.9
    (1.2, True)
    """
    n = e.size
    window = np.hanning(n + 1)[:n]
    power = np.abs(np.fft.rfft((e - e.mean()) * window)[1 : (n + 1) // 2]) ** 2
    lines = np.fft.rfftfreq(n, sampling_time)[1 : (n + 1) // 2]
    if power.size < 8 or power.sum() <= 0:
        return Structure("frequency", "", 0.0, "the error is too short for a spectrum")
    # A median of exponentials is their mean times ln 2; neighbours give the level of a coloured spectrum.
    level = median_filter(power, size=min(31, power.size), mode="reflect") / np.log(2)
    ratio = power / np.maximum(level, 1e-12 * power.max())
    # At the lowest lines a steep spectrum has no level: a trend is not a line.
    ratio[:3] = 0.0
    peak = int(np.argmax(ratio))
    # The level is itself an estimate from 31 lines: F with 2 and about 2 * 31 / 2 degrees of freedom.
    chance = float(-np.expm1(power.size * np.log1p(-min(float(f.sf(ratio[peak], 2, 31)), 1 - 1e-16))))
    near = slice(max(peak - 2, 0), peak + 3)
    share = float(np.sum(np.maximum(power[near] - level[near], 0)) / power.sum()) if chance < 0.1 * CHANCE else 0.0
    flatness = float(np.exp(np.mean(np.log(np.maximum(power, 1e-300))) + np.euler_gamma) / power.mean())
    at = float(lines[peak])
    said = f"no line stands out of the error's spectrum (flatness {min(flatness, 1.0):.2g})"
    if share > 0:
        said = f"{100 * share:.0f} % of the error variance is a line at {quantity(at, 'Hz')}"
    edges = np.unique(np.geomspace(1, power.size, 11).astype(int))
    scale = float(np.var(e)) / power.sum()
    bins = tuple(
        Bin(
            f"frequency is {range_of(float(lines[a - 1]), float(lines[b - 2]), 'Hz')}",
            float(lines[a - 1]),
            float(lines[b - 2]),
            int(b - a),
            0.0,
            float(np.sqrt(power[a - 1 : b - 1].sum() * scale)),
        )
        for a, b in zip(edges[:-1], [*edges[1:-1], power.size + 1], strict=True)
    )
    return Structure("frequency", "", share, said, bins, chance, at)
