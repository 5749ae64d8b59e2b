"""Hybrid model: a first-principles model and a network in one model.

The functions `series`, `parallel`, `simultaneous` and `embedded` build it. `estimate` fits it to data.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

from smid.data import Dataset
from smid.display.result import Part, Result
from smid.fitting.binding import bind
from smid.hybrid.back_couplings import BackCouplings
from smid.hybrid.neural import NeuralTerm
from smid.models import Measurement, Model, ModelError
from smid.models.symbols import rename_signals

__all__ = ["HYBRID", "HybridModel", "bound_to", "measure_instead", "output_measurement"]

HYBRID = "hybrid"
"""Name of the hybrid model's output signal."""


@dataclass(frozen=True, repr=False)
class HybridModel(Result):
    """First-principles model and network in one model.

    Parameters
    ----------
    model
        Its parameters are those of the first-principles model, then the weights.
    white
        First-principles model alone.
    """

    model: Model
    term: NeuralTerm
    white: Model
    topology: str
    couplings: BackCouplings

    def _content(self) -> Iterator[Part]:
        yield f"{self.white.name} with a network ({self.topology}). The network reads {self.couplings}."
        yield self.model


def output_measurement(white: Model, output: str | None) -> Measurement:
    """Return the measurement of an output channel; None stands for the only output."""
    channels = white.output_channels
    chosen = channels[0] if output is None and len(channels) == 1 else output
    if chosen not in channels:
        raise ModelError(f"output = {output!r} is not an output of {white.name!r}: name one of {', '.join(channels)}")
    return next(item for item in white.measurements if item.channel == chosen)


def measure_instead(model: Model, old: Measurement, name: str) -> Model:
    """Return the model with a measurement of another signal."""
    changed = tuple(replace(item, signal=name) if item is old else item for item in model.measurements)
    return replace(model, measurements=changed)


def bound_to(hybrid: HybridModel, data: Dataset) -> HybridModel:
    """Return the hybrid model with the channel names and the sampling time of the data."""
    model, white = bind(hybrid.model, data), bind(hybrid.white, data)
    names = dict(zip(hybrid.model.inputs, model.inputs, strict=True))
    term = replace(hybrid.term, inputs=tuple(rename_signals(item, names) for item in hybrid.term.inputs))
    return replace(hybrid, model=model, term=term, white=white)
