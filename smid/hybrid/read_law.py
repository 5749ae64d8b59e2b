"""Laws in the place of a network, fitted to the record that trained it.

A sum of laws begins at its least-squares fit to the learned curve (`smid.hybrid.law_start`) and is fitted to the record
in a free run, together with everything else. Its merit is that of a set of effects: the log evidence of the record,
every sample predicted by a fit that does not see it (`smid.diagnosis.search.evidence`), under the noise that the
network leaves, less the log of the number of sums of the same size.

References: those of `smid.diagnosis.search.evidence`.
"""

from __future__ import annotations

from collections.abc import Container, Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property
from math import comb

import numpy as np
import sympy

from relaxations.algebra.arrays import Array
from smid.diagnosis.search.evidence import evidence
from smid.diagnosis.search.noise_model import NoiseModel, noise_model
from smid.diagnosis.search.record import Record
from smid.fitting.problem import Errors, Fit, Fitting
from smid.hybrid.hybrid_estimate import HybridEstimate
from smid.hybrid.hybrid_model import HybridModel
from smid.hybrid.law_start import Columns, LawStart, evaluated
from smid.hybrid.laws import Argument, Law
from smid.hybrid.neural import NeuralTerm, network_output, without_network
from smid.hybrid.trained_range import network_inputs
from smid.models import Model
from smid.models.expressions import shown

__all__ = ["ReadLaw", "Reading"]

_FITTED = 3  # sums of a number of parameters that are fitted
_SAMPLES = 400  # of the curve, to begin
_EVALUATIONS = 80


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


@dataclass(frozen=True, eq=False)
class Reading:
    """The network that is read, and the record under its noise."""

    found: HybridEstimate
    term: NeuralTerm
    argument: Argument

    @cached_property
    def record(self) -> Record:
        """Return the fitted samples that are there in every output."""
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
