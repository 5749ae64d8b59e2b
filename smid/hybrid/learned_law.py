"""Law that a network has learned, chosen as the diagnosis chooses effects.

A law, or a sum of laws, takes the place of the network. It begins at its least-squares fit to the learned curve and is
fitted to the record in a free run, together with everything else. Its merit is that of a set of effects: the log
evidence of the record, every sample predicted by a fit that does not see it (`smid.diagnosis.search.evidence`), under
the noise that the network leaves, less the log of the number of sums of the same size. A sum has two laws and an offset
at most: sums of more laws could have any shape. Of each number of parameters the sums nearest to the curve are fitted.
Then the best one is simplified, as long as the merit grows.

The result is a model without a network, which `smid.identify` certifies.

References: those of `smid.diagnosis.search.evidence`.
"""

from __future__ import annotations

from collections.abc import Container, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import combinations, islice, product
from math import comb
from typing import TYPE_CHECKING, Any

import numpy as np
import sympy

from relaxations.algebra.arrays import Array
from smid.diagnosis.search.evidence import evidence
from smid.diagnosis.search.noise_model import NoiseModel, noise_model
from smid.diagnosis.search.record import Record
from smid.display.result import Part, Tabular
from smid.display.table import Table
from smid.fitting.fit import Errors, Fit, Fitting
from smid.hybrid.ensemble import Ensemble
from smid.hybrid.estimate import HybridEstimate
from smid.hybrid.hybrid_model import HybridModel
from smid.hybrid.law_start import Columns, LawStart, evaluated
from smid.hybrid.laws import LAWS, Argument, Law
from smid.hybrid.learned_curve import LearnedCurve, argument_of, learned_curve
from smid.hybrid.neural import NeuralTerm, network_output, without_network
from smid.hybrid.trained_range import network_inputs
from smid.models import Model, ModelError
from smid.models.expressions import shown

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["LearnedLaw", "ReadLaw", "learned_law"]

_OFFSET = "offset"
_MOST, _FITTED = 2, 3  # laws in a sum beside an offset, sums of a number of parameters that are fitted
_ROWS = 6
_SAMPLES = 400  # of the curve, to begin
_EVALUATIONS = 80
_WORSE = 1.1  # RMS error of a law, by that of the network, beyond which it does not replace the network
_ODDS = 3.0  # nats within which another law may as well be right


@dataclass(frozen=True, eq=False)
class ReadLaw:
    """A sum of laws in the place of a network.

    Parameters
    ----------
    names
        Of the laws.
    expression
        In ``x``, the argument of the network.
    parameters
        Names of the parameters in it.
    fit
        Of the model with the law, to the record of the network.
    merit
        In nats.

    Examples
    --------
    >>> from smid.models import Parameter, Reactor
    >>> x, k = sympy.symbols("x N_linear", real=True)
    >>> model = Reactor(2.0).with_parameter(Parameter("N_linear", 0.0, 9.0)).with_values({"N_linear": 2.0})
    >>> law = ReadLaw(("proportional",), k * x, ("N_linear",), Fit(model, (), (), 0.0, 1), 0.0)
    >>> law.text, law(np.array([3.0]))
    ('N_linear*x', array([6.]))
    """

    names: tuple[str, ...]
    expression: sympy.Expr
    parameters: tuple[str, ...]
    fit: Fit
    merit: float

    @property
    def text(self) -> str:
        """Return the law as a formula of x, with the plain sign and without what guards the slope at zero."""
        plain = self.expression.replace(
            lambda node: node.is_Add and node.has(sympy.Abs) and node.args[0].is_Rational,
            lambda node: node - node.args[0],
        )
        return shown(plain.replace(lambda node: isinstance(node, sympy.Max), lambda _: sympy.sign(self._x)))

    @property
    def _x(self) -> sympy.Symbol:
        return next((s for s in self.expression.free_symbols if s.name == "x"), sympy.Symbol("x", real=True))

    @property
    def values(self) -> dict[str, float]:
        """Return the values of the law's parameters."""
        return {name: self.fit.model.values[name] for name in self.parameters}

    def __call__(self, x: Array) -> Array:
        """Return the law at arguments, shape (n,)."""
        numbers = {sympy.Symbol(name, real=True): value for name, value in self.values.items()}
        return evaluated(self.expression.xreplace(numbers), self._x, x)


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
    reading = _Reading(whole, term, Argument(term.inputs[0], curve.lower, curve.upper))
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


@dataclass(frozen=True, eq=False)
class _Reading:
    """The network that is read, and the record under its noise."""

    found: HybridEstimate
    term: NeuralTerm
    argument: Argument

    @cached_property
    def record(self) -> Record:
        data = self.found.data
        channels = self.found.model.output_channels
        there = [
            mask & ~np.any([np.isnan(run.values[c]) for c in channels], axis=0)
            for run, mask in zip(data.experiments, self.found.used, strict=True)
        ]
        return Record(data, tuple(there), data.inputs[0] if data.inputs else channels[0], channels[0])

    @cached_property
    def noise(self) -> NoiseModel:
        """Return the noise that the network leaves, with the discrepancy that laws are granted."""
        own = _errors(self.found.model, self.found.fit, self.record)
        without = without_network(self.found.model, self.term, sympy.Integer(0), [])
        base = _errors(without, self.found.fit, self.record)
        finite = all(np.isfinite(error[self.record.used[e][: error.size]]).all() for e, _, error, _ in base)
        return noise_model(own, self.record.used, base if finite else ())

    @cached_property
    def samples(self) -> tuple[Array, Array]:
        """Return visited arguments and what the network gives there, shape (n,) each."""
        found = self.found
        alone = HybridModel(
            found.model, found.hybrid.white, tuple(p for p in found.hybrid.networks if p.term == self.term)
        )
        inputs = network_inputs(
            alone, lambda model: Fitting(model, found.data, found.used), found.model.values, found.fit.initial
        )
        x = np.sort(np.concatenate([columns[mask, 0] for columns, mask in zip(inputs, found.used, strict=True)]))
        x = x[:: max(1, x.size // _SAMPLES)]
        return x, network_output(found.model, self.term, x[:, None])

    def read(
        self, sums: Iterable[frozenset[str]], offered: Sequence[Law], tried: Container[frozenset[str]]
    ) -> dict[frozenset[str], ReadLaw]:
        """Return the sums that are nearest to the curve, fitted to the record; those that were tried are left out."""
        wanted = sorted({names for names in sums if names and names not in tried}, key=sorted)
        begun = [self._start(tuple(law for law in offered if law.name in names)) for names in wanted]
        sizes = {len(start.parameters) for start in begun}
        of_size = ([start for start in begun if len(start.parameters) == size] for size in sorted(sizes))
        nearest = [start for group in of_size for start in sorted(group, key=lambda one: one.misfit)[:_FITTED]]
        fitted = (self._fitted(one, len(offered)) for one in nearest)
        return {frozenset(one.names): one for one in fitted if one is not None}

    def _start(self, laws: tuple[Law, ...]) -> LawStart:
        return LawStart.of(laws, self.argument, self.samples, self.found.model, self.term.name, self._columns)

    @cached_property
    def _columns(self) -> Columns:
        return {}

    def _fitted(self, start: LawStart, offered: int) -> ReadLaw | None:
        """Return a sum of laws fitted to the record in a free run; None where the run diverges."""
        instead = start.expression(self.argument.x)
        model = without_network(self.found.model, self.term, instead, start.parameters)
        fitting = Fitting(model, self.found.data, self.record.used, self.found.fit.initial, scale=self.found.scale)
        with np.errstate(all="ignore"):
            vector, cost = fitting.solve(fitting.start({**self.found.model.values, **start.values}), _EVALUATIONS)
            fit = fitting.result(vector, cost)
            if not (np.isfinite(cost) and fit.is_finite):
                return None
            boxes = {p.name: p.upper - p.lower for p in start.parameters}
            found = evidence(self.record, self.noise, fit, boxes)
        names = tuple(sorted(law.name for law in start.laws))
        merit = found.value - float(np.log(comb(offered, len(names))))
        return ReadLaw(names, start.expression(self.argument.symbol), tuple(boxes), fit, merit)


def _errors(model: Model, fit: Fit, record: Record) -> Errors:
    """Return the errors of the free run of a model, from the initial states of a fit."""
    fitting = Fitting(model, record.data, record.used, fit.initial)
    with np.errstate(all="ignore"):
        return tuple(fitting.errors(fitting.at(fit.model.values, fit.initial), False))
