"""Law that a network has learned, chosen as the diagnosis chooses effects.

A law, or a sum of laws, takes the place of the network and is fitted to the record (`smid.hybrid.read_law`). A sum has
two laws and an offset at most: sums of more laws could have any shape. Of each number of parameters the sums nearest to
the curve are fitted. Then the best one is simplified, as long as the merit grows.

The result is a model without a network, which `smid.identify` certifies.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations, islice, product
from typing import TYPE_CHECKING, Any

import numpy as np

from smid.display.result import Part, Tabular
from smid.display.table import Table
from smid.hybrid.ensemble import Ensemble
from smid.hybrid.hybrid_estimate import HybridEstimate
from smid.hybrid.laws import LAWS, Argument, Law
from smid.hybrid.learned_curve import LearnedCurve, argument_of, learned_curve
from smid.hybrid.read_law import Reading, ReadLaw
from smid.models import Model, ModelError

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["LearnedLaw", "learned_law"]

_OFFSET = "offset"
_MOST = 2  # laws in a sum beside an offset
_ROWS = 6
_WORSE = 1.1  # RMS error of a law, by that of the network, beyond which it does not replace the network
_ODDS = 3.0  # nats within which another law may as well be right


@dataclass(frozen=True, eq=False, repr=False)
class LearnedLaw(Tabular):
    """The law that a network has learned, and its rivals.

    Parameters
    ----------
    curve
        Of the network.
    tried
        All sums that were fitted, the one of the largest merit first.
    ratio
        RMS error of the best law on the fitted samples, by that of the network.
    """

    curve: LearnedCurve
    tried: tuple[ReadLaw, ...]
    ratio: float

    @property
    def best(self) -> ReadLaw:
        """Return the law of the largest merit."""
        return self.tried[0]

    @property
    def names(self) -> tuple[str, ...]:
        """Return the names of the laws in the sum."""
        return self.best.names

    @property
    def model(self) -> Model:
        """Return the model with the law in the place of the network, with the fitted values."""
        return self.best.fit.model

    @property
    def sentence(self) -> str:
        """Return the law in a sentence."""
        values = ", ".join(f"{name} = {value:.4g}" for name, value in self.best.values.items())
        where = f"{self.curve.lower:.4g} to {self.curve.upper:.4g}"
        law = f"{self.best.text}, with x = {self.curve.argument} from {where}: {values}"
        if self.ratio > _WORSE:
            return (
                f"No law of the list replaces the network {self.curve.network}. The nearest is {law}; its error is "
                f"{self.ratio:.3g} times that of the network."
            )
        return f"The network {self.curve.network} has learned {law}."

    @property
    def notes(self) -> tuple[str, ...]:
        """Return which other laws may as well be right."""
        near = [one for one in self.tried[1:] if self.best.merit - one.merit < _ODDS]
        if not near:
            return ()
        told = "; ".join(f"{' + '.join(one.names)} ({self.best.merit - one.merit:.2g} nats less)" for one in near[:3])
        return (f"The record hardly tells this law from {told}.",)

    @property
    def table(self) -> Table:
        """Return a row for each of the best sums of laws."""
        rows = tuple((row["laws"], row["formula"], f"{row['behind']:.4g}") for row in islice(self._rows(), _ROWS))
        return Table("", ("laws", "formula", "nats behind"), rows, "llr")

    def _rows(self) -> Iterator[dict[str, Any]]:
        for one in self.tried:
            behind = self.best.merit - one.merit
            yield {"laws": " + ".join(one.names), "formula": one.text, "merit": one.merit, "behind": behind}

    def _content(self) -> Iterator[Part]:
        yield self.sentence
        yield from self.notes
        yield self.table

    def to_dict(self) -> dict[str, Any]:
        """Return the laws, and the model with the best one, as plain data."""
        return {
            "sentence": self.sentence,
            "notes": list(self.notes),
            "tried": [{**row, "values": one.values} for row, one in zip(self._rows(), self.tried, strict=True)],
            "ratio": self.ratio,
            "curve": self.curve.to_dict(),
            "model": self.model.to_dict(),
        }

    def plot(self) -> Figure:
        """Return a figure of the learned curve, its band, and the law."""
        from smid.hybrid.figures import curve_figure

        return curve_figure(self.curve, self.best)


def learned_law(found: HybridEstimate | Ensemble, network: str | None = None, laws: Sequence[Law] = LAWS) -> LearnedLaw:
    """Return the law that a network of one input has learned, from a list of laws.

    Parameters
    ----------
    found
        An ensemble adds the standard deviation of the curve.
    network
        Name; needed if there are several.
    laws
        See `smid.hybrid.laws`.

    Raises
    ------
    ModelError
        If the network has several inputs or is unknown, no law can be simulated, or the list is empty.

    Examples
    --------
    >>> from smid.data import Dataset
    >>> from smid.hybrid import embedded, estimate
    >>> from smid.models import Reactor, signal, t
    >>> u = np.repeat(np.random.default_rng(1).uniform(0.1, 0.9, 40), 5)
    >>> data = Dataset.from_arrays(input={"u": u}, output={"y": u}, sampling_time=1.0)
    >>> plant = Reactor(3.0, sampling_time=1.0).add_term("w", -0.5 * signal("w")[t] ** 2)
    >>> y = plant.simulate(data).outputs[0]["y"] + 0.001 * np.random.default_rng(2).standard_normal(200)
    >>> data = Dataset.from_arrays(input={"u": u}, output={"y": y}, sampling_time=1.0)
    >>> found = estimate(embedded(Reactor(3.0), {"w": 1}, [signal("w")[t]], (2,)), data, starts=1, seed=1)
    >>> learned_law(found).names
    ('quadratic_drag',)
    """
    whole = found.whole if isinstance(found, Ensemble) else found
    term = argument_of(whole, network)
    curve = learned_curve(found, term.name)
    reading = Reading(whole, term, Argument(term.inputs[0], curve.lower, curve.upper))
    offered = [law for law in laws if reading.argument.turns or not law.turning]
    if not offered:
        raise ModelError("no law applies: give laws that suit the range of the network's input")
    # Fit the sums that are nearest to the curve, of each number of parameters; then simplify the best one.
    tried = reading.read(_sums(offered), offered, {})
    while tried and _improved(tried, reading.read(_simpler(_best(tried)[0], offered), offered, tried)):
        pass
    if not tried:
        raise ModelError("with none of the laws the model can be simulated on the record")
    ranked = tuple(tried[names] for names in _best(tried))
    error = whole.fit.cost
    ratio = float(np.sqrt(ranked[0].fit.cost / error)) if error > 0 else np.inf
    return LearnedLaw(curve, ranked, ratio)


def _sums(offered: Sequence[Law]) -> Iterator[frozenset[str]]:
    """Yield the sums of up to two laws, each with and without an offset."""
    names = [law.name for law in offered if law.name != _OFFSET]
    beside = [frozenset({_OFFSET} & {law.name for law in offered}), frozenset[str]()]
    for size, offset in product(range(_MOST + 1), beside):
        yield from (frozenset(chosen) | offset for chosen in combinations(names, size))


def _best(tried: Mapping[frozenset[str], ReadLaw]) -> list[frozenset[str]]:
    """Return the sums that were fitted, the one of the largest merit first."""
    return sorted(tried, key=lambda names: -tried[names].merit)


def _improved(tried: dict[frozenset[str], ReadLaw], read: Mapping[frozenset[str], ReadLaw]) -> bool:
    """Add sums that were fitted, and return whether one of them is the best."""
    before = max((one.merit for one in tried.values()), default=-np.inf)
    tried.update(read)
    return any(one.merit > before for one in read.values())


def _simpler(best: frozenset[str], offered: Sequence[Law]) -> Iterator[frozenset[str]]:
    """Yield a sum without one of its laws, or with one that has fewer parameters in its place."""
    sizes = {law.name: law.size for law in offered}
    for name in sorted(best):
        yield best - {name}
        yield from (best - {name} | {other} for other in sizes if sizes[other] < sizes[name])
