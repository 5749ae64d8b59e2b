"""The proof that a model cannot explain the data: its feasible set is certified empty at the noise bound.

If a part of the record is infeasible, the whole is. So a short window is examined, where the fit errs most; a short
window keeps the relaxation small. The proof holds for *every* value of the free parameters. It also proves that in any
extension the effect's parameters differ from their null values, because at null the extension is the base model.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np

from relaxations.algebra.arrays import Array
from relaxations.deadline import TimeIsUp
from relaxations.errors import ProblemError
from relaxations.search.hierarchy import intervals
from smid.data import DataError, Dataset
from smid.feasible.feasible_set import FeasibleSet
from smid.identification.finite_box import with_finite_box
from smid.models import Model, ModelError

_WINDOWS = (40, 100)
_HEAVIEST = 5


@dataclass(frozen=True)
class Emptiness:
    """A proof that the model does not explain a window of the data.

    Parameters
    ----------
    noise_bound
        In the channel's unit: within it no parameters explain the window.
    first, last
        The window, samples counted from the start of the experiment.
    samples
        Most influential samples, each with its share of the proof.
    """

    channel: str
    unit: str
    noise_bound: float
    experiment: str
    first: int
    last: int
    samples: tuple[tuple[int, float], ...]

    @property
    def sentence(self) -> str:
        """The proof in words."""
        carried = ", ".join(str(sample) for sample, _ in self.samples)
        return (
            f"Proven: no parameters of the base model explain samples {self.first} to {self.last} of {self.experiment} "
            f"within {self.noise_bound:g} {self.unit}".rstrip()
            + f"; the most influential samples are {carried}."
        )

    def to_dict(self) -> dict[str, Any]:
        """Return plain, JSON-ready content."""
        return asdict(self) | {"sentence": self.sentence}


def prove_empty(
    model: Model, data: Dataset, noise_bound: float, channel: str, residual: Sequence[Array]
) -> Emptiness | None:
    """Return a proof that the model cannot explain a window of the data.

    None where no proof was found: then nothing is proven.

    Parameters
    ----------
    noise_bound
        In the output's unit; other noisy channels are not supported here.
    residual
        Shape (n,). Of the fitted model, per experiment.
    """
    number = int(np.argmax([np.abs(r).max() for r in residual]))
    run, error = data.experiments[number], np.asarray(residual[number])
    for width in _WINDOWS:
        size = min(width, run.n_samples)
        power = np.convolve(error**2, np.ones(size), "valid")
        first = int(np.argmax(power))
        part = _window(data, number, first, size)
        try:
            boxed = with_finite_box(FeasibleSet(model, part, {channel: noise_bound}), "clarabel", None)
            if boxed.unbounded:
                continue
            # Any variable serves: an empty set is found with each.
            enclosure = intervals(boxed.feasible.problem, [0], order=1, rounds=3, tolerance=1e-2)
        except (ModelError, DataError, ProblemError, TimeIsUp):
            return None
        if enclosure.empty is not None:
            weights = enclosure.empty.weights
            heaviest = [k for k in np.argsort(weights)[::-1][:_HEAVIEST] if weights[k] > 0]
            samples = tuple((first + int(boxed.feasible.samples[k][1]), float(weights[k])) for k in heaviest)
            unit = data.channel(channel).unit
            return Emptiness(channel, unit, noise_bound, run.name, first, first + size - 1, samples)
    return None


def _window(data: Dataset, number: int, first: int, size: int) -> Dataset:
    run = data.experiments[number]
    values = {name: samples[first : first + size] for name, samples in run.values.items()}
    start = run.start_time + first * data.sampling_time
    return replace(data, experiments=(replace(run, values=values, start_time=start),), resampling=(), n_init=0)
