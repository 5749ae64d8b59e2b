"""A model with free coefficients: linear in all that it does not know, where the diagnosed one has products of it.

Written out, each line is a sum of products of signals, each with a coefficient in which parameters alone occur. Over
wide boxes, products of parameters cost most of what the samples say, and boxes are cut without end. So each
coefficient becomes an unknown of its own, with the range that it has over the boxes of the parameters. If no free
coefficients fit, no parameters do.

What the inputs drive through a curve or a hysteresis takes few values in a window (:mod:`.driven`), and each of them
times what it is multiplied by is such a coefficient. So the parameters of these effects need no cuts.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import sympy

from relaxations.algebra.arrays import Array
from smid.data import Dataset
from smid.diagnosis.proof.driven import Driven, driven_signals, upstream
from smid.diagnosis.proof.posed import with_channel
from smid.identification.inversion.record import Record
from smid.models import Line, Model, Parameter, signal, t
from smid.models.distribute import coefficients
from smid.models.hidden_states import first_instants, without_hidden_states
from smid.models.structure import exogenous
from smid.models.symbols import inlined, number, plain_symbols, references, unused

_Ends = tuple[float, float]

_ROUNDED = 1 + 1e-9
_MORE = 6.0
"""So many coefficients for each parameter are worth a proof: more of them hardly leave a contradiction."""

_LARGEST = 1000
"""Parts of a line: longer ones, which hold the same part again and again, take minutes to be written out."""


@dataclass(frozen=True, eq=False)
class Freed:
    """A record of a model with free coefficients.

    Parameters
    ----------
    meanings
        What a free coefficient is of the parameters of the model, by its name. The value of a hold is nothing of them.
    """

    record: Record
    meanings: Mapping[str, sympy.Expr]

    def told(self, record: Record, bounds: Mapping[str, float], lower: Array, upper: Array) -> Record:
        """Return the record of the model with what a box of the unknowns says of the parameters.

        Parameters
        ----------
        record
            Of the model itself.
        bounds
            Of each noisy channel, in its unit.
        lower, upper
            That hold all unknowns that fit, shape (unknowns,).
        """
        constraints, sizes = list[sympy.Expr](), dict[sympy.Basic, int]()
        for k, parameter in enumerate(self.record.model.parameters):
            meaning = self.meanings.get(parameter.name)
            if meaning is None or _size(meaning, sizes) > _LARGEST:
                continue
            if lower[k] > self.record.lower[k]:
                constraints.append(meaning - number(lower[k]))
            if upper[k] < self.record.upper[k]:
                constraints.append(number(upper[k]) - meaning)
        model = replace(record.model, constraints=(*record.model.constraints, *constraints))
        found = Record(model, record.data, bounds, whole=record.whole)
        found.frame = record.frame
        return found


def with_free_coefficients(record: Record, bounds: Mapping[str, float]) -> tuple[Freed, ...]:
    """Return records of the model with free coefficients: with few numbers of what inputs drive, and with many.

    Hidden states that enter linearly are eliminated: what is left is linear in coefficients again. None is returned
    where there are too many coefficients, or none.

    Parameters
    ----------
    record
        With finite boxes of the parameters, in samples.
    bounds
        Of each noisy channel, in its unit.
    """
    if record.model.enclosed:
        return ()
    many, known = list(driven_signals(record)), {p.name: p.symbol for p in record.model.parameters}
    few = [one for one in many if one.few]
    choices = [few, many] if len(few) < len(many) else [many]
    found = (_free(*_without_driven(record, bounds, some), bounds, known) for some in choices)
    return tuple(one for one in found if one is not None)


def _free(
    driven: Record, numbers: Mapping[str, str], bounds: Mapping[str, float], known: Mapping[str, sympy.Expr]
) -> Freed | None:
    """Return the record with free coefficients of one whose driven signals are numbers."""
    sizes = dict[sympy.Basic, int]()
    if any(_size(line.expression, sizes) > _LARGEST for line in driven.model.lines):
        return None
    found = _freed(Freed(driven, known), bounds, numbers)
    if found is None or _first(found.record).items() - _first(driven).items():
        return None  # what cancels must not move the sample from which a line holds
    is_new = any(p.name not in known for p in found.record.model.parameters)
    if found.record.hidden:
        model = replace(found.record.model, bounds={})
        plain = without_hidden_states(model)
        if set(plain.states) <= {m.signal for m in plain.measurements}:
            shorter = Record(plain, driven.data, bounds, whole=driven.whole)
            again, since = _freed(Freed(shorter, found.meanings), bounds, numbers), first_instants(model)
            if again is not None and all(n >= since.get(name, 0) for name, n in _first(again.record).items()):
                found, is_new = again, True
    most = _MORE * (len(known) + len(numbers))
    return found if is_new and len(found.record.model.parameters) <= most else None


def _without_driven(
    record: Record, bounds: Mapping[str, float], signals: Sequence[Driven]
) -> tuple[Record, dict[str, str]]:
    """Return the record with driven signals written as their numbers.

    With it the channels that tell which number each sample has, and the signal that each is of.
    """
    model, data, taken = record.model, record.data, {*record.model.names, *record.data.names}
    written, parameters, numbers = dict[str, sympy.Expr](), list[Parameter](), dict[str, str]()
    for driven in signals:
        names = [_new(f"{driven.signal}_at_{place}", taken) for place in range(len(driven.values))]
        for place, name in enumerate(names):
            data = with_channel(data, name, [own[:, place] for own in driven.samples])
        terms = (value * signal(name)[t] for value, name in zip(driven.values, names, strict=True))
        written[driven.signal] = sympy.Add(*terms)
        parameters += driven.parameters
        numbers |= dict.fromkeys(names, driven.signal)
    if not written:
        return record, {}
    lines = {line.signal: inlined(line.expression, written) for line in model.lines}
    needed = upstream(lines, {m.signal for m in model.measurements})
    model = replace(
        model,
        parameters=(*model.parameters, *parameters),
        lines=tuple(Line(signal(name)[t], own) for name, own in lines.items() if name in needed),
        bounds={name: ends for name, ends in model.bounds.items() if name in needed},
        constraints=(),
        origins={},
    )
    return Record(model, data, bounds, whole=record.whole), numbers


def _freed(found: Freed, bounds: Mapping[str, float], numbers: Mapping[str, str]) -> Freed | None:
    """Return the record with a free coefficient for each bent one; None where one has no ends."""
    record, model = found.record, _multiplied_out(found.record.model)
    free = _Coefficients(set(model.names))
    lines = tuple(Line(signal(e.signal)[t], free.free(e.expression)) for e in model.lines)
    values = tuple(free.symbols)
    ends = Record(replace(model, constraints=values), record.data, bounds).constraint_ends()
    boxes = {p.symbol: (p.lower, p.upper) for p in model.parameters}
    boxes |= dict(zip(free.symbols.values(), map(tuple, ends.tolist()), strict=True))
    boxes |= _ends_told(model, lines, record.data, bounds, boxes, numbers)
    occurring = {name for line in lines for name in plain_symbols(line.expression)}
    parameters = tuple(Parameter(str(own), *box) for own, box in boxes.items() if str(own) in occurring)
    if not all(np.isfinite([p.lower, p.upper]).all() for p in parameters):
        return None
    freed = replace(model, parameters=parameters, lines=lines, constraints=(), values={})
    known = {p.symbol: found.meanings[p.name] for p in model.parameters if p.name in found.meanings}
    meanings = dict(found.meanings) | {
        str(symbol): value.xreplace(known)
        for value, symbol in free.symbols.items()
        if value.free_symbols <= known.keys()
    }
    return Freed(Record(freed, record.data, bounds, whole=record.whole), meanings)


def _multiplied_out(model: Model) -> Model:
    """Return the model with what has no memory in the place where it is read linearly.

    So are polynomials of the inputs, written out, wherever they are read.
    """
    shown, static = {m.signal for m in model.measurements}, dict[str, sympy.Expr]()
    known, lines = set(exogenous(model.lines)) - shown, {line.signal: line.expression for line in model.lines}
    for name in [own for own in lines if own not in shown and own not in model.bounds]:
        expression = inlined(lines[name], static)
        reads = references(expression)
        if all(own in known for own, _ in reads) and expression.is_polynomial(*expression.atoms(sympy.Indexed)):
            static[name] = sympy.expand(expression)
        elif not any(lag for _, lag in reads) and all(_is_linear(own, name) for own in lines.values()):
            static[name] = expression
    others = (line for line in model.lines if line.signal not in static)
    return replace(model, lines=tuple(replace(own, expression=inlined(own.expression, static)) for own in others))


def _is_linear(expression: sympy.Expr, name: str) -> bool:
    atoms = [signal(name)[t - lag] for own, lag in sorted(references(expression)) if own == name]
    slopes = [expression.diff(atom) for atom in atoms if expression.is_polynomial(*atoms)]
    return len(slopes) == len(atoms) and not any(slope.has(*atoms) for slope in slopes)


def _within(box: _Ends, reach: float) -> _Ends:
    low, high = max(box[0], -reach), min(box[1], reach)
    return (low, high) if low <= high else box


def _ends_told(
    model: Model,
    lines: Sequence[Line],
    data: Dataset,
    bounds: Mapping[str, float],
    boxes: Mapping[sympy.Symbol, _Ends],
    numbers: Mapping[str, str],
) -> dict[sympy.Symbol, _Ends]:
    """Return ends of the numbers of a driven signal, as the measurements tell them.

    Where a measured state reads one such signal at one lag, it is the sum of one number and of products of bounded
    signals and coefficients.
    """
    largest = {name: max(float(np.abs(run.values[name]).max()) for run in data.experiments) for name in data.names}
    shown = (m for m in model.measurements if m.noise and not m.inverse)
    largest |= {m.signal: largest[m.channel] + bounds[m.channel] for m in shown}
    found = dict[sympy.Symbol, _Ends]()
    for line in lines:
        own, read_from, rest = list[sympy.Symbol](), set[tuple[str, int]](), largest.get(line.signal, np.inf)
        for term in sympy.Add.make_args(line.expression):
            factor, read = term.as_independent(sympy.Indexed, as_Add=False)
            ((name, lag),) = references(read) if isinstance(read, sympy.Indexed) else (("", 0),)
            if name in numbers:
                own.append(factor)
                read_from.add((numbers[name], lag))
            else:
                rest += _largest(factor, boxes) * (1.0 if read == 1 else largest.get(name, np.inf))
        if len(read_from) == 1 and np.isfinite(rest):
            found |= {one: _within(boxes[one], rest * _ROUNDED) for one in own if one in boxes}
    return found


def _largest(coefficient: sympy.Expr, boxes: Mapping[sympy.Symbol, _Ends]) -> float:
    """Return a bound of the magnitude of a sum of numbers times parameters."""
    terms = coefficient.as_coefficients_dict().items()
    return sum(
        abs(float(count)) * (1.0 if own == 1 else max(map(abs, boxes.get(own, (np.inf,))))) for own, count in terms
    )


class _Coefficients:
    """Symbols in place of coefficients in which parameters occur.

    A coefficient that is a sum of numbers times others is written as that. So poles at one stay there.
    """

    def __init__(self, taken: set[str]) -> None:
        self._taken = taken
        self.symbols: dict[sympy.Expr, sympy.Symbol] = {}
        self._independent: list[_Independent] = []

    def free(self, expression: sympy.Expr) -> sympy.Expr:
        """Return an expression with free coefficients, also within functions of signals."""
        found = coefficients(sympy.expand_mul(expression)).items()
        # Parameters before sums of them.
        terms = [(self._written(own), rest) for rest, own in sorted(found, key=lambda one: one[1].is_Add)]
        return sympy.Add(*(own * sympy.Mul(*map(self._within, sympy.Mul.make_args(rest))) for own, rest in terms))

    def _within(self, factor: sympy.Expr) -> sympy.Expr:
        # The sides of a condition stay as they are.
        if isinstance(factor, sympy.Indexed | sympy.Piecewise) or not factor.has(sympy.Indexed):
            return factor
        inner = [self.free(own) if own.is_Add or own.is_Mul else self._within(own) for own in factor.args]
        return factor.func(*inner)

    def _written(self, coefficient: sympy.Expr) -> sympy.Expr:
        left = {own: factor for own, factor in sympy.expand(coefficient).as_coefficients_dict().items() if factor}
        known = sympy.Integer(0)
        for other in self._independent:
            if factor := left.get(other.term):
                known += factor * other.written
                for own, count in other.terms.items():
                    left[own] = left.get(own, sympy.Integer(0)) - factor * count
        left = {own: factor for own, factor in left.items() if factor}
        known += left.pop(sympy.S.One, sympy.Integer(0))
        if not left:
            return known
        term, factor = next(iter(left.items()))
        if len(left) == 1 and term.is_Symbol and not known:
            self._independent.append(_Independent(term, {term: sympy.Integer(1)}, term))
            return factor * term
        symbol = sympy.Symbol(_new("coefficient", self._taken), real=True)
        self.symbols[sympy.factor_terms(coefficient)] = symbol
        terms = {own: count / factor for own, count in left.items()}
        self._independent.append(_Independent(term, terms, (symbol - known) / factor))
        return symbol


@dataclass(frozen=True, eq=False)
class _Independent:
    """What the next coefficient adds to those before: the first of its terms, all, and how it is written."""

    term: sympy.Expr
    terms: Mapping[sympy.Expr, sympy.Expr]
    written: sympy.Expr


def _size(expression: sympy.Basic, known: dict[sympy.Basic, int]) -> int:
    """Return the number of parts of an expression written out; what occurs twice counts twice."""
    if expression not in known:
        known[expression] = 1 + sum(_size(own, known) for own in expression.args)
    return known[expression]


def _new(wanted: str, taken: set[str]) -> str:
    name = unused(wanted, taken)
    taken.add(name)
    return name


def _first(record: Record) -> dict[str, int]:
    return dict(zip(record.tape.signals, record.tape.first.tolist(), strict=True))
