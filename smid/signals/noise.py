"""Uniform white noise, which excites all frequencies (hybrid thesis, section 2.4.2 and listing K.1)."""

from __future__ import annotations

from relaxations.algebra.arrays import Array
from smid.signals.generators import Seed, check_samples, generator

__all__ = ["noise"]


def noise(n: int, *, seed: Seed, amplitude: float = 1.0, offset: float = 0.0) -> Array:
    """Return independent samples, shape (n,), uniform between ``offset - amplitude`` and ``offset + amplitude``.

    Raises
    ------
    DataError
        If n is not a number of samples.

    Examples
    --------
    >>> bool((abs(noise(100, seed=1, amplitude=0.2)) <= 0.2).all())
    True
    """
    check_samples(n)
    return offset + amplitude * generator(seed).uniform(-1, 1, n)
