"""Boxes narrowed without a free run: steps that bound the states by comparison, and the coefficients by integrals.

Over a wide box a free run reaches anywhere. Here only the measurements say where the states are: at first what is
measured, and the bounds of signals. A step of the file then

- bounds a state at samples by values that the comparison proves (:mod:`.comparison`), or
- bounds coefficients of the rates by the integrals with a modulating function each (:mod:`.modulated`), or
- cuts a slice off the interval of a parameter, which further steps prove empty.

A file states which step is next, with the values and the modulating functions. A value that the comparison does not
prove is refused; any modulating function gives a true bound. Between the steps a parameter is bounded by the
coefficients whose factor it is, and a coefficient by its parameters.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from math import inf

from relaxations.check.arithmetic import Refused
from relaxations.check.forms import shown_name
from relaxations.check.runs.affine import Form, Range, between, multiply
from relaxations.check.runs.comparison import Cells, Tube
from relaxations.check.runs.fixed import BITS, End
from relaxations.check.runs.functions import reciprocal
from relaxations.check.runs.modulated import Interval, Modulation, intervals_of, solved
from relaxations.check.runs.proof import Pass, Side, contract
from relaxations.check.runs.run import CONSTRAINT, rows
from relaxations.check.runs.statement import Stated
from relaxations.check.runs.terms import Values, rate_of

__all__ = ["Bounded", "Compared", "Narrowed", "narrowed_by"]

PARTS = 6
"""Cells of a state's range of an interval, beside those that follow from the stated edges."""

_SHIFT = 64
_COST = 100  # of an interval that is integrated


@dataclass(frozen=True)
class Compared:
    """A state of an experiment is compared.

    Parameters
    ----------
    edges
        Between cells, in ascending order, in units.
    upper, lower
        Sample and value, in units: the state is never above, or below.
    """

    experiment: int
    state: int
    edges: Sequence[int]
    upper: Sequence[tuple[int, int]]
    lower: Sequence[tuple[int, int]]


@dataclass(frozen=True)
class Bounded:
    """Coefficients are bounded, each by a modulating function."""

    sides: Sequence[tuple[int, Sequence[Modulation]]]


@dataclass(frozen=True)
class Shaved:
    """A part of a parameter's interval, above (sign 1) or below a value, is cut off: its own steps prove it empty."""

    parameter: int
    value: int
    sign: int
    steps: Sequence[Compared | Bounded]


Step = Compared | Bounded | Shaved


@dataclass
class Narrowed:
    """What is known of the parameters, of the coefficients, and of the states of each experiment."""

    stated: Stated
    box: list[Range]
    products: list[Range]
    tubes: list[list[Tube]]

    @staticmethod
    def of(stated: Stated) -> Narrowed:
        """Return what is known beforehand: the box, and what is measured."""
        box = list(stated.box[: len(stated.parameters)])
        tubes = []
        for piece in stated.runs:
            own = []
            for name in stated.rates:
                ends = [(-inf, inf)] * piece.count
                for measured, samples in zip(stated.measured, piece.shown, strict=True):
                    if measured.signal == name and measured.defined is not None:
                        ends = [
                            (low, high) if form is None else (max(low, form.low), min(high, form.high))
                            for (low, high), form in zip(ends, samples, strict=True)
                        ]
                count = max(piece.count - 1, 0)
                own.append(Tube([low for low, _ in ends], [high for _, high in ends], [-inf] * count, [inf] * count))
            tubes.append(own)
        found = Narrowed(stated, box, [(-inf, inf)] * len(stated.terms.coefficients), tubes)
        found.relate()
        return found

    @property
    def empty(self) -> bool:
        """Return whether nothing is left."""
        return any(low > high for low, high in (*self.box, *self.products)) or any(
            tube.empty for own in self.tubes for tube in own
        )

    @property
    def ends(self) -> list[Range]:
        """The ends of all unknowns: the parameters, and the samples that pieces begin with."""
        found = [*self.box, *self.stated.box[len(self.box) :]]
        for (e, name, now), k in self.stated.begins.items():
            if name in self.stated.rates:
                tube, (low, high) = self.tubes[e][self.stated.rates.index(name)], found[k]
                found[k] = max(low, tube.low[now]), min(high, tube.high[now])
        return found

    def take(self, step: Step) -> None:
        """Take a step.

        Raises
        ------
        Refused
            When a value of a comparison is not proven.
        """
        if isinstance(step, Compared):
            upwards = self.cells(step.experiment, step.state, step.edges)
            self._proven(step, upwards, step.upper, 1)
            downwards = upwards.mirrored()
            self._proven(step, downwards, step.lower, -1)
            self.compared(step.experiment, step.state, downwards)
        elif isinstance(step, Bounded):
            known = self.intervals()
            for target, modulation in step.sides:
                self.bound(target, modulation, known)
            self.relate()
        else:
            slice_ = self.cut(step.parameter, step.value, step.sign)
            for own in step.steps:
                if not slice_.empty:
                    slice_.take(own)
            if not slice_.empty:
                raise Refused(f"a slice of {shown_name(self.stated.parameters[step.parameter])} is not proven empty")
            self.take_over(self.cut(step.parameter, step.value, -step.sign))

    def cut(self, parameter: int, value: int, sign: int) -> Narrowed:
        """Return what is known of the part where a parameter is at least a value (sign 1), or at most."""
        found = Narrowed(
            self.stated, list(self.box), list(self.products), [[own.copy() for own in e] for e in self.tubes]
        )
        low, high = self.box[parameter]
        found.box[parameter] = (max(low, value), high) if sign > 0 else (low, min(high, value))
        found.relate()
        return found

    def take_over(self, other: Narrowed) -> None:
        """Take over what is known of a part, as the rest is empty."""
        self.box, self.products, self.tubes = other.box, other.products, other.tubes

    def _proven(self, step: Compared, cells: Cells, values: Iterable[tuple[int, int]], sign: int) -> None:
        """Take over the values of a step that bound a state from above (sign 1), or of one that is seen upside down."""
        for k, value in values:
            if not cells.is_impossible(k, sign * value):
                kind, name = "above" if sign > 0 else "below", shown_name(self.stated.rates[step.state])
                raise Refused(f"{name} may lie {kind} the value that bounds its sample {k} in the file")
            cells.high[k] = min(cells.high[k], sign * value)

    def cells(self, experiment: int, state: int, edges: Sequence[int]) -> Cells:
        """Return a state of an experiment as the comparison sees it."""
        stated, terms = self.stated, self.stated.terms
        tubes, piece = self.tubes[experiment], stated.runs[experiment]
        tube, turned = tubes[state], terms.integral[state]
        values, all_edges = Values(terms, self.box, stated.work), list[list[End]]()
        least, most = list[list[End]](), list[list[End]]()
        for now in range(1, piece.count):
            ends = [(own.least[now - 1], own.most[now - 1]) for own in tubes]
            own_edges, held = _edges(*ends[state], edges), values.held(piece.exact, now)
            all_edges.append(own_edges)
            least.append([])
            most.append([])
            for cell in pairwise(own_edges):
                forms = values.over(held, [between(*(cell if i == state else own)) for i, own in enumerate(ends)])
                rate = rate_of(terms.products[state], forms, self.products)
                least[-1].append(rate.low)
                most[-1].append(rate.high)
        low, high = ([-inf] * piece.count, [inf] * piece.count)
        if turned is not None:
            low, high = list(tubes[turned].low), list(tubes[turned].high)
        h = int(stated.interval * (1 << BITS))
        return Cells(all_edges, least, most, list(tube.low), list(tube.high), low, high, h, stated.work)

    def compared(self, experiment: int, state: int, downwards: Cells) -> None:
        """Take over what is known of a state, seen upside down, after its ends are spread to all samples."""
        tubes, terms = self.tubes[experiment], self.stated.terms
        downwards.raised()
        upwards = downwards.mirrored()
        upwards.raised()
        above, below = upwards.stays_above(), upwards.mirrored().stays_above()
        tube = tubes[state]
        tube.low, tube.high = upwards.low, upwards.high
        tube.least = [max(own, low) for own, low in zip(tube.least, above, strict=True)]
        tube.most = [min(own, -high) for own, high in zip(tube.most, below, strict=True)]
        if terms.alone[state]:
            tube.joined()
        turned = terms.integral[state]
        if turned is not None:
            tubes[turned].integrated(tube, int(self.stated.interval * (1 << BITS)))

    def intervals(self) -> list[list[Interval]]:
        """Return what is known of each interval of each experiment."""
        terms, values = self.stated.terms, Values(self.stated.terms, self.box, self.stated.work)
        return [
            intervals_of(terms, values, self.products, own, piece, self.stated.interval)
            for own, piece in zip(self.tubes, self.stated.runs, strict=True)
        ]

    def bound(self, target: int, modulation: Sequence[Modulation], known: Sequence[Sequence[Interval]]) -> None:
        """Bound a coefficient by a modulating function."""
        self.stated.work.spend(_COST * len(modulation))
        interval, terms = self.stated.interval, self.stated.terms
        low, high = self.products[target]
        found = solved(target, modulation, terms, self.products, self.tubes, known, interval) if low <= high else None
        if found is not None:
            self.products[target] = max(low, found[0]), min(high, found[1])

    def _constrain(self) -> None:
        """Bound each parameter by the constraints, alone by what the others leave of it."""
        box = [*self.box, *self.stated.box[len(self.box) :]]
        for k in range(len(self.stated.constraints)):
            source = CONSTRAINT, 0, k, 0
            known = rows(self.stated, box, [source])
            row = known[source]
            if row is None or row.impossible:
                continue
            # The multiplier with which the row's slope in an unknown becomes one.
            sides = [
                Side(j, 1 if slope > 0 else -1, _SHIFT, [(0, (1 << (BITS + _SHIFT)) // abs(slope))])
                for j, slope in row.slopes.items()
                if slope and j < len(self.box)
            ]
            contract(box, Pass([source], sides), known, "the narrowing")
        self.box = box[: len(self.box)]

    def relate(self) -> None:
        """Bound parameters by constraints and by the coefficients whose factor they are, and coefficients by these."""
        self._constrain()
        terms, work = self.stated.terms, self.stated.work
        for own, ends in zip(terms.coefficients, self.products, strict=True):
            for k in own.factors:
                others = between(1 << BITS, 1 << BITS)
                for other in own.factors:
                    others = others if other == k else multiply(others, between(*self.box[other]))
                if others.low > 0 and ends[0] <= ends[1]:
                    quotient = multiply(between(*ends), _plain(reciprocal(others)))
                    self.box[k] = max(self.box[k][0], quotient.low), min(self.box[k][1], quotient.high)
                    if self.box[k][0] > self.box[k][1]:
                        return
        values = Values(terms, self.box, work)
        for j, own in enumerate(terms.coefficients):
            (low, high), ends = self.products[j], values.coefficient(own)
            self.products[j] = max(low, ends[0]), min(high, ends[1])


def _plain(form: Form) -> Form:
    return between(form.low, form.high)


def _edges(low: End, high: End, stated: Sequence[int]) -> list[End]:
    """Return the edges of the cells of an interval: those that are stated, and equal parts."""
    inner = {edge for edge in stated if low < edge < high}
    if isinstance(low, int) and isinstance(high, int):
        inner |= {low + (high - low) * k // PARTS for k in range(1, PARTS)} - {low, high}
    return [low, *sorted(inner), high]


def narrowed_by(stated: Stated, steps: Iterable[Step]) -> list[Range] | None:
    """Return the ends of all unknowns after some steps; None where nothing is left."""
    known = Narrowed.of(stated)
    for step in steps:
        if known.empty:
            break
        known.take(step)
    return None if known.empty else known.ends
