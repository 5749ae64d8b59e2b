"""The next experiment that separates effects: the input on which their predictions differ most.

Candidates are the signals of `smid.signals`, scaled to the recorded range of the input, so that the plant stays within
its known range. All other channels move as they are recorded: held, they would hide what depends on them.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from relaxations.algebra.arrays import Array
from smid.data import Dataset
from smid.data.estimates import estimates_of
from smid.fitting.problem import Fit
from smid.models.simulate import simulate
from smid.models.simulated import standalone
from smid.signals import multisine, noise, prbs, ramp, staircase

_LENGTH = 600
_SEED = 11


@dataclass(frozen=True, eq=False)
class SeparatingExperiment:
    """An input for the next experiment.

    Parameters
    ----------
    signal
        Its kind.
    values
        Shape (n,). The input, in its unit.
    difference
        RMS by which the rivals' predictions differ, in the output's unit.
    rivals
        The effects that it separates.
    sentence
        What to do, in words.
    """

    signal: str
    values: Array
    difference: float
    rivals: tuple[str, ...]
    sentence: str


def separating_experiment(
    rivals: Mapping[str, Fit], data: Dataset, input: str, output: str
) -> SeparatingExperiment | None:
    """Return the input on which the rivals' free runs differ most."""
    recorded = {c.name: np.concatenate([run.values[c.name] for run in data.experiments]) for c in data.channels}
    models = [standalone(fit.model) for fit in rivals.values()]
    best: tuple[float, str, Array] | None = None
    for name, candidate in _candidates(float(recorded[input].min()), float(recorded[input].max())).items():
        channels = {c: np.resize(samples, len(candidate)) for c, samples in recorded.items()}
        channels |= dict.fromkeys((input, *estimates_of(data, input)), candidate)  # a designed input has no noise
        with np.errstate(all="ignore"):
            difference = _difference([simulate(model, channels, check=False)[output] for model in models])
        if np.isfinite(difference) and (best is None or difference > best[0]):
            best = (difference, name, candidate)
    if best is None:
        return None
    difference, name, candidate = best
    units = [f" {data.channel(c).unit}".rstrip() for c in (input, output)]
    sentence = (
        f"To tell {' from '.join(rivals)}, record {len(candidate)} samples with a {name} of {input} between "
        f"{candidate.min():.3g} and {candidate.max():.3g}{units[0]}: there their predictions of {output} differ by "
        f"{difference:.3g}{units[1]} RMS."
    )
    return SeparatingExperiment(name, candidate, difference, tuple(rivals), sentence)


def _candidates(low: float, high: float) -> dict[str, Array]:
    """Return candidate inputs over the recorded range, slow, medium and fast where they have a pace."""
    half, middle = 0.5 * (high - low), 0.5 * (high + low)
    candidates = {"noise": noise(_LENGTH, seed=_SEED)}
    for pace, samples in (("slow", 120), ("medium", 40), ("fast", 12)):
        ramps = np.tile(ramp(2 * samples), -(-_LENGTH // (2 * samples)))[:_LENGTH]
        candidates |= {
            f"{pace} multisine": multisine(_LENGTH, seed=_SEED, lines=tuple(range(1, 2 * _LENGTH // samples + 1))),
            f"{pace} PRBS": prbs(_LENGTH, seed=_SEED, clock_period=samples),
            f"{pace} staircase": staircase(_LENGTH, period=samples),
            f"{pace} ramp up and down": ramps,
        }
    return {name: middle + half * shape for name, shape in candidates.items()}


def _difference(runs: Sequence[Array]) -> float:
    mean = np.mean(runs, axis=0)
    return float(np.sqrt(np.mean([(run - mean) ** 2 for run in runs]))) * 2
