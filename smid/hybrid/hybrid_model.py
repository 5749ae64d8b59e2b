"""Hybrid model: a first-principles model and one or more networks in one model.

The functions `series`, `parallel`, `simultaneous`, `embedded`, `upstream` and `network_only` build it, each from a
model or from a hybrid model: so networks stand in several places and on several outputs. `estimate` fits it to data.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

from smid.data import Dataset
from smid.display.result import Part, Result
from smid.fitting.binding import bind
from smid.hybrid.back_couplings import BackCouplings
from smid.hybrid.neural import NeuralTerm, without_network
from smid.models import Measurement, Model, ModelError
from smid.models.edit_lines import free_name
from smid.models.symbols import rename_signals

__all__ = ["HYBRID", "HybridModel", "Placed", "bound_to", "joined", "measure_instead", "output_measurement"]

HYBRID = "hybrid"
"""Name of the hybrid model's output signal; those of further outputs are numbered."""


@dataclass(frozen=True)
class Placed:
    """A network in its place.

    Parameters
    ----------
    topology
        Where it stands: "series", "parallel", "embedded", ...

    Examples
    --------
    >>> from smid.hybrid import EXTRA, series
    >>> from smid.models import Reactor
    >>> placed = series(Reactor(2.0), EXTRA).networks[0]
    >>> placed.topology, placed.term.name
    ('series', 'N')
    """

    term: NeuralTerm
    topology: str
    couplings: BackCouplings


@dataclass(frozen=True, repr=False)
class HybridModel(Result):
    """First-principles model and networks in one model.

    Parameters
    ----------
    model
        Its parameters are those of the first-principles model, then the weights.
    white
        First-principles model alone.

    Raises
    ------
    ModelError
        On `term`, `topology` and `couplings`, if there are several networks.
    """

    model: Model
    white: Model
    networks: tuple[Placed, ...]

    @property
    def only(self) -> Placed:
        """Return the only network."""
        if len(self.networks) != 1:
            names = ", ".join(placed.term.name for placed in self.networks)
            raise ModelError(f"the hybrid model has the networks {names}: this needs one with a single network")
        return self.networks[0]

    @property
    def term(self) -> NeuralTerm:
        """Return the expression of the only network."""
        return self.only.term

    @property
    def topology(self) -> str:
        """Return the topology of the only network."""
        return self.only.topology

    @property
    def couplings(self) -> BackCouplings:
        """Return the back couplings of the only network."""
        return self.only.couplings

    def network(self, name: str | None = None) -> NeuralTerm:
        """Return the expression of a network by its name; by default the only one.

        Raises
        ------
        ModelError
            If there is none of that name, or there are several and no name is given.
        """
        found = [placed.term for placed in self.networks if placed.term.name == name]
        if name is not None and not found:
            names = ", ".join(placed.term.name for placed in self.networks)
            raise ModelError(f"the hybrid model has no network {name!r}: name one of {names}")
        return found[0] if found else self.only.term

    def with_terms(self, *terms: NeuralTerm) -> HybridModel:
        """Return the model with other networks in the places of its own, in their order; boxes and values stay."""
        model = self.model
        for placed, term in zip(self.networks, terms, strict=True):
            kept = [model.parameter(parameter.name) for parameter in term.parameters]
            values = {p.name: model.values[p.name] for p in kept if p.name in model.values}
            model = without_network(model, placed.term, term.expression, kept).with_values(values)
        networks = tuple(replace(placed, term=term) for placed, term in zip(self.networks, terms, strict=True))
        return replace(self, model=model, networks=networks)

    def _content(self) -> Iterator[Part]:
        for placed in self.networks:
            yield f"{self.white.name} with a network ({placed.topology}). The network reads {placed.couplings}."
        yield self.model


def joined(white: Model | HybridModel, model: Model, placed: Placed) -> HybridModel:
    """Return a hybrid model that has one more network than what it was built from."""
    before = white.networks if isinstance(white, HybridModel) else ()
    return HybridModel(model, white.white if isinstance(white, HybridModel) else white, (*before, placed))


def whole(white: Model | HybridModel) -> Model:
    """Return the model of what is joined."""
    return white.model if isinstance(white, HybridModel) else white


def output_measurement(white: Model, output: str | None) -> Measurement:
    """Return the measurement of an output channel; None stands for the only output."""
    channels = white.output_channels
    chosen = channels[0] if output is None and len(channels) == 1 else output
    if chosen not in channels:
        raise ModelError(f"output = {output!r} is not an output of {white.name!r}: name one of {', '.join(channels)}")
    return next(item for item in white.measurements if item.channel == chosen)


def hybrid_name(model: Model) -> str:
    """Return the name of a new output signal."""
    return free_name(model, HYBRID)


def measure_instead(model: Model, old: Measurement, name: str) -> Model:
    """Return the model with a measurement of another signal."""
    changed = tuple(replace(item, signal=name) if item is old else item for item in model.measurements)
    return replace(model, measurements=changed)


def bound_to(hybrid: HybridModel, data: Dataset) -> HybridModel:
    """Return the hybrid model with the channel names and the sampling time of the data."""
    model, white = bind(hybrid.model, data), bind(hybrid.white, data)
    names = dict(zip(hybrid.model.inputs, model.inputs, strict=True))
    networks = tuple(
        replace(placed, term=replace(placed.term, inputs=tuple(rename_signals(i, names) for i in placed.term.inputs)))
        for placed in hybrid.networks
    )
    return HybridModel(model, white, networks)
