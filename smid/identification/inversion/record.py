"""A model and a record: what each sample states about a box of the unknowns, and whether a point fits all samples.

The unknowns are the parameters, and for each experiment the samples of the states before the first that the model
computes. A measured state begins at its measurement, within the noise bound. A hidden signal with bounds counts as
measured. A free run is enclosed over the box
(:mod:`.free_run`), so every sample states a linear inequality in the unknowns, with what is left over as a radius.

A record with hidden states is cut into pieces (:mod:`.pieces`), each with initial samples of its own. Further rows say
that the run of a piece ends where the next one begins.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from copy import copy
from dataclasses import dataclass, replace

import numpy as np
from scipy import sparse

from relaxations.algebra.affine_arithmetic import CENTRE, HIGH, LOW, RADIUS, SLOPES
from relaxations.algebra.arrays import Array, Index, Mask
from relaxations.algebra.ball_arithmetic import EPSILON, TINY
from smid.data import Dataset
from smid.identification.inversion.bounded import with_bounds_measured
from smid.identification.inversion.frame import Frame, generic, middle_and_half, static_curves
from smid.identification.inversion.free_run import enclose_run
from smid.identification.inversion.pieces import Piece, Pieces
from smid.identification.inversion.products import Products
from smid.identification.inversion.rows import ANCHORS, BALANCES, CONSTRAINT, LINKS, PRIOR, STEPWISE, Block, Rows
from smid.identification.inversion.tape import tape_of
from smid.models import Model
from smid.models.distribute import as_inverted
from smid.models.running import at_sampling_time

KEPT = 40
"""Symbols for what operations leave over, see :mod:`.free_run`."""

LENGTH = 10
"""Samples of a piece, if states are hidden. Longer ones say more over small boxes, shorter ones over large boxes."""

MOST_ERRORS = 500
"""Samples of a stepwise run. The programs of more cost more time than the boxes that they save."""

_UNKNOWN = 1e12
_NEAR = 1e-3  # of the first box
_UP = 1 + 64 * EPSILON  # covers the sums below


@dataclass(frozen=True)
class Group:
    """Unknowns, and the pieces whose rows bound them; None: all."""

    unknowns: tuple[int, ...]
    pieces: tuple[int, ...] | None


@dataclass(frozen=True, eq=False)
class _Forms:
    """Forms of the measured outputs of a piece, with output and sample; of constraints; of what is linked; balances."""

    outputs: Array
    places: Index
    constraints: Array
    linked: Array
    balances: Array


class Record:
    """A model and a record, prepared for many boxes.

    Parameters
    ----------
    bounds
        Of each noisy channel, in its unit.
    whole
        Whether hidden states are run through, from the first sample to the last, and the record is in no pieces.

    Attributes
    ----------
    names
        Of the unknowns, the parameters first, then the initial samples of the experiments.
    lower, upper
        What is known of the unknowns beforehand, shape (unknowns,).
    hidden
        Piece and unknown of each hidden state that a piece begins with.
    stepwise
        Whether a stepwise run is read in place of the anchored one, of at most `MOST_ERRORS` samples: where
        measurements show all states, and none is integrated, it says as much of a small box, and more of a wide one.

    Raises
    ------
    ModelError
        For a function without an enclosure.
    """

    def __init__(self, model: Model, data: Dataset, bounds: Mapping[str, float], *, whole: bool = False) -> None:
        model = at_sampling_time(model, data.sampling_time)
        self.model, self.data, self.whole = as_inverted(model), data, whole
        model, runs, bounds = with_bounds_measured(self.model, data, bounds)
        self.tape = tape = tape_of(model)
        # One state alone turns around no other, and needs no older symbols.
        self._kept = KEPT if tape.first[tape.states & ~tape.clocks].sum() > 1 else min(KEPT, 1)
        noise = {m.channel: bounds[m.channel] for m in model.measurements if m.noise is not None}
        plain = {m.signal: m.channel for m in model.measurements if m.inverse is None}
        self._noise = np.array(
            [noise.get(name, 0.0) if seen else 0.0 for name, seen in zip(tape.channels, tape.seen, strict=True)]
        )
        self._outputs = tape.shown
        self._shown = np.array([tape.signals.index(own) for _, own in tape.measured], dtype=np.int64)
        as_it_is = np.array([plain.get(own) == channel for channel, own in tape.measured], dtype=bool)
        self._states = np.where(as_it_is, self._shown, -1)

        def start(e: int, name: str, now: int) -> tuple[str, tuple[float, float]]:
            run, channel = data.experiments[e].name, plain.get(name)
            shown = f"{name}[{now}]" if len(data.experiments) == 1 else f"{name}[{now}] of {run}"
            value = runs[e][channel][now] if channel else np.nan
            if not np.isfinite(value):
                return shown, (-np.inf, np.inf)
            reach = noise.get(channel or "", 0.0)
            return shown, (float(np.nextafter(value - reach, -np.inf)), float(np.nextafter(value + reach, np.inf)))

        values = [np.array([own[name] for name in tape.channels]) for own in runs]
        boxes = [(p.lower, p.upper) for p in model.parameters]
        # A state that is measured says itself where a run is; a clock tells the time from the first sample on.
        measured = {m.signal for m in self.model.measurements if m.inverse is None}
        hidden = [k for k in np.flatnonzero(tape.states & ~tape.clocks) if tape.signals[k] not in measured]
        pieces = bool(hidden) and not (whole or tape.clocks.any())
        length = max(LENGTH, int(tape.first.max(initial=0))) if pieces else 0
        self.cut = Pieces.of(tape, values, boxes, start, length)
        self.hidden = [
            (place, int(piece.unknowns[k]))
            for place, piece in enumerate(self.cut.parts)
            for k in piece.initial[hidden].ravel().tolist()
            if k >= 0
        ]
        self.names, self.lower, self.upper = self.cut.names, self.cut.lower, self.cut.upper
        self.frame: Frame | None = None
        samples = sum(piece.said.size for piece in self.cut.parts)
        self.stepwise = samples <= MOST_ERRORS and not (self.hidden or len(tape.integrated))
        self.products = Products.none()

    def within(self, lower: Array, upper: Array) -> Record:
        """Return the record with more known of the unknowns beforehand."""
        other = copy(self)
        other.lower, other.upper = np.maximum(self.lower, lower), np.minimum(self.upper, upper)
        return other

    def rows(self, lower: Array, upper: Array, only: int | None = None, at_middle: bool = False) -> Rows:
        """Return what the record states about a box, but for rows that hold anywhere in it or say nothing.

        Parameters
        ----------
        only
            The piece that is read; None: all.
        at_middle
            Give each row the radius at the middle of the box. No smaller box there says more. It proves nothing.
        """
        blocks = self._blocks(lower, upper, only)
        ends = np.concatenate([block.forms[:, :SLOPES] for block in blocks])
        if at_middle:
            middle, known = middle_and_half(lower, upper)[0], np.isfinite(upper - lower)
            point = np.where(known, middle, lower), np.where(known, middle, upper)
            ends[:, RADIUS] = np.concatenate([block.forms[:, RADIUS] for block in self._blocks(*point, only)])
        sources = np.concatenate([block.sources for block in blocks])
        counts = np.concatenate([[0], *(np.full(len(b.forms), b.unknowns.shape[1]) for b in blocks)]).astype(np.int64)
        slopes = sparse.csr_array(
            (
                np.concatenate([block.forms[:, SLOPES:].ravel() for block in blocks]),
                np.concatenate([block.unknowns.ravel() for block in blocks]),
                np.cumsum(counts),
            ),
            shape=(len(ends), len(lower) + self._further + self._errors),
        )
        reach = np.asarray(abs(slopes).sum(axis=1))
        impossible = np.flatnonzero((ends[:, LOW] > 0) | (ends[:, HIGH] < 0))
        with np.errstate(invalid="ignore"):
            useful = np.isfinite(ends[:, RADIUS]) & (np.abs(ends[:, CENTRE]) + reach > ends[:, RADIUS])
        kept = impossible[:1] if len(impossible) else np.flatnonzero(useful)
        found = Rows(ends[:, CENTRE], ends[:, RADIUS], slopes, sources, -1).where(kept)
        return replace(found, impossible=0) if len(impossible) else found

    def knowledge(self, lower: Array, upper: Array) -> float:
        """Return how much the rows of a box say: minus the sum of the logarithms of their radii, cut at `_UNKNOWN`.

        Of a sample of which several runs say something, the run counts that says most.
        """
        total = 0.0
        for piece in self.cut.parts:
            free, other = (self._run(piece, a, lower, upper) for a in (0, STEPWISE if self.stepwise else 1))
            errors = np.abs(other.outputs[:, -1]) if self.stepwise else 0.0  # elsewhere they are in the radius
            outputs = np.minimum(free.outputs[:, RADIUS], other.outputs[:, RADIUS] + errors)
            linked = np.minimum(free.linked[:, RADIUS], other.linked[:, RADIUS])
            for radii in (outputs, linked, *(own[:, RADIUS] for run in (free, other) for own in run.balances)):
                total -= float(np.log(np.clip(radii, TINY, _UNKNOWN)).sum())
        return total

    def says_nothing(self, lower: Array, upper: Array) -> bool:
        """Return whether nothing is known over a box of any output that the model computes."""
        first = self.tape.first[self._shown]
        for piece in self.cut.parts:
            found = self._run(piece, 0, lower, upper)
            computed = found.places[:, 1] >= first[found.places[:, 0]]
            if not computed.any() or np.isfinite(found.outputs[computed, RADIUS]).any():
                return False
        return True

    def constraint_ends(self) -> Array:
        """Return the least and the largest value of each constraint over the first box, shape (constraints, 2)."""
        return self._run(self.cut.parts[0], 0, self.lower, self.upper).constraints[:, [LOW, HIGH]]

    def output_ends(self, name: str) -> list[Array]:
        """Return the ends of what is zero at each sample of a measured signal over the first box, shapes (n, 2).

        They are infinite where the model does not compute the signal.
        """
        place, result = [own for _, own in self.tape.measured].index(name), []
        for piece in self.cut.wholes:
            found = self._run(piece, 0, self.lower, self.upper)
            own = found.places[:, 0] == place
            ends = np.tile([-np.inf, np.inf], (piece.data.shape[1], 1))
            ends[found.places[own, 1]] = found.outputs[own][:, [LOW, HIGH]]
            result.append(ends)
        return result

    def fits(self, point: Array) -> bool:
        """Return whether a point is verified to fit every sample.

        With the noise bound added to the measurement, the form of an output is not positive, and with the bound
        subtracted not negative. So by continuity it is zero for a noise between. And every operation is defined.

        Parameters
        ----------
        point
            The parameters and the initial samples of the experiments; further ones are not read.
        """
        own = slice(self.count)
        if np.any(point[own] < self.lower[own]) or np.any(point[own] > self.upper[own]):
            return False
        plain = copy(self)
        plain.products = Products.none()  # at a point they are zero
        for piece in self.cut.wholes:
            for sign in (-1.0, 1.0):
                found = plain._run(piece, 0, point, point, sign)
                forms = found.outputs
                reach = (np.abs(forms[:, SLOPES:]).sum(axis=1) + forms[:, RADIUS]) * _UP
                # A sensor's curve may fall.
                above, below = forms[:, CENTRE] - reach >= 0, forms[:, CENTRE] + reach <= 0
                if sign < 0:
                    first = above, below
                kept = above | below if sign < 0 else (first[0] & below) | (first[1] & above)
                if not np.all(kept):
                    return False
            bounded = found.constraints
            reach = (np.abs(bounded[:, SLOPES:]).sum(axis=1) + bounded[:, RADIUS]) * _UP
            if not np.all(bounded[:, CENTRE] >= reach):
                return False
        return True

    def groups(self, free: Mask) -> tuple[Group, ...]:
        """Return those unknowns that are free: what a piece begins with is bounded by the pieces around it."""
        parts, found = self.cut.parts, []
        before = {piece.follows: k for k, piece in enumerate(parts) if piece.follows >= 0}
        for k, piece in enumerate(parts):
            own = piece.unknowns[len(self.tape.parameters) :]
            if k in before:
                near = [j for j in (before[k], k, piece.follows) if j >= 0]
                found.append(Group(tuple(own[free[own]].tolist()), tuple(near)))
        return *found, Group(tuple(np.flatnonzero(free[: self.count]).tolist()), None)

    @property
    def count(self) -> int:
        """The number of parameters and initial samples of the experiments."""
        return len(self.tape.parameters) + sum(int((piece.initial >= 0).sum()) for piece in self.cut.wholes)

    @property
    def _further(self) -> int:
        """The number of symbols for products, and for what operations on the parameters alone leave over."""
        return len(self.products.pairs) + len(self.tape.shared)

    @property
    def _errors(self) -> int:
        """The number of symbols for errors of measurements."""
        return sum(piece.said.size for piece in self.cut.parts) if self.stepwise else 0

    def _blocks(self, lower: Array, upper: Array, only: int | None) -> list[Block]:
        places = range(len(self.cut.parts)) if only is None else (only,)
        runs = ((place, a) for a in range(1 if self.stepwise else len(ANCHORS)) for place in places)
        blocks = [block for place, a in runs for block in self._said(place, a, lower, upper)]
        return [*blocks, *(self._steps(place, lower, upper) for place in places if self.stepwise)]

    def _steps(self, place: int, lower: Array, upper: Array) -> Block:
        """Return what a stepwise run states of the outputs."""
        piece = self.cut.parts[place]
        found, (outputs, n) = self._run(piece, STEPWISE, lower, upper), piece.said.shape
        # A form has the errors of the samples before, in the places that they take in turn, and then that of its own.
        which, now = found.places.T
        turns, own = np.divmod(np.arange((self.tape.depth + 1) * outputs), outputs)
        samples = np.maximum(now[:, None] - (now[:, None] - turns) % (self.tape.depth + 1), 0)
        begin = len(lower) + self._further
        before = begin + sum(other.said.size for other in self.cut.parts[:place])
        unknowns = np.concatenate([piece.unknowns, np.arange(len(lower), begin)])
        columns = [
            np.broadcast_to(unknowns, (len(which), len(unknowns))),
            before + own * n + samples,
            before + which * n + now,
        ]
        sources = np.column_stack([np.full_like(which, STEPWISE), np.full_like(which, place), which, now])
        return Block(found.outputs, np.column_stack(columns), sources)

    def _said(self, place: int, a: int, lower: Array, upper: Array) -> Iterator[Block]:
        """Yield what a run states: of the outputs, of the start of the next piece, and once of the unknowns alone."""
        piece = self.cut.parts[place]
        found = self._run(piece, a, lower, upper)
        unknowns = np.concatenate([piece.unknowns, len(lower) + np.arange(self._further)])
        yield Block.of(found.outputs, unknowns, a, place, found.places)
        forms = found.balances.reshape(-1, found.balances.shape[2])
        yield Block.of(forms, unknowns, BALANCES, place, np.argwhere(np.ones(found.balances.shape[:2], dtype=bool)))
        if len(piece.links):
            # What the run gives, less what the next piece begins with.
            there = piece.links[:, 2]
            forms, begins = found.linked, self._start(lower, upper, there, True)
            forms[:, CENTRE] -= begins[:, CENTRE]
            forms[:, RADIUS] = (forms[:, RADIUS] + begins[:, RADIUS] + EPSILON * np.abs(forms[:, CENTRE])) * _UP
            forms[:, LOW] = np.nextafter(forms[:, LOW] - begins[:, HIGH], -np.inf)
            forms[:, HIGH] = np.nextafter(forms[:, HIGH] - begins[:, LOW], np.inf)
            forms = np.column_stack([forms, -begins[:, SLOPES : SLOPES + len(there)]])
            yield Block.of(forms, np.concatenate([unknowns, there]), LINKS + a, place, piece.links[:, :2])
        if a == place == 0:
            # A form that is not negative, and at most its own largest value, is within half of that of its half.
            forms = found.constraints.copy()
            most = forms[:, HIGH].copy()
            forms[:, CENTRE] -= 0.5 * most
            forms[:, RADIUS] = (forms[:, RADIUS] + 0.5 * np.abs(most)) * _UP + EPSILON * np.abs(forms[:, CENTRE])
            forms[:, LOW] = np.where(most < 0, 1.0, -np.inf)
            forms[:, HIGH] = np.inf
            yield Block.of(forms, unknowns, CONSTRAINT, 0, _numbered(len(forms)))
            forms, factors = self.products.between_factors
            yield Block(forms, factors, np.tile([PRIOR, 0, 0, 0], (len(forms), 1)))
            if self.frame is not None:
                every = np.arange(len(lower))
                forms = self._start(lower, upper, every, True)[:, : SLOPES + len(every)]
                middle, half = middle_and_half(self.lower, self.upper)
                forms[:, CENTRE] -= middle
                size = np.abs(forms[:, CENTRE]) + np.abs(middle)
                forms[:, RADIUS] = (forms[:, RADIUS] + half + EPSILON * size) * _UP
                forms[:, LOW], forms[:, HIGH] = -np.inf, np.inf
                yield Block.of(forms, every, PRIOR, 0, _numbered(len(forms)))

    def _run(self, piece: Piece, a: int, lower: Array, upper: Array, shift: float = 0.0) -> _Forms:
        """Return the forms over a box; with a shift, for outputs that are exact and so many noise bounds larger."""
        tape, data, noise, states = self.tape, piece.data, self._noise, self._states
        if shift:
            moved = np.zeros(len(noise))
            moved[self._outputs] = noise[self._outputs]
            # A measurement less its bound says nothing of the state.
            data, states = data + shift * moved[:, None], np.full_like(states, -1)
            noise = np.where(moved > 0, EPSILON * np.nanmax(np.abs(data), axis=1, initial=0.0), 0.0)  # of the sum above
        # A point, for which alone data are shifted, is one of the unknowns themselves.
        start = self._start(lower, upper, piece.unknowns, not shift)
        # Where measurements show all states, their balances say as much as an anchored run, in less time.
        all_shown, stepwise = len(tape.integrated) > 0 and not (shift or self.hidden), a == STEPWISE
        anchor = 0.0 if stepwise else ANCHORS[a]
        lean, may_end = all_shown and np.isfinite(anchor), all_shown and not np.isfinite(anchor)
        balanced = len(tape.integrated) if lean else 0
        # A line reads no errors of more samples than its longest lag.
        kept = (tape.depth + 1) * len(tape.rows) if stepwise else 0 if balanced else self._kept
        width = start.shape[1]
        start = np.hstack([start, np.zeros((len(start), kept))])
        outputs = np.zeros((len(tape.rows), data.shape[1], width + (kept + 1) * stepwise))
        constraints, linked = np.zeros((len(tape.constraints), width)), np.zeros((len(piece.links), width))
        balances = np.zeros((balanced, data.shape[1], width))
        balances[:, 0, [RADIUS, LOW, HIGH]] = np.inf, -np.inf, np.inf
        enclose_run(
            (tape.once, tape.each, tape.numbers, tape.defined, tape.remembered, tape.first, tape.rows, tape.shared),
            (
                tape.inner,
                tape.sections,
                tape.integrated,
                float(self.model.sampling_time or self.data.sampling_time),
                self.model.substeps,
            ),
            (piece.initial, self._outputs, states, tape.constraints, piece.links),
            start,
            data,
            noise,
            tape.depth,
            kept,
            anchor,
            bool(shift),
            may_end,
            stepwise,
            outputs,
            constraints,
            linked,
            balances,
            self.products.columns,
        )
        return _Forms(outputs[piece.said], np.argwhere(piece.said), constraints, linked, balances)

    @property
    def loose(self) -> tuple[str, ...]:
        """The parameters and the hidden states of which nothing is known beforehand."""
        known, shown = np.isfinite(self.upper - self.lower), {m.signal for m in self.model.measurements}
        names = [name.split("[")[0] for name, k in zip(self.names, known, strict=True) if not k]
        return tuple(dict.fromkeys(name for name in names if name not in shown))

    @property
    def box(self) -> tuple[Array, Array]:
        """The first box: of the coordinates, where there is a frame."""
        return (self.lower, self.upper) if self.frame is None else (self.frame.lower, self.frame.upper)

    def turned(self, signals: Mapping[str, Array]) -> Record:
        """Return the record in coordinates in which the coefficients of static curves are known well or not at all.

        Parameters
        ----------
        signals
            Of any run of the first experiment.
        """
        curves = list(static_curves(self.model, signals))
        if not curves or not np.isfinite(self.upper - self.lower).all():
            return self
        other = copy(self)
        other.frame = Frame.of(self.lower, self.upper, curves)
        return other

    def with_products(self) -> Record:
        """Return the record with symbols for the products of unknowns that runs have, if it is one run by equations."""
        if len(self.cut.parts) > 1 or len(self.tape.integrated):
            return self
        other, count, (lower, upper) = copy(self), len(self.lower), self.box
        other.products = every = Products.all(count)
        seen = np.zeros(len(every.pairs), dtype=bool)
        point, known = generic(lower, upper), np.isfinite(upper - lower)
        half = np.where(known, _NEAR * (upper - lower), 0.0)
        near = np.where(known, point - half, lower), np.where(known, point + half, upper)
        for ends in (near, (lower, upper)):  # of a wide box, a run may have lost all slopes
            slopes = other._run(self.cut.parts[0], 0, *ends).outputs[:, SLOPES + count :]
            seen |= np.any(slopes[:, : len(seen)] != 0, axis=0)
        other.products = Products.of(count, every.pairs[seen])
        return other

    def _start(self, lower: Array, upper: Array, which: Index, framed: bool) -> Array:
        """Return the forms of some unknowns over a box, of the coordinates where it is framed."""
        count = len(which)
        forms = np.zeros((count, SLOPES + count + self._further))
        middle, half = middle_and_half(lower[which], upper[which])
        if self.frame is None or not framed:
            known = np.isfinite(upper[which] - lower[which])
            forms[:, CENTRE], forms[:, RADIUS] = middle, np.where(known, 0.0, np.inf)
            forms[np.arange(count), SLOPES + np.arange(count)] = half
            forms[:, LOW], forms[:, HIGH] = lower[which], upper[which]
        else:
            self.frame.write(forms, middle, half, which)
            forms[:, LOW] = np.maximum(forms[:, LOW], self.lower[which])
            forms[:, HIGH] = np.minimum(forms[:, HIGH], self.upper[which])
        return forms


def _numbered(count: int) -> Index:
    return np.column_stack([np.arange(count), np.zeros(count, dtype=np.int64)])
