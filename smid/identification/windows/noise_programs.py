"""The samples that hold the ends where inputs are noisy too: from linear programs in the noises at fixed parameters.

There are as many unknown noises as samples. But once the parameters are fixed the equations are linear in the noises,
and a linear program says by how much the noise bounds would have to be stretched: parameters fit the record where they
need not be. Parameters that do not fit are excluded by a few equations in a row. So the ends are searched for on
windows, the points that are found there are asked on the whole record, piece by piece, and what objects joins the
windows.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from relaxations.algebra.arrays import Array, Index
from relaxations.deadline import Progress
from relaxations.search.benders.cuts import Cuts
from relaxations.search.benders.enclose import outer_rows
from relaxations.search.benders.program import ask
from relaxations.search.benders.search import Asker, inmost, outmost
from relaxations.search.benders.split import Split
from relaxations.solvers import Solver
from smid.data import DataError, Dataset
from smid.data.window import Window, cut_all, windows_before
from smid.feasible.feasible_set import FeasibleSet
from smid.identification.finite_box import with_finite_box
from smid.identification.first_guess import equation_error_fit
from smid.identification.windows.search import Held
from smid.identification.windows.whole_record import Noises, WholeRecord
from smid.models import Model

_FIRST, _LONG = 20, 15  # the first windows, evenly over the record, and their length
_PIECE, _BEYOND = 2000, 50  # samples of a piece of the record, and so many beyond it that its noises must leave room to
_FEW = 5  # pieces that are asked while the ends still move; on a long record one of so many
_ENOUGH = 4  # pieces that object at a time
_ROUNDS = 12
_CARRIES = 1e-3  # multipliers from this share of the largest one
_COARSE = 0.03  # share of the way to an end that is left open first
_AGREE = 0.1  # of that share: a search stops there

_End = tuple[int, int]  # a parameter's number, and 1 for its lower end, -1 for its upper one


@dataclass(frozen=True, eq=False)
class _Asked:
    """What a whole record says of parameters: noises that fit it, or the places that object."""

    noises: Sequence[Noises] | None
    objecting: list[Index]


@dataclass(frozen=True, eq=False)
class _Piece:
    """The least excess over the noise bounds in a piece, noises that have it, and the places that hold it."""

    excess: float
    noises: Noises
    holding: Index


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
        self._pieces = [
            (e, begin)
            for e, run in enumerate(data.experiments)
            for begin in range(0, run.n_samples - self._lag, _PIECE)
        ]
        self._inside = np.zeros(self._count)
        self._random = np.random.default_rng(0)
        self._channels = {m.noise: m.channel for m in model.measurements if m.noise is not None}

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
                # Ask the record just inside each: a few pieces while the ends still move.
                before = len(places)
                for end, point, held in found:
                    holding[end], drawn = held, point + share * (self._inside - point)
                    asked = self._asked_anywhere(drawn) if share == _COARSE else self._asked(drawn)
                    places = _joined([places, *asked.objecting])
                    if self._holds(drawn, asked.noises):
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
        split = Split.of(feasible.problem, self._outer)
        asker = Asker(Cuts.of(split, outer_rows(split)), self._solver)
        inside = inmost(asker, self._inside, lower, upper)
        if inside is None:
            raise DataError("no answer at the first parameters: take all samples")
        if inside.excess >= 0:
            return Held(self._holding(feasible, windows, asker.cuts.multipliers), self._length, ())
        self._inside, found = inside.p, []
        for k, sign in wanted:
            point, active, _ = outmost(asker, sign * np.eye(self._count)[k], inside, lower, upper, share)
            found.append(((k, sign), point.p, self._holding(feasible, windows, asker.cuts.multipliers[active])))
        return found

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

    def _holds(self, p: Array, noises: Sequence[Noises] | None) -> bool:
        values = {q.name: float(value) for q, value in zip(self.model.parameters, p, strict=True)}
        return noises is not None and self.whole.holds(values, noises, self.bounds)

    def _holding(self, feasible: FeasibleSet, windows: tuple[Window, ...], multipliers: Array) -> Index:
        """Return the places of the equations that carry multipliers."""
        own = np.abs(multipliers[:, : feasible.n_equalities])
        rows = np.flatnonzero((own > _CARRIES * own.max(axis=1, keepdims=True, initial=1e-300)).any(axis=0))
        origin = np.array([(w.experiment, w.first) for w in windows])
        which, times = feasible.samples[rows].T
        return np.stack([origin[which, 0], origin[which, 1] + times], axis=1)

    def _asked_anywhere(self, p: Array) -> _Asked:
        """Ask some pieces of the record, chosen at random."""
        count = max(_FEW, len(self._pieces) // _FEW)
        some = [self._pieces[k] for k in self._random.permutation(len(self._pieces))[:count]]
        asked = [self._piece(e, begin, p) for e, begin in some]
        return _Asked(None, [piece.holding for piece in asked if piece.excess > 0])

    def _asked(self, p: Array) -> _Asked:
        """Ask all pieces in order, each beginning with the last noises of the one before, until enough object."""
        noises = [{c: np.zeros(run.n_samples) for c in self._channels.values()} for run in self.data.experiments]
        fits, known = True, False
        objecting: list[Index] = []
        for e, begin in self._pieces:
            before = {channel: own[begin : begin + self._lag] for channel, own in noises[e].items()}
            past = before if known and begin else None
            piece = self._piece(e, begin, p, past)
            if piece.excess > 0 and past:
                fits, piece = False, self._piece(e, begin, p)
            known = piece.excess <= 0
            objecting += [] if known else [piece.holding]
            if len(objecting) == _ENOUGH:
                break
            for channel, own in piece.noises.items():
                noises[e][channel][begin : begin + len(own)] = own
        return _Asked([*noises] if fits and not objecting else None, objecting)

    def _piece(self, experiment: int, begin: int, p: Array, past: Noises | None = None) -> _Piece:
        """Solve the linear program of a piece, with the first noises fixed where they are given."""
        length = self.data.experiments[experiment].n_samples
        window = Window(experiment, begin, min(begin + self._lag + _PIECE + _BEYOND, length) - 1)
        feasible = FeasibleSet(self.model, cut_all(self.data, [window]), self.bounds)
        problem = feasible.problem
        place = {name: k for k, name in enumerate(problem.names)}
        slots = {
            channel: np.array([place.get(f"{noise}[{k}]", -1) for k in range(len(window))])
            for noise, channel in self._channels.items()
        }
        lower, upper = problem.lower.copy(), problem.upper.copy()
        for channel, values in (past or {}).items():
            own = slots[channel][: len(values)]
            lower[own[own >= 0]] = upper[own[own >= 0]] = values[own >= 0]
        split = Split.of(problem.with_box(lower, upper), self._outer)
        answer = ask(split, p, self._solver)
        if answer is None:
            return _Piece(np.inf, {}, np.zeros((0, 2), dtype=np.int64))
        point = split.recover(p, answer.inner)
        # A noise that no equation of the piece reads is as before.
        noises = {channel: np.where(own >= 0, point[own], 0.0) for channel, own in slots.items()}
        for channel, values in (past or {}).items():
            noises[channel][: len(values)] = values
        return _Piece(answer.excess, noises, self._holding(feasible, (window,), answer.multipliers[None]))


def _spread(data: Dataset) -> Index:
    """Return the samples of short parts, evenly over the record."""
    runs = [(e, k) for e, run in enumerate(data.experiments) for k in range(0, run.n_samples, _LONG)]
    chosen = [runs[k] for k in np.unique(np.linspace(0, len(runs) - 1, _FIRST).astype(int))]
    ends = [data.experiments[e].n_samples for e, _ in chosen]
    return np.array([(e, k + i) for (e, k), n in zip(chosen, ends, strict=True) for i in range(_LONG) if k + i < n])


def _joined(places: Sequence[Index]) -> Index:
    return np.concatenate([np.zeros((0, 2), dtype=np.int64), *places])
