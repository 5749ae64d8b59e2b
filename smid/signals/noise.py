"""Uniform white noise: all frequencies alike.  Reference: hybrid thesis, section 2.4.2 and listing K.1."""

from __future__ import annotations

from smid.signals.generators import Array, Seed, check_samples, generator

__all__ = ["noise"]


def noise(n: int, *, seed: Seed, amplitude: float = 1.0, offset: float = 0.0) -> Array:
    """Give independent samples, uniform between ``offset - amplitude`` and ``offset + amplitude``.

    Parameters
    ----------
    n
        Number of samples.
    seed
        Of the samples.
    amplitude, offset
        Half the range, and its centre, in the input's unit.

    Returns
    -------
    ndarray, shape (n,)
        In the input's unit.

    Raises
    ------
    DataError
        If n is no number of samples.

    Examples
    --------
    >>> bool((abs(noise(100, seed=1, amplitude=0.2)) <= 0.2).all())
    True
    """
    check_samples(n)
    return offset + amplitude * generator(seed).uniform(-1, 1, n)
