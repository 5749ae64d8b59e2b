"""Maps with memory, on the fine grid: play by contact, a pipe, relays of Preisach, limited slope, lags, stiction.

They are written as the mechanisms they stand for, not as the operators a model would use.
"""

from __future__ import annotations

import numpy as np
from scipy.signal import cont2discrete, lfilter

from relaxations.algebra.arrays import Array

__all__ = ["lag", "pipe", "play", "relays", "ring", "slope_limited", "sticking_valve"]


def pipe(fine: Array, flow: Array, volume: float) -> Array:
    """Pass parcels through a pipe, each pushed on by those behind it.

    Parameters
    ----------
    fine : numpy.ndarray, shape (m,)
        What enters; the pipe is full of the first value.
    flow : numpy.ndarray, shape (m,)
        Volume that enters per substep, positive.
    volume : float
        Volume of the pipe.

    Returns
    -------
    numpy.ndarray, shape (m,)
        What leaves at the beginning of each substep.

    Examples
    --------
    >>> pipe(np.array([0.0, 1.0, 2.0, 3.0]), np.array([1.0, 1.0, 2.0, 1.0]), 2.0)
    array([0., 0., 0., 2.])
    """
    entered = np.concatenate([[0.0], np.cumsum(flow)[:-1]])
    # The parcel that leaves has just the pipe's volume behind it; rounding must not leave it one parcel behind.
    parcel = np.searchsorted(entered, entered - volume * (1 - 1e-12), side="right") - 1
    return np.asarray(fine[np.maximum(parcel, 0)])


def play(fine: Array, gap: float, slack: float) -> Array:
    """Drive a load through a gap.

    Parameters
    ----------
    fine : numpy.ndarray, shape (m,)
        Position of the driver.
    gap : float
        Width of the play.
    slack : float
        Distance of the driver from the lower wall at first, within [0, gap].

    Returns
    -------
    numpy.ndarray, shape (m,)
        Position of the load, which moves only while a wall pushes it.

    Examples
    --------
    >>> play(np.array([0.0, 1.0, 2.0, 1.5]), 1.0, 0.5)
    array([0. , 0.5, 1.5, 1.5])
    """
    out = np.empty_like(fine)
    load, previous = float(fine[0]) - slack + gap / 2, float(fine[0])
    for j, driver in enumerate(fine.tolist()):
        slack += driver - previous
        previous = driver
        if slack > gap:  # the upper wall is pushed
            load += slack - gap
            slack = gap
        elif slack < 0.0:  # the lower wall is pulled
            load += slack
            slack = 0.0
        out[j] = load
    return out


def relays(fine: Array, low: float, high: float, share: float, count: int = 400) -> Array:
    """Mix the input with the mean of Preisach relays, uniformly spread over the half plane of thresholds.

    Parameters
    ----------
    fine : numpy.ndarray, shape (m,)
        Input.
    low, high : float
        Range of the thresholds.
    share : float
        Part of the relays in the result, within [0, 1].
    count : int
        Thresholds along each axis.

    Returns
    -------
    numpy.ndarray, shape (m,)
        Within [low, high] when the input is.

    Examples
    --------
    >>> relays(np.array([-1.0, 1.0, 0.0]), -1.0, 1.0, 1.0)[:2]
    array([-1.,  1.])
    """
    levels = low + (high - low) * (np.arange(count) + 0.5) / count
    up, down = np.meshgrid(levels, levels, indexing="ij")
    keep = up >= down
    up, down = up[keep], down[keep]
    middle, half = (low + high) / 2, (high - low) / 2
    state = np.where(up + down < 2 * fine[0], 1.0, -1.0)
    out = np.empty_like(fine)
    previous, value = np.nan, 0.0
    for j, now in enumerate(fine.tolist()):
        if now != previous:
            state[up < now] = 1.0
            state[down > now] = -1.0
            value = middle + half * float(np.mean(state))
            previous = now
        out[j] = (1 - share) * now + share * value
    return out


def slope_limited(fine: Array, limit: float) -> Array:
    """Follow the input with a limited step per substep, from rest at its first value.

    Parameters
    ----------
    fine : numpy.ndarray, shape (m,)
        Input.
    limit : float
        Largest change per substep.

    Returns
    -------
    numpy.ndarray, shape (m,)
        The limited signal.

    Examples
    --------
    >>> slope_limited(np.array([0.0, 2.0, 2.0]), 1.0)
    array([0., 1., 2.])
    """
    out = np.empty_like(fine)
    now = float(fine[0])
    for j, target in enumerate(fine.tolist()):
        now += min(limit, max(-limit, target - now))
        out[j] = now
    return out


def lag(fine: Array, ratio: float) -> Array:
    """Pass a first order lag of unit gain, averaged over each substep.

    Parameters
    ----------
    fine : numpy.ndarray, shape (m,)
        Input, at rest before.
    ratio : float
        Substep over time constant.

    Returns
    -------
    numpy.ndarray, shape (m,)
        Mean of the lag's output over each substep.

    Examples
    --------
    >>> bool(abs(lag(np.ones(400), 0.1)[-1] - 1) < 1e-12)
    True
    """
    pole = np.exp(-ratio)
    ends = lfilter([1 - pole], [1.0, -pole], fine)
    begins = np.concatenate([[0.0], ends[:-1]])
    # The exact mean of an exponential from `begins` towards `fine`.
    return np.asarray(fine + (begins - fine) * (1 - pole) / ratio)


def ring(fine: Array, omega_h: float, damping: float) -> Array:
    """Pass a complex pole pair of unit gain, averaged over each substep by the trapezoidal rule.

    Parameters
    ----------
    fine : numpy.ndarray, shape (m,)
        Input, at rest before.
    omega_h : float
        Natural angular frequency times the substep.
    damping : float
        Damping ratio below 1.

    Returns
    -------
    numpy.ndarray, shape (m,)
        The ringing signal.

    Examples
    --------
    >>> bool(ring(np.ones(100), 0.1, 0.2).max() > 1.2)
    True
    """
    a = np.array([[0.0, 1.0], [-(omega_h**2), -2 * damping * omega_h]])
    discrete = cont2discrete((a, np.array([[0.0], [omega_h**2]]), np.array([[1.0, 0.0]]), np.zeros((1, 1))), 1.0)
    phi, gamma = discrete[0], discrete[1][:, 0]
    numerator = [0.0, gamma[0], phi[0, 1] * gamma[1] - phi[1, 1] * gamma[0]]
    begins = lfilter(numerator, [1.0, -np.trace(phi), np.linalg.det(phi)], fine)
    ends = np.concatenate([begins[1:], begins[-1:]])
    return np.asarray((begins + ends) / 2)


def sticking_valve(fine: Array, breakaway: float, sliding: float) -> Array:
    """Move a stem without mass by a spring from the command, against dry friction.

    Parameters
    ----------
    fine : numpy.ndarray, shape (m,)
        Command.
    breakaway, sliding : float
        Friction from rest and when moving, in units of the command; ``breakaway >= sliding``.

    Returns
    -------
    numpy.ndarray, shape (m,)
        Position of the stem. Damping lets it cover 80 % of its way in a substep.

    Examples
    --------
    >>> sticking_valve(np.array([0.0, 1.0, 2.0, 2.0, 2.0, 2.0, 2.0]), 1.5, 0.5).round(2)
    array([0.  , 0.  , 1.2 , 1.44, 1.49, 1.5 , 1.5 ])
    """
    out = np.empty_like(fine)
    stem, way = float(fine[0]), 0
    for j, command in enumerate(fine.tolist()):
        force = command - stem
        if way == 0 and abs(force) > breakaway:
            way = 1 if force > 0 else -1
        if way:
            speed = way * force - sliding
            stem += way * 0.8 * max(0.0, speed)
            if speed < 1e-3 * breakaway:
                way = 0
        out[j] = stem
    return out
