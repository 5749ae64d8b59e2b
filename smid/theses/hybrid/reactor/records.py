"""The records of the reactor studies: a plant under one of the thesis's inputs, and its first-principles model.

All are sampled at 1 s, as in the thesis, and begin at the first sample of the input. The input lies within 0.1 to 0.9;
the staircase has steps of 0.1, each of 20 samples, and noise of 0.05.

Reference: hybrid thesis, listings K.1 and K.4, figure A.14.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np

from relaxations.algebra.arrays import Array
from smid.data import Dataset
from smid.fitting.binding import bind
from smid.hybrid.hybrid_model import HYBRID, HybridModel
from smid.models import Model, Reactor, simulate
from smid.models.errors import refuse_unknown
from smid.signals import constant, noise, noisy_staircase, qprts, sine
from smid.theses.hybrid.full_reactor import simulate_full_reactor
from smid.theses.hybrid.plants import MISMATCHES, reactor_base, simulate_reactor

__all__ = ["PLANTS", "SIGNALS", "first_principles", "free_run", "reactor_record", "white_reactor"]

SAMPLING_TIME = 1.0
FULL = "full_balances"
PLANTS: tuple[str, ...] = (*MISMATCHES, FULL)
"""Table 2, the plant of (5.12), and the full balances."""

REACH, TRAINING, VALIDATION = 0.4, 340, 100
SUBSTEPS = 4  # of Runge and Kutta's scheme: the white model's error is then below 1e-6

SIGNALS = ("noisy_staircase", "sine", "constant", "noise", "qprts")


def reactor_record(
    plant: str, signal: str = "noisy_staircase", seed: int = 1, *, noise_share: float = 0.0, level: float = 0.5
) -> Dataset:
    """Simulate a reactor under one of the thesis's inputs: input ``u`` and output ``y``.

    Parameters
    ----------
    plant, signal
        One of `PLANTS`, and one of `SIGNALS`.
    seed
        Of the noise, in input and output, and of the QPRTS.
    noise_share
        Bound of the uniform noise on the output, as a share of the output's span.
    level
        Centre of the input, in mol/m3.

    Raises
    ------
    ModelError
        If the plant or the signal is not known.

    Examples
    --------
    >>> reactor_record("factor", "constant").values("y")[[0, -1]].round(3)
    array([0.5 , 0.19])
    """
    refuse_unknown("plant", [plant], PLANTS)
    refuse_unknown("signal", [signal], SIGNALS)
    return _record(plant, signal, seed, noise_share, level)


@cache  # the studies of one run share records
def _record(plant: str, signal: str, seed: int, noise_share: float, level: float) -> Dataset:
    u = _input(signal, seed, level)
    y = simulate_full_reactor(u, SAMPLING_TIME) if plant == FULL else simulate_reactor(plant, u, SAMPLING_TIME)
    if noise_share:
        y = y + noise_share * np.ptp(y) * np.random.default_rng(seed).uniform(-1.0, 1.0, y.size)
    data = Dataset.from_arrays(input={"u": u}, output={"y": y}, sampling_time=SAMPLING_TIME, name=signal)
    return replace(data, source=f"{plant}, {signal} (simulated)")


def _input(signal: str, seed: int, level: float) -> Array:
    if signal == "constant":
        return constant(VALIDATION, offset=level)
    if signal == "sine":
        return sine(100, amplitude=REACH, offset=level)
    if signal == "noise":
        return noise(TRAINING, seed=seed, amplitude=REACH, offset=level)
    if signal == "qprts":
        return qprts(TRAINING, seed=seed, offset=level)
    return noisy_staircase(TRAINING, seed=seed, steps=4, amplitude=REACH, offset=level, noise_amplitude=0.05)


def white_reactor(plant: str) -> Model:
    """Return the first-principles model of one of `PLANTS`: a `Reactor` with fixed parameters.

    Raises
    ------
    ModelError
        If the plant is not known.

    Examples
    --------
    >>> white_reactor("time_constant").parameter("tau").lower  # s; the plant's is 2 s
    4.0
    """
    refuse_unknown("plant", [plant], PLANTS)
    return replace(Reactor(2.0) if plant == FULL else reactor_base(plant), substeps=SUBSTEPS)


def first_principles(plant: str, data: Dataset) -> Array:
    """Return the free run of the first principles alone from the input's start, shape (n,)."""
    return white_reactor(plant).simulate(data, initial={"w": data.values("u")[:1]}).outputs[0]["y"]


def free_run(hybrid: HybridModel, data: Dataset) -> Array:
    """Return the free run of an estimated hybrid reactor from the plant's start, shape (n,); not finite if unstable."""
    model, u = hybrid.model, data.values("u")
    white = bind(hybrid.white, data)
    values = {p.name: model.values[p.name] for p in white.parameters if p.name in model.values}
    alone = simulate(white, {"u": u}, values, {"w": u[:1]})["w"]
    first = {"w": alone, HYBRID: data.values("y")}
    initial = {line.signal: first[line.signal][: model.max_lag] for line in model.lines}
    return simulate(model, {"u": u}, initial=initial, check=False)["y"]
