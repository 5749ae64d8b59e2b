"""Boxes narrowed without a free run: bounds of the states and of the parameters by turns.

Over a wide box a free run reaches anywhere. But where measurements show each state or its integral, the states are
bounded along the record whatever the parameters are (:mod:`.comparison`). Then the rates integrated over windows are
rows that are linear in products of the parameters (:mod:`.integrals`). Linear programs bound the products, these bound
the parameters, and both bound the states again.

A parameter that stays in doubt is shaved: where a slice at an end of its interval is proven empty, it is cut off.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import islice

import numpy as np
import sympy
from scipy import sparse

from relaxations.algebra.affine_arithmetic import CENTRE, HIGH, LOW, RADIUS, SLOPES
from relaxations.algebra.arrays import Array, Index
from relaxations.algebra.ball_arithmetic import EPSILON, TINY
from relaxations.algebra.intervals import Intervals
from relaxations.deadline import check_time
from smid.identification.inversion.comparison import Comparison, States
from smid.identification.inversion.contraction import Contraction, contracted
from smid.identification.inversion.frame import middle_and_half
from smid.identification.inversion.integrals import Integrals
from smid.identification.inversion.record import Group, Record
from smid.identification.inversion.rows import Rows
from smid.identification.inversion.terms import Program, Terms

__all__ = ["SLICES", "TRIES", "Narrowed", "Narrowing"]

_WORTH = 0.02  # a round takes at least this share of a width
_SURE = 0.05  # a parameter that is known as well is not shaved
SLICES = (0.5, 0.25, 0.125, 0.0625)
"""Shares of an interval, one tried after the other to be cut off."""
TRIES = 2
"""Rounds for a slice."""


@dataclass(frozen=True, eq=False)
class Narrowed:
    """What is known.

    Parameters
    ----------
    box
        Of the parameters, shape (parameters, 2).
    products
        Of what the rates are linear in.
    states
        Of each experiment.
    """

    box: Array
    products: Intervals
    states: tuple[States, ...]

    @property
    def empty(self) -> bool:
        """Whether no parameters explain the record."""
        boxes = bool((self.box[:, 0] > self.box[:, 1]).any())
        return boxes or self.products.empty or any(states.empty for states in self.states)

    @property
    def none(self) -> Narrowed:
        """The same, proven to be empty."""
        return replace(self, products=Intervals(self.products.lower, np.full_like(self.products.lower, -np.inf)))

    @property
    def width(self) -> Array:
        """The widths of the parameters and the products."""
        return np.concatenate([self.box[:, 1] - self.box[:, 0], self.products.width])


class Narrowing:
    """Narrows boxes of the parameters of a model by a record.

    Parameters
    ----------
    bounds
        Of each noisy channel, in its unit.
    """

    def __init__(self, record: Record, terms: Terms, bounds: Mapping[str, float]) -> None:
        model, self._record, self.terms = record.model, record, terms
        self._names, self._runs = tuple(p.name for p in model.parameters), record.data.experiments
        self._shown = [
            (terms.states.index(m.signal), m.channel, bounds[m.channel] if m.noise is not None else 0.0)
            for m in model.measurements
            if m.signal in terms.states and m.inverse is None
        ]
        h = float(model.sampling_time or record.data.sampling_time)
        channels = terms.functions.channels
        read = [np.array([run.values[name] for name in channels]).reshape(-1, run.n_samples) for run in self._runs]
        self.comparisons = [Comparison(terms, own, h) for own in read]
        self._integrals = [Integrals(terms, len(self._names), own, h) for own in read]
        self._constraints = Program.of(list(model.constraints), self._names, ())

    @staticmethod
    def of(record: Record, bounds: Mapping[str, float]) -> Narrowing | None:
        """Return the narrowing for a model with a hidden state whose integral is measured.

        None where a state is neither measured nor the rate of one that is: of it nothing is known without a run.
        """
        terms = Terms.of(record.model) if record.model.enclosed else None
        if terms is None:
            return None
        shown = {m.signal for m in record.model.measurements if m.inverse is None}
        known = [name in shown for name in terms.states]
        hidden = [not own for own in known]
        chained = [k >= 0 and known[k] for k in terms.integral]
        shortest = min(run.n_samples for run in record.data.experiments)
        fits = any(hidden) and all(own or other for own, other in zip(known, chained, strict=True)) and shortest > 2
        return Narrowing(record, terms, bounds) if fits else None

    def steps(self) -> Iterator[Narrowed]:
        """Yield what is proven, ever more; the last may be empty."""
        known, before = self._start(), None
        while known is not before:
            for step in self._rounds(known):
                known = step
                yield known
            if known.empty:
                return
            before = known
            for step in self._shaved(known):
                known = step
                yield known
        yield self._bounded(known, range(len(self._names)))

    def ends(self, known: Narrowed) -> tuple[Array, Array]:
        """Return the ends of the unknowns of the record."""
        lower, upper = self._record.lower.copy(), self._record.upper.copy()
        lower[: len(known.box)], upper[: len(known.box)] = known.box.T
        signals = self._record.tape.signals
        for piece in self._record.cut.parts:
            at = known.states[piece.experiment].at
            for signal, now in np.argwhere(piece.initial >= 0).tolist():
                if (name := signals[signal]) in self.terms.states:
                    place = piece.unknowns[piece.initial[signal, now]]
                    ends = at[self.terms.states.index(name), piece.first + now]
                    lower[place], upper[place] = ends.lower, ends.upper
        return lower, upper

    def _start(self) -> Narrowed:
        """Return what is known beforehand."""
        count = len(self._names)
        box = np.column_stack([self._record.lower[:count], self._record.upper[:count]])
        nothing = Intervals.within(np.full(len(self.terms.coefficients), np.inf))
        return Narrowed(box, self._products(box, nothing), tuple(map(self._measured, range(len(self._runs)))))

    def _measured(self, e: int) -> States:
        n, count = self._runs[e].n_samples, len(self.terms.states)
        at, during = (Intervals.within(np.full((count, size), np.inf)) for size in (n, n - 1))
        for i, channel, reach in self._shown:
            values = Intervals.of(self._runs[e].values[channel]) + Intervals.within(reach)
            told = np.isfinite(values.lower)
            both = at[i].meet(values).where(told, at[i])
            at.lower[i], at.upper[i] = both.lower, both.upper
        for name, ends in self._record.model.bounds.items():
            if name in self.terms.states:
                i = self.terms.states.index(name)
                both = at[i].meet(Intervals.of(*ends))
                at.lower[i], at.upper[i] = both.lower, both.upper
        return States(at, during)

    def _rounds(self, known: Narrowed) -> Iterator[Narrowed]:
        """Bound states and products by turns, until the boxes no longer shrink."""
        while True:
            check_time()
            before = known.width
            states = tuple(
                compare(known.box, known.products, own)
                for compare, own in zip(self.comparisons, known.states, strict=True)
            )
            known = replace(known, states=states)
            if not known.empty:
                count = len(self._names)
                known = self._bounded(known, range(count, count + len(known.products.lower)))
            yield known
            if known.empty or np.all(known.width >= (1 - _WORTH) * before):
                return

    def _shaved(self, found: Narrowed) -> Iterator[Narrowed]:
        """Cut off slices that are proven empty, one after the other."""
        for k in range(len(self._names)):
            for side in (0, 1):
                for share in SLICES:
                    while (cut := self.empty_slice(found, k, side, share)) is not None:
                        rest = found.box.copy()
                        rest[k, side] = cut
                        found = self._within(found, rest)
                        yield found

    def empty_slice(self, known: Narrowed, k: int, side: int, share: float) -> float | None:
        """Return where to cut a slice off an end of a parameter; None if it is not proven empty.

        Parameters
        ----------
        side
            0: the lower end; 1: the upper one.
        share
            Of the interval.
        """
        cut = _cut(known.box[k], side, share)
        if cut is None:
            return None
        box = known.box.copy()
        box[k, 1 - side] = cut
        tried = islice(self._rounds(self._within(known, box)), TRIES)
        return cut if any(own.empty for own in tried) else None

    def _within(self, known: Narrowed, box: Array) -> Narrowed:
        return replace(known, box=box, products=self._products(box, known.products))

    def _products(self, box: Array, known: Intervals) -> Intervals:
        forms = self.terms.values.affine(box)
        return known.meet(Intervals(forms[:, LOW], forms[:, HIGH]))

    def _bounded(self, known: Narrowed, targets: Sequence[int]) -> Narrowed:
        """Return what linear programs prove of some parameters or products."""
        result, count = self.contraction(known, targets), len(known.box)
        if result is None or result.empty:
            return known.none
        shared = count + len(known.products.lower)
        box = np.column_stack([result.lower[:count], result.upper[:count]])
        products = Intervals(result.lower[count:shared], result.upper[count:shared])
        box = self._divided(box, products)
        return replace(known, box=box, products=self._products(box, products))

    def contraction(self, known: Narrowed, targets: Sequence[int]) -> Contraction | None:
        """Return what linear programs prove of some parameters or products; None where no run has such states.

        The sources of a row are its experiment, state and window, as in :class:`.integrals.Integrals`.
        """
        count, own = len(known.box), len(known.products.lower)
        found = list[tuple[Rows, Array, Array]]()
        for e, (integrals, states) in enumerate(zip(self._integrals, known.states, strict=True)):
            part = integrals.rows(known.box, known.products, states)
            if part is None:
                return None
            part[0].sources[:, 0] = e
            found.append(part)
        shared = count + own
        lower = np.concatenate([found[0][1][:shared], *(low[shared:] for _, low, _ in found)])
        upper = np.concatenate([found[0][2][:shared], *(high[shared:] for _, _, high in found)])
        rows, begin = [], shared
        for own_rows, low, _ in found:
            columns = np.concatenate([np.arange(shared), begin + np.arange(len(low) - shared)])
            rows.append(_moved(own_rows, columns, len(lower)))
            begin += len(low) - shared
        rows += [self._linked(known, len(lower)), self._constrained(known, len(lower))]
        free = tuple(k for k in targets if lower[k] < upper[k])
        return contracted(Rows.joined(rows), lower, upper, [Group(free, None)])

    def _linked(self, known: Narrowed, width: int) -> Rows:
        """Return the rows between products and parameters."""
        forms, count = self.terms.values.affine(known.box), len(known.box)
        middle, half = middle_and_half(known.products.lower, known.products.upper)
        slopes = np.column_stack([-forms[:, SLOPES:], np.diag(half)])
        centre = middle - forms[:, CENTRE]
        radius = forms[:, RADIUS] + 4 * EPSILON * (np.abs(middle) + np.abs(forms[:, CENTRE])) + TINY
        return _moved(_rows(slopes, centre, radius), np.arange(count + len(half)), width)

    def _constrained(self, known: Narrowed, width: int) -> Rows:
        """Return the rows of the constraints: a form that is not negative, and at most its own largest value."""
        forms = self._constraints.affine(known.box)
        most = np.maximum(forms[:, HIGH], 0.0)
        centre = forms[:, CENTRE] - 0.5 * most
        radius = forms[:, RADIUS] + 0.5 * most + 4 * EPSILON * (np.abs(forms[:, CENTRE]) + most) + TINY
        return _moved(_rows(forms[:, SLOPES:], centre, radius), np.arange(len(known.box)), width)

    def _divided(self, box: Array, products: Intervals) -> Array:
        """Bound the factors of products by the products and the other factors, where these are positive."""
        box = box.copy()
        for k, product in enumerate(self.terms.coefficients):
            factors = [str(factor) for factor in sympy.Mul.make_args(product)]
            if not (set(factors) <= set(self._names) and len(set(factors)) == len(factors)):
                continue
            places = [self._names.index(name) for name in factors]
            for place in places:
                others = Intervals.of(1.0)
                for other in places:
                    others = others if other == place else others * Intervals.of(*box[other])
                if others.lower > 0:
                    inverse = Intervals.of(np.nextafter(1 / others.upper, 0), np.nextafter(1 / others.lower, np.inf))
                    quotient = products[k] * inverse
                    box[place] = max(box[place, 0], quotient.lower), min(box[place, 1], quotient.upper)
        return box


def _cut(ends: Array, side: int, share: float) -> float | None:
    """Return where to cut a slice off an interval; None if it is known well."""
    low, high = ends.tolist()
    if not high - low > _SURE * max(abs(low), abs(high)):
        return None
    part = share if side == 0 else 1 - share
    # Of numbers of one sign by their order of magnitude.
    cut = low * (high / low) ** part if low > 0 or high < 0 else low + (high - low) * part
    return cut if low < cut < high else None


def _rows(slopes: Array, centre: Array, radius: Array) -> Rows:
    return Rows.of(sparse.csr_array(slopes), centre, radius * (1 + 8 * EPSILON))


def _moved(rows: Rows, columns: Index, width: int) -> Rows:
    """Return rows whose symbols are in other columns."""
    slopes = rows.slopes
    return replace(
        rows, slopes=sparse.csr_array((slopes.data, columns[slopes.indices], slopes.indptr), (slopes.shape[0], width))
    )
