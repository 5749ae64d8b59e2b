"""The samples that hold the ends where inputs are noisy too: from linear programs in the noises at fixed parameters.

There are as many unknown noises as samples. But once the parameters are fixed the equations are linear in the noises,
and a linear program says by how much the noise bounds would have to be stretched: parameters fit the record where they
need not be. Parameters that do not fit are excluded by a few equations in a row. So the ends are searched for on
windows, the points that are found there are asked on the whole record (:mod:`.record_noises`), and what objects joins
the windows.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from relaxations.algebra.arrays import Array, Index
from relaxations.deadline import Progress
from relaxations.search.benders.cuts import Cuts
from relaxations.search.benders.enclose import outer_rows
from relaxations.search.benders.search import Asker, inmost, outmost
from relaxations.search.benders.split import Split
from relaxations.solvers import Solver
from smid.data import DataError, Dataset
from smid.data.window import Window, cut_all, windows_before
from smid.feasible.feasible_set import FeasibleSet
from smid.identification.finite_box import with_finite_box
from smid.identification.first_guess import equation_error_fit
from smid.identification.windows.record_noises import Part, RecordNoises
from smid.identification.windows.search import Held
from smid.identification.windows.whole_record import Noises, WholeRecord
from smid.models import Model

_FIRST, _LONG = 20, 15  # the first windows, evenly over the record, and their length
_PASSES = 60
_ASKED_AFTER = (3, 8, 20, 40)  # passes: whether the worst noises object
_FEW = 20  # parts beyond their bounds: linear programs mend so many in less time than further passes
_MARGIN = 1e-9  # share of the noise bounds that is kept for rounding
_REACH, _FARTHEST = 25, 800  # samples on each side of a noise beyond its bound that are asked with it
_ENOUGH = 4  # parts that object at a time
_ROUNDS = 12
_CARRIES = 1e-3  # multipliers from this share of the largest one
_COARSE = 0.03  # share of the way to an end that is left open first
_AGREE = 0.1  # of that share: a search stops there

_Row = tuple[int, int, int]  # an equation: experiment, sample, and how many before it are of the same sample
_End = tuple[int, int]  # a parameter's number, and 1 for its lower end, -1 for its upper one


@dataclass(frozen=True, eq=False)
class _Asked:
    """What a whole record says of parameters: noises that fit it, or the places that object."""

    noises: Sequence[Noises] | None
    objecting: list[Index]


class NoisePrograms:
    """Searches windows for the ends, and asks the whole record; fulfils :class:`~.search.Search`."""

    def __init__(
        self,
        model: Model,
        data: Dataset,
        bounds: Mapping[str, float],
        whole: WholeRecord,
        say: Progress,
        solver: Solver,
    ) -> None:
        self.model, self.data, self.bounds, self.whole = model, data, bounds, whole
        self._say, self._solver = say, solver
        self._lag = max(line.max_lag for line in whole.templates.lines)
        self._length = 2 * self._lag
        self._count, self._outer = len(model.parameters), np.arange(len(model.parameters))
        self._inside = np.zeros(self._count)
        self._known: tuple[list[_Row], Array] = ([], np.zeros((0, 0)))  # multipliers of cuts near the ends
        self._channels = {m.noise: m.channel for m in model.measurements if m.noise is not None}
        self._limits = {noise: bounds[channel] for noise, channel in self._channels.items()}

    def held(self, tolerance: float) -> Held:
        """Return what holds the ends."""
        places = _spread(self.data)
        feasible = FeasibleSet(self.model, cut_all(self.data, windows_before(places, self._lag)), self.bounds)
        boxed = with_finite_box(feasible, self._solver)
        if boxed.unbounded:
            raise DataError("the windows leave some parameters without a box: take all samples")
        lower, upper = (end[: self._count] for end in (boxed.feasible.problem.lower, boxed.feasible.problem.upper))
        self._inside = equation_error_fit(boxed.feasible)[0]
        holding: dict[_End, Index] = {}
        fitting: dict[_End, Array] = {}
        for share in (_COARSE, tolerance):
            left = [(k, sign) for k in range(self._count) for sign in (1, -1) if lower[k] < upper[k]]
            for _ in range(_ROUNDS):
                # Search the windows for the ends.
                windows = windows_before(places, self._length)
                found = self._searched(windows, left, lower, upper, _AGREE * share)
                if isinstance(found, Held):
                    return found
                # Ask the record just inside each.
                before = len(places)
                for end, point, held in found:
                    holding[end], drawn = held, point + share * (self._inside - point)
                    asked = self._asked(drawn)
                    places = _joined([places, *asked.objecting])
                    if share != _COARSE and self._holds(drawn, asked.noises):
                        fitting[end] = drawn
                    if end in fitting or (share == _COARSE and not asked.objecting):
                        left.remove(end)
                self._say(f"{len(found) - len(left)} of {len(found)} ends found on {sum(map(len, windows))} samples")
                if not left or len(places) == before:
                    break
        return Held(_joined([*holding.values()]), self._length, tuple(fitting.values()))

    def _searched(
        self, windows: tuple[Window, ...], wanted: Sequence[_End], lower: Array, upper: Array, share: float
    ) -> list[tuple[_End, Array, Index]] | Held:
        """Return points of the windows at some ends with what holds them; or what leaves no point inside."""
        feasible = FeasibleSet(self.model, cut_all(self.data, windows), self.bounds)
        split, rows = Split.of(feasible.problem, self._outer), _rows(_places(feasible, windows))
        asker = Asker(Cuts.of(split, np.concatenate([outer_rows(split), self._known_on(rows, split)])), self._solver)
        inside = inmost(asker, self._inside, lower, upper)
        if inside is None:
            raise DataError("no answer at the first parameters: take all samples")
        if inside.excess >= 0:
            return Held(self._holding(feasible, windows, asker.cuts.multipliers), self._length, ())
        self._inside, found, close = inside.p, [], []
        for k, sign in wanted:
            point, active, near = outmost(asker, sign * np.eye(self._count)[k], inside, lower, upper, share)
            found.append(((k, sign), point.p, self._holding(feasible, windows, asker.cuts.multipliers[active])))
            close += [active, near]
        self._known = rows, asker.cuts.multipliers[np.unique(np.concatenate(close))]
        return found

    def _known_on(self, rows: list[_Row], split: Split) -> Array:
        """Return the multipliers of the last search, for the equations of these windows."""
        before, multipliers = self._known
        place = {row: k for k, row in enumerate(rows)}
        known = np.zeros((len(multipliers), len(rows) + split.inequalities.count))
        for k, row in enumerate(before):
            if row in place:
                known[:, place[row]] = multipliers[:, k]
        if before:
            known[:, len(rows) :] = multipliers[:, len(before) :]
        return known

    def near(self, values: Mapping[str, float], tolerance: float) -> tuple[tuple[Array, ...], Index]:
        """Return the point that is a little nearer to the one inside, or what objects to it."""
        p = self._vector(values)
        drawn = p + tolerance * (self._inside - p)
        asked = self._asked(drawn)
        return (drawn,) if self._holds(drawn, asked.noises) else (), _joined(asked.objecting)

    def fits(self, values: Mapping[str, float]) -> bool:
        """Return whether noises are found with which the parameters are verified."""
        p = self._vector(values)
        return self._holds(p, self._asked(p).noises)

    def _vector(self, values: Mapping[str, float]) -> Array:
        return np.array([values[p.name] for p in self.model.parameters])

    def _values(self, p: Array) -> dict[str, float]:
        return {q.name: float(value) for q, value in zip(self.model.parameters, p, strict=True)}

    def _holds(self, p: Array, noises: Sequence[Noises] | None) -> bool:
        return noises is not None and self.whole.holds(self._values(p), noises, self.bounds)

    def _holding(self, feasible: FeasibleSet, windows: tuple[Window, ...], multipliers: Array) -> Index:
        """Return the places of the equations that carry multipliers."""
        rows = _carrying(np.abs(multipliers[:, : feasible.n_equalities])).any(axis=0)
        return _places(feasible, windows)[rows]

    def _asked(self, p: Array) -> _Asked:
        """Ask every experiment, until enough object."""
        values, noises, objecting = self._values(p), [], []
        for e, run in enumerate(self.data.experiments):
            try:
                found = RecordNoises(self.whole.equations[e], values, self._limits, run.n_samples)
            except np.linalg.LinAlgError:
                raise DataError("some equations say the same: take all samples") from None
            fitting = self._fitting(e, found)
            if isinstance(fitting, list):
                objecting += fitting
            else:
                noises.append(fitting)
            if len(objecting) >= _ENOUGH:
                break
        fits = len(noises) == len(self.data.experiments)
        return _Asked(noises if fits else None, objecting)

    def _fitting(self, e: int, record: RecordNoises) -> dict[str, Array] | list[Index]:
        """Return noises of an experiment within their bounds, or the places that object; no places without a decision.

        Passes over the whole record leave ever fewer noises beyond their bounds. From time to time a linear program
        asks the samples around the worst of them, with nothing fixed before or behind, whether they object.
        """
        noises = np.zeros(())
        for k, noises in enumerate(record.passes(_PASSES), 1):
            beyond = np.abs(noises).max(axis=0) - 1.0 + _MARGIN
            if beyond.max() <= 0:
                return self._named(noises)
            if k in _ASKED_AFTER:
                parts = self._worst(beyond, _REACH)
                asked = [record.part(*around, self._solver) for around in parts[:_ENOUGH]]
                if objecting := [_holding(e, part) for part in asked if part is not None and part.excess > 0]:
                    return objecting
                if len(parts) <= _FEW:
                    break
        # Mend what is left by linear programs between noises that stay; where there is none, ask more samples.
        reach = _REACH
        while reach <= _FARTHEST:
            for first, last in self._worst(np.abs(noises).max(axis=0) - 1.0 + _MARGIN, reach):
                between = record.part(first, last, self._solver, noises)
                if between is not None and between.excess <= 0:
                    noises[:, first : last + 1] = between.noises
                    continue
                alone = record.part(first, last, self._solver)
                if alone is not None and alone.excess > 0:
                    return [_holding(e, alone)]
            noises = record.solving(noises)  # the linear programs solve the equations to their own tolerance
            if np.abs(noises).max() <= 1.0 - _MARGIN:
                return self._named(noises)
            reach *= 2
        return []

    def _worst(self, beyond: Array, reach: int) -> list[tuple[int, int]]:
        """Return first and last samples of the parts around noises beyond their bounds, the worst first."""
        places = np.flatnonzero(beyond > 0)
        parts = np.split(places, np.flatnonzero(np.diff(places) > 2 * reach) + 1)
        ordered = sorted(parts, key=lambda part: -beyond[part].max())
        return [(max(part[0] - reach, 0), min(part[-1] + reach, len(beyond) - 1)) for part in ordered]

    def _named(self, shares: Array) -> dict[str, Array]:
        """Return noises in their units, by channel."""
        limits = self._limits.items()
        return {self._channels[noise]: limit * own for (noise, limit), own in zip(limits, shares, strict=True)}


def _spread(data: Dataset) -> Index:
    """Return the samples of short parts, evenly over the record."""
    runs = [(e, k) for e, run in enumerate(data.experiments) for k in range(0, run.n_samples, _LONG)]
    chosen = [runs[k] for k in np.unique(np.linspace(0, len(runs) - 1, _FIRST).astype(int))]
    ends = [data.experiments[e].n_samples for e, _ in chosen]
    return np.array([(e, k + i) for (e, k), n in zip(chosen, ends, strict=True) for i in range(_LONG) if k + i < n])


def _places(feasible: FeasibleSet, windows: Sequence[Window]) -> Index:
    """Return the experiment and the sample of each equation over some windows."""
    origin = np.array([(w.experiment, w.first) for w in windows])
    which, times = feasible.samples.T
    return np.stack([origin[which, 0], origin[which, 1] + times], axis=1)


def _rows(places: Index) -> list[_Row]:
    seen: Counter[tuple[int, int]] = Counter()
    found = []
    for e, k in places.tolist():
        found.append((e, k, seen[e, k]))
        seen[e, k] += 1
    return found


def _carrying(weights: Array) -> NDArray[np.bool_]:
    """Return which multipliers count beside the largest one of their cut."""
    return np.asarray(weights > _CARRIES * weights.max(axis=-1, keepdims=True, initial=1e-300))


def _holding(experiment: int, part: Part) -> Index:
    """Return the places of the equations of a part that carry multipliers."""
    times = np.unique(part.times[_carrying(part.weights)])
    return np.stack([np.full(len(times), experiment), times], axis=1)


def _joined(places: Sequence[Index]) -> Index:
    return np.concatenate([np.zeros((0, 2), dtype=np.int64), *places])
