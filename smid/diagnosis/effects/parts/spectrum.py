"""The strongest lines in the spectrum of the residual, located between the bins."""

from __future__ import annotations

import numpy as np

from relaxations.algebra.arrays import Array
from smid.diagnosis.effects.effect import Site

__all__ = ["amplitudes", "leftover", "peaks"]

_PADDING = 16


def leftover(site: Site) -> Array:
    """Return the longest residual without its straight line, shape (n,); of the output where there is none."""
    records = site.residual or tuple(run.values[site.output] for run in site.data.experiments)
    longest = max(records, key=len)
    time = np.arange(len(longest))
    return np.asarray(longest - np.polyval(np.polyfit(time, longest, 1), time), float)


def peaks(site: Site, count: int) -> tuple[float, ...]:
    """Return the angular frequencies of the strongest peaks, strongest first.

    In radians per second; at least one period fits the record.
    """
    residual = leftover(site)
    n = len(residual)
    # A Hann window suppresses the side lobes of a strong line.
    power = np.abs(np.fft.rfft(residual * np.hanning(n), _PADDING * n))
    inner = np.arange(_PADDING, len(power) - 1)
    tops = inner[(power[inner] >= power[inner - 1]) & (power[inner] > power[inner + 1])]
    found: list[float] = []
    for top in tops[np.argsort(-power[tops], kind="stable")]:
        before, here, after = power[top - 1 : top + 2]
        bend = before - 2 * here + after
        place = top + (0.5 * (before - after) / bend if bend else 0.0)
        found.append(float(2 * np.pi * place / (_PADDING * n * site.sampling_time)))
        if len(found) == count:
            break
    return tuple(found)


def amplitudes(site: Site, frequency: float) -> tuple[float, float]:
    """Return the amplitudes of sine and cosine at a frequency in radians per second, by least squares."""
    residual = leftover(site)
    angle = frequency * site.sampling_time * np.arange(len(residual))
    basis = np.column_stack((np.sin(angle), np.cos(angle)))
    sine, cosine = np.linalg.lstsq(basis, residual, rcond=None)[0]
    return float(sine), float(cosine)
