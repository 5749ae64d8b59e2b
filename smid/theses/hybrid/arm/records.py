"""Records of the simulated arm: ten seconds, sampled every 0.02 s, under the inputs of table F.1.

There are two kinds. The thesis integrates by Euler's method in steps of 0.002 s and keeps every tenth sample of input
and output; the input of its models is on average 9 ms early. A computer that drives a motor holds its voltage between
samples, as `held_record` does, whose motion is exact.

Reference: hybrid thesis, listings K.13, K.14 and K.22, table F.1.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from relaxations.algebra.arrays import Array
from smid.data import DataError, Dataset
from smid.signals import TABLE_F1, Sines
from smid.theses.hybrid.arm.exact_motion import ARM, exact_motion
from smid.theses.hybrid.plants import arm_friction

__all__ = ["SAMPLING_TIME", "held_record", "other_kind", "slower", "thesis_record"]

SAMPLING_TIME, KEPT, DURATION = 0.02, 10, 10.0  # s, of how many, s


def slower(sines: Sines) -> Sines:
    """Return validation sines of the same kind: 10 % slower and 10 % weaker than those of a record.

    The arm's speeds then stay within those of the training for every input of table F.1. With sines 10 % faster they do
    not for two inputs. Figure F.4 also validates with "a similar input signal".

    Examples
    --------
    >>> slower(Sines((1.5,), (1.0,)))
    Sines(frequencies=(1.35,), amplitudes=(0.9,))
    """
    frequencies = tuple(round(0.9 * frequency, 6) for frequency in sines.frequencies)
    return Sines(frequencies, tuple(0.9 * amplitude for amplitude in sines.amplitudes))


def other_kind(sines: Sines) -> Array:
    """Return a validation voltage of another kind, every 0.02 s for ten seconds, shape (n,).

    For one sine it is the sum ``six_unequal``, as in figure F.8; for a sum it is one sine. It is weakened in steps of
    5 % until the arm's speeds stay within those of the training. If the arm never turns backwards in the training, the
    voltage is raised until it is not negative.

    Examples
    --------
    >>> float(other_kind(Sines((0.4, 0.9), (0.2, 0.2))).max().round(2))
    0.3
    """
    wave = _voltage(TABLE_F1["six_unequal" if len(sines.frequencies) == 1 else "one_sine"], SAMPLING_TIME)
    seen = _speed(_voltage(sines, SAMPLING_TIME))
    raised = wave - wave.min() if seen.min() > -ARM["eps"] else wave
    for share in np.arange(1.0, 0.0, -0.05):
        speed = _speed(share * raised)
        if seen.min() - ARM["eps"] <= speed.min() and speed.max() <= seen.max():
            break
    return share * raised


def _speed(u: Array) -> Array:
    return exact_motion(u, SAMPLING_TIME)[:, 1]


def held_record(
    u: Sines | ArrayLike,
    *,
    noise_bound: float = 0.0,
    seed: int | np.random.Generator | None = None,
    duration: float = DURATION,
) -> Dataset:
    """Simulate the arm exactly, from rest, under a voltage that is held between samples.

    Channels: input ``u`` in V, output ``y``, the angle in rad, and ``speed`` in rad/s without noise.

    Parameters
    ----------
    u
        Shape (n,). Motor voltage in V every 0.02 s, or a sum of sines.
    noise_bound
        Of the uniform noise on the angle, in rad.
    seed
        Needed if there is noise.
    duration
        Of the sines, in seconds.

    Raises
    ------
    DataError
        If the input is not a finite series, the bound is negative, or there is noise without a seed.

    Examples
    --------
    >>> held_record([0.05, 0.05, 0.05]).experiments[0].values["speed"].round(6)
    array([0.     , 0.01995, 0.01995])
    """
    inputs = _voltage(u, SAMPLING_TIME, duration) if isinstance(u, Sines) else np.asarray(u, dtype=np.float64)
    angle, speed = exact_motion(inputs, SAMPLING_TIME).T
    return _dataset(inputs, angle, speed, noise_bound, seed)


def thesis_record(
    sines: Sines,
    *,
    noise_bound: float = 0.0,
    seed: int | np.random.Generator | None = None,
    duration: float = DURATION,
) -> Dataset:
    """Simulate the arm as the thesis did: Euler's method, 0.002 s, every tenth sample kept.

    The other parameters and the channels are those of `held_record`.

    Raises
    ------
    DataError
        If the bound is negative, or there is noise without a seed.

    Examples
    --------
    >>> thesis_record(Sines((1.5,), (1.0,))).experiments[0].n_samples
    501
    """
    step = SAMPLING_TIME / KEPT
    inputs = _voltage(sines, step, duration)
    law = [ARM[name] for name in ("Ws", "eps", "Wd", "b")]
    angle = speed = 0.0
    states = []
    for voltage in inputs.tolist():
        states.append((angle, speed))
        rate = ARM["theta"] * (ARM["c"] * voltage - arm_friction(speed, *law))
        angle, speed = angle + step * speed, speed + step * rate
    kept = np.array(states)[::KEPT]
    return _dataset(inputs[::KEPT], kept[:, 0], kept[:, 1], noise_bound, seed)


def _voltage(sines: Sines, sampling_time: float, duration: float = DURATION) -> Array:
    return sines.signal(round(duration / sampling_time) + 1, sampling_time)


def _dataset(
    u: Array, angle: Array, speed: Array, noise_bound: float, seed: int | np.random.Generator | None
) -> Dataset:
    if not (np.isfinite(noise_bound) and noise_bound >= 0) or (noise_bound and seed is None):
        raise DataError(f"noise_bound = {noise_bound}, seed = {seed}: give a bound that is not negative, and a seed")
    noise = np.random.default_rng(seed).uniform(-noise_bound, noise_bound, angle.size) if noise_bound else 0.0
    data = Dataset.from_arrays(input={"u": u}, output={"y": angle + noise}, sampling_time=SAMPLING_TIME, speed=speed)
    return replace(data, source="rotating arm (simulated)")
