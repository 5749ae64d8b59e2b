"""Pseudo-random binary signals: two levels that may switch at the ticks of a clock.

- Maximum length: a shift register of `order` bits with a primitive feedback polynomial. Its period is ``2^order - 1``
  ticks, and the autocorrelation over a period is nearly that of white noise.
- Random: each tick draws one of the two levels (hybrid thesis, listing K.1).

Reference: Godfrey, "Perturbation Signals for System Identification", chapter 1; Ljung, "System Identification", table
13.1 (taps).
"""

from __future__ import annotations

import numpy as np

from relaxations.algebra.arrays import Array
from smid.data import DataError
from smid.signals.generators import Seed, check_samples, clock_samples, generator

__all__ = ["prbs"]

TAPS = {
    2: (1, 2),
    3: (2, 3),
    4: (3, 4),
    5: (3, 5),
    6: (5, 6),
    7: (6, 7),
    8: (4, 5, 6, 8),
    9: (5, 9),
    10: (7, 10),
    11: (9, 11),
    12: (6, 8, 11, 12),
    13: (9, 10, 12, 13),
    14: (4, 8, 13, 14),
    15: (14, 15),
}
"""Bits of the register, counted from one, whose sum is fed back."""


def prbs(
    n: int,
    *,
    seed: Seed,
    order: int | None = None,
    sampling_time: float = 1.0,
    clock_period: float = 1.0,
    amplitude: float = 1.0,
    offset: float = 0.0,
) -> Array:
    """Return a pseudo-random binary signal, shape (n,).

    Parameters
    ----------
    seed
        Of the random levels, or of the register's first state.
    order
        Bits of the register, 2 to 15; None draws each level at random.
    clock_period
        Seconds between ticks, a multiple of the sampling time.
    amplitude, offset
        Half the distance of the levels, and their centre, in the input's unit.

    Raises
    ------
    DataError
        If the order or the clock period is not allowed.

    Examples
    --------
    >>> u = prbs(7, seed=1, order=3)
    >>> int(u.sum()), sorted(set(u.tolist()))
    (1, [-1.0, 1.0])
    """
    check_samples(n, sampling_time)
    held = clock_samples(clock_period, sampling_time, "clock_period")
    ticks = -(-n // held)
    if order is None:
        bits = generator(seed).integers(0, 2, ticks)
    elif order in TAPS:
        bits = _register(order, ticks, int(generator(seed).integers(1, 2**order)))
    else:
        raise DataError(f"order = {order!r} is not supported: give 2 to 15, or None for random levels")
    return offset + amplitude * np.repeat(2.0 * bits - 1.0, held)[:n]


def _register(order: int, count: int, state: int) -> np.ndarray[tuple[int], np.dtype[np.int64]]:
    bits = np.empty(count, dtype=np.int64)
    for k in range(count):
        bits[k] = state >> (order - 1) & 1
        fed = sum(state >> (tap - 1) for tap in TAPS[order]) & 1
        state = (state << 1 | fed) & (2**order - 1)
    return bits
