"""The proof that the base model cannot explain the data: it is excluded on a window.

It holds for *every* value of the free parameters within their boxes. It also proves that in any extension the effect's
parameters differ from their null values, because at null the extension is the base model.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

from relaxations.algebra.arrays import Array
from smid.data import Dataset
from smid.diagnosis.proof.decide import Decision, decide
from smid.diagnosis.proof.posed import ASSUMED
from smid.diagnosis.proof.window import windows
from smid.models import Model

_SIZES = (40, 100)
_SECONDS = 20.0  # for each window


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
        influential = "samples are" if len(self.samples) > 1 else "sample is"
        return (
            f"Proven: no parameters of the base model explain samples {self.first} to {self.last} of {self.experiment} "
            f"within {self.noise_bound:g} {self.unit}".rstrip()
            + f" ({ASSUMED}); the most influential {influential} {carried}."
        )

    @staticmethod
    def of(found: Decision, channel: str, unit: str, noise_bound: float, experiment: str) -> Emptiness:
        """Return the statement of a base model that is excluded."""
        return Emptiness(channel, unit, noise_bound, experiment, found.first, found.last, found.samples)

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
    model
        With values.
    noise_bound
        In the output's unit; other noisy channels are not supported here.
    residual
        Shape (n,). Of the fitted model, per experiment.
    """
    try:
        for window in windows(residual, _SIZES):
            found = decide(model, data, window, {channel: noise_bound}, _SECONDS)
            if found.excluded:
                run = data.experiments[window.experiment].name
                return Emptiness.of(found, channel, data.channel(channel).unit, noise_bound, run)
    except KeyboardInterrupt:  # the diagnosis is kept
        pass
    return None
