"""Stamp templates over samples: one polynomial problem from a model's equalities, its data and a box.

Kinks come first, each after those that its argument reads. The range of an argument over the box decides on which side
of zero it lies at each sample. The samples are then grouped by regime, and all samples of a regime are stamped at once
with its template. An open kink gets a variable of its own and its hull (:mod:`smid.feasible.piecewise_hull`).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from functools import cache

import numpy as np

from relaxations.algebra.arrays import Array, Index, Mask
from relaxations.algebra.ball_arithmetic import Balls, concatenate
from relaxations.algebra.polynomial import Polynomials
from relaxations.problem.problem import PolynomialProblem, polynomials_from_sympy
from smid.data import Dataset
from smid.feasible import piecewise_hull as hull
from smid.feasible.piecewise_functions import Kind
from smid.feasible.regimes import Ranges, Side, ranges, readings, resolved
from smid.feasible.template import Hinge, Reference, Template, Templates
from smid.models import ModelError
from smid.models.expressions import shown

FREE_BOUND = "noise_bound"  # name of the variable that stands for an unknown noise bound
CONSTANT = -1  # stands for the experiment of a kink that is the same at all times

Sides = Mapping[tuple[str, int], Index]  # (kink, experiment): the side at each time


@dataclass(frozen=True)
class Opening:
    """The open instances of one kink in one experiment; ``arguments`` has one row for each.

    ``experiment`` is ``CONSTANT`` for a kink that is the same at all times; ``within`` encloses the arguments.
    """

    hinge: Hinge
    experiment: int
    times: Index
    variables: Index
    arguments: Polynomials
    within: Ranges


@dataclass(frozen=True)
class Placed:
    """One kink over the times of one experiment, with a :class:`~smid.feasible.regimes.Side` at each time.

    ``chosen`` marks the times at which the caller, and not the box, decided the side. ``suffix`` ends the names of its
    variables, behind the time; it is None for a kink that is the same at all times.
    """

    hinge: Hinge
    times: Index
    suffix: str | None
    sides: Index
    chosen: Index
    within: Ranges

    def variable(self, k: int) -> str:
        """Return the name of the variable for its value at one of the times, where it is open."""
        name = self.hinge.kink.name
        return name if self.suffix is None else f"{name}[{self.times[k]}{self.suffix}]"


@dataclass(frozen=True)
class Stamped:
    """The problem, and how it was assembled.

    Parameters
    ----------
    samples
        Shape (n_equalities, 2). Experiment and time of each equality.
    openings
        The kinks that are open.
    placed
        All kinks, in the order of their inequalities: those of the chosen sides, then the hulls.
    definitions
        Rows of equalities, and the latent that each of them gives explicitly.
    missing
        Variables that stand for missing samples: they have no bound.
    """

    problem: PolynomialProblem
    samples: Index
    openings: tuple[Opening, ...]
    placed: tuple[Placed, ...]
    definitions: tuple[tuple[Index, Index], ...]
    missing: Index


def stamp_all(
    templates: Templates,
    data: Dataset,
    bounds: Mapping[str, float],
    free: str | None = None,
    box: tuple[Array, Array] | None = None,
    choose: Sides | None = None,
    decide: bool = True,
) -> Stamped:
    """Stamp a model's equations over all experiments.

    Parameters
    ----------
    free
        A channel whose noise bound becomes the last variable.
    box
        Shape (n_parameters,). Box of the parameters, in place of their priors.
    choose
        Sides for kinks that are open on the box. With them the problem is a part of the feasible set; without them it
        is a relaxation of the set.
    decide
        If false, every kink is a variable without any relation to its argument.

    Raises
    ------
    ModelError
        If a kink's argument has no finite upper bound.
    """
    return _Stamper(templates, data, bounds, free, box, choose or {}, decide).run()


@dataclass
class _Stamper:
    """The variables, equalities and inequalities stamped so far."""

    templates: Templates
    data: Dataset
    bounds: Mapping[str, float]
    free: str | None
    box: tuple[Array, Array] | None
    choose: Sides
    decide: bool
    names: list[str] = field(default_factory=list)
    lower: list[Array] = field(default_factory=list)
    upper: list[Array] = field(default_factory=list)
    place: dict[str, int] = field(default_factory=dict)
    openings: list[Opening] = field(default_factory=list)
    placed: list[Placed] = field(default_factory=list)
    equalities: list[Polynomials] = field(default_factory=list)
    inequalities: list[Polynomials] = field(default_factory=list)
    samples: list[Index] = field(default_factory=list)
    free_latents: list[Index] = field(default_factory=list)
    definitions: list[tuple[Polynomials, Index, Index]] = field(default_factory=list)
    pieces: list[tuple[list[_Piece], Index]] = field(default_factory=list)
    missing: list[Index] = field(default_factory=list)

    def run(self) -> Stamped:
        self._add_parameters()
        constant = self._constant_kinks()
        for number in range(len(self.data.experiments)):
            self._add_experiment(number, constant)
        if self.free is not None:
            last = int(self._variables([FREE_BOUND], np.zeros(1), np.full(1, np.inf))[0])
            self.inequalities += [_within(latents, last) for latents in self.free_latents]
        lower, upper = np.concatenate(self.lower), np.concatenate(self.upper)
        # An equality that gives a latent explicitly also bounds it.
        for defining, _, variables in self.definitions:
            reach = _reach(defining, variables, lower, upper)
            lower[variables] = np.maximum(lower[variables], -reach)
            upper[variables] = np.minimum(upper[variables], reach)
        equalities, inequalities = Polynomials.join(self.equalities), Polynomials.join(self.inequalities)
        return Stamped(
            PolynomialProblem(tuple(self.names), lower, upper, equalities, inequalities, cache(self._exact)),
            np.concatenate(self.samples).astype(np.int64),
            tuple(self.openings),
            tuple(self.placed),
            tuple((rows, variables) for _, rows, variables in self.definitions),
            np.concatenate(self.missing) if self.missing else np.zeros(0, dtype=np.int64),
        )

    def _exact(self) -> Polynomials:
        """Return the equalities with coefficients as sums of exact floats; computed only where a proof needs them."""
        return Polynomials.join([_rows(pieces, order, True) for pieces, order in self.pieces])

    def _add_parameters(self) -> None:
        parameters = self.templates.model.parameters
        lower, upper = self.box or (
            np.array([p.lower for p in parameters], dtype=np.float64),
            np.array([p.upper for p in parameters], dtype=np.float64),
        )
        own = self._variables([p.name for p in parameters], lower, upper)
        self.place.update({p.name: int(k) for p, k in zip(parameters, own, strict=True)})
        if parameters:
            constraints = polynomials_from_sympy(self.templates.model.constraints, [p.symbol for p in parameters])
            self.inequalities.append(constraints)

    def _add_experiment(self, number: int, constant: Mapping[str, int]) -> None:
        """Add the latents, kinks and equalities of one experiment."""
        experiment = self.data.experiments[number]
        suffix = "" if len(self.data.experiments) == 1 else f",{experiment.name}"
        n, hinges = experiment.n_samples, self.templates.hinges
        values = {name: np.where(np.isnan(samples), 0.0, samples) for name, samples in experiment.values.items()}
        free, lost = self._gaps(experiment.values)
        spans = _spans(self.templates, n)
        slots = self._latents(n, suffix, {name: span for name, span in spans.items() if name not in hinges}, free, lost)
        # Kinks come in the order in which their arguments read each other.
        sides = {name: np.full(n, side) for name, side in constant.items()}
        for name, hinge in hinges.items():
            if hinge.kink.constant or name not in spans:
                continue
            span = np.arange(spans[name][0], spans[name][1] + 1)
            times = _readable(hinge.argument, span, lost)
            lost[name] = np.isin(np.arange(n), np.setdiff1d(span, times))
            pieces = list(self._pieces(hinge.argument, times, values, sides, slots))
            found, slot = self._place_kink(hinge, number, times, _rows(pieces, _order(pieces)), suffix)
            sides[name], slots[name] = _spread(n, times, found, Side.OPEN), _spread(n, times, slot)
        # Each template gives one equality at each time.
        for part in self.templates.lines:
            times = _readable(part, np.arange(part.max_lag, n), lost)
            pieces = list(self._pieces(part, times, values, sides, slots))
            self.pieces.append((pieces, _order(pieces)))
            first = sum(family.n_rows for family in self.equalities)
            self.equalities.append(_rows(*self.pieces[-1]))
            self.samples.append(np.stack([np.full(len(times), number), times], axis=1))
            if part.defines:
                rows = first + np.arange(len(times))
                self.definitions.append((self.equalities[-1], rows, slots[part.signal][times]))

    def _gaps(self, values: Mapping[str, Array]) -> tuple[dict[str, Mask], dict[str, Mask]]:
        """Return where each latent is free since a sample is missing, and where a channel or latent cannot be read.

        A missing sample is written as zero, with a noise of its own that has no bound: minus the noise is the signal.
        A signal behind a curved sensor is a variable as it is, and the sensor's equality is left out. The sides of
        kinks need bounds, so a model with kinks does without the equations that read a missing sample.
        """
        free: dict[str, Mask] = {}
        lost: dict[str, Mask] = {}
        curved = {part.signal for part in self.templates.lines if part.defines}
        for m in self.templates.model.measurements:
            gaps = np.isnan(values[m.channel])
            if not gaps.any():
                continue
            if m.noise is None or m.signal in curved or self.templates.hinges:
                lost[m.channel] = gaps
                if m.noise is not None:
                    lost[m.noise] = gaps
                if m.signal in curved:
                    (lost if self.templates.hinges else free)[m.signal] = gaps
            else:
                free[m.noise] = gaps
        return free, lost

    def _latents(
        self,
        n: int,
        suffix: str,
        spans: Mapping[str, tuple[int, int]],
        free: Mapping[str, Mask],
        lost: Mapping[str, Mask],
    ) -> dict[str, Index]:
        """Add a variable for each latent at each time of its span; return the variables by latent."""
        noise_channel = {m.noise: m.channel for m in self.templates.model.measurements if m.noise is not None}
        slots: dict[str, Index] = {}
        for latent, (first, last) in spans.items():
            times = np.arange(first, last + 1)
            times = times[~lost[latent][times]] if latent in lost else times
            gaps = free[latent][times] if latent in free else np.zeros(len(times), dtype=bool)
            channel = noise_channel.get(latent)
            limit = np.where(gaps, np.inf, np.inf if channel is None else self.bounds.get(channel, np.inf))
            low, high = self.templates.model.bounds.get(latent, (-np.inf, np.inf))
            new = self._variables(
                [f"{latent}[{k}{suffix}]" for k in times], np.maximum(-limit, low), np.minimum(limit, high)
            )
            slots[latent] = _spread(n, times, new)
            self.missing.append(new[gaps])
            if channel is not None and channel == self.free:
                self.free_latents.append(new[~gaps])
        return slots

    def _variables(self, names: list[str], lower: Array, upper: Array) -> Index:
        first = len(self.names)
        self.names += names
        self.lower.append(lower)
        self.upper.append(upper)
        return np.arange(first, len(self.names))

    def _constant_kinks(self) -> dict[str, int]:
        """Decide the kinks that hold parameters only; return their sides."""
        sides: dict[str, Index] = {}
        now = np.zeros(1, dtype=np.int64)
        for name, hinge in self.templates.hinges.items():
            if hinge.kink.constant:
                pieces = list(self._pieces(hinge.argument, now, {}, sides, {}))
                sides[name], slot = self._place_kink(hinge, CONSTANT, now, _rows(pieces, _order(pieces)), "")
                self.place[name] = int(slot[0])
        return {name: int(side[0]) for name, side in sides.items()}

    def _place_kink(
        self, hinge: Hinge, experiment: int, times: Index, arguments: Polynomials, suffix: str
    ) -> tuple[Index, Index]:
        """Decide one kink over an experiment; return its side and its variable at each of ``times``."""
        kind, name = hinge.kink.kind, hinge.kink.name
        within = (
            ranges(arguments, np.concatenate(self.lower), np.concatenate(self.upper))
            if self.decide
            else Ranges(np.full(len(times), -np.inf), np.full(len(times), np.inf))
        )
        decided = within.sides(kind)
        sides = decided.copy()
        # Take the sides that the caller chose where the box decides nothing.
        wanted = self.choose.get((name, experiment))
        if wanted is not None:
            here = np.flatnonzero((sides == Side.OPEN) & (wanted[times] != Side.OPEN))
            sides[here] = wanted[times][here]
            part = Ranges(within.low[here], within.high[here])
            self.inequalities.append(hull.chosen(kind, arguments.take(here), sides[here], part))
        placed = Placed(hinge, times, None if experiment == CONSTANT else suffix, sides, sides != decided, within)
        self.placed.append(placed)
        return sides, self._open(placed, experiment, arguments)

    def _open(self, placed: Placed, experiment: int, arguments: Polynomials) -> Index:
        """Add a variable and the hull for each open instance of a kink; return the variables, -1 elsewhere."""
        kind = placed.hinge.kink.kind
        slots = np.full(len(placed.times), -1, dtype=np.int64)
        at = np.flatnonzero(placed.sides == Side.OPEN)
        if not len(at):
            return slots
        part, rows = Ranges(placed.within.low[at], placed.within.high[at]), arguments.take(at)
        if self.decide and kind is Kind.POSITIVE_PART and not np.isfinite(part.high).all():
            raise _unbounded(self.templates, placed.hinge)
        slots[at] = self._variables([placed.variable(k) for k in at.tolist()], *hull.box(kind, part))
        if self.decide:
            self.inequalities.append(hull.hull(kind, rows, slots[at], part))
        self.openings.append(Opening(placed.hinge, experiment, placed.times[at], slots[at], rows, part))
        return slots

    def _pieces(
        self,
        part: Template,
        times: Index,
        values: Mapping[str, Array],
        sides: Mapping[str, Index],
        slots: Mapping[str, Index],
    ) -> Iterator[_Piece]:
        """Group the times by regime."""
        kinks = sorted(r for r in readings(part, self.templates.hinges) if r[0] in self.templates.hinges)
        if not kinks:
            yield _Piece(part, values, times, self.place, slots)
            return
        table = np.stack([sides[name][times - lag] for name, lag in kinks], axis=1)
        regimes, which = np.unique(table, axis=0, return_inverse=True)
        for k, regime in enumerate(regimes.tolist()):
            known: dict[Reference, int] = dict(zip(kinks, regime, strict=True))
            form = resolved(part, self.templates.hinges, known)
            yield _Piece(form, values, times[which.reshape(-1) == k], self.place, slots)


@dataclass(frozen=True)
class _Piece:
    """A template in one regime, and the times of that regime."""

    part: Template
    values: Mapping[str, Array]
    times: Index
    place: Mapping[str, int]
    slots: Mapping[str, Index]

    def stamp(self, expand: bool) -> Polynomials:
        """Return one row for each time; ``expand`` gives coefficients as sums of exact floats."""
        times, terms = self.times, self.part.terms
        if not terms:
            nothing = np.zeros(0, dtype=np.int64)
            return Polynomials(len(times), nothing, nothing.reshape(0, 0), Balls.exact(nothing))
        degree = max(len(term.parameters) + len(term.latents) for term in terms)
        rows, factors, coefficients = [], [], []
        for term in terms:
            columns = [np.full(len(times), self.place[p]) for p in term.parameters]
            columns += [self.slots[latent][times - lag] for latent, lag in term.latents]
            columns += [np.full(len(times), -1)] * (degree - len(columns))
            monomials = np.sort(np.stack(columns, axis=1), axis=1) if columns else np.empty((len(times), 0))
            own, balls = np.arange(len(times)), term.coefficients(self.values, times)
            if expand and balls.rad.any():
                own, balls = term.expansions(self.values, times)
            rows.append(own)
            factors.append(monomials[own])
            coefficients.append(balls)
        stamped = Polynomials(
            len(times), np.concatenate(rows), np.concatenate(factors).astype(np.int64), concatenate(coefficients)
        )
        # Collecting would add the summands up again.
        return stamped if expand else stamped.collect()


def _order(pieces: list[_Piece]) -> Index:
    """Return the order that sorts the rows of all pieces by time."""
    return np.argsort(np.concatenate([piece.times for piece in pieces]), kind="stable")


def _rows(pieces: list[_Piece], order: Index, expand: bool = False) -> Polynomials:
    return Polynomials.join([piece.stamp(expand) for piece in pieces]).take(order)


def _spans(templates: Templates, n_samples: int) -> dict[str, tuple[int, int]]:
    """Return the first and last time at which each latent, and each kink that depends on time, occurs."""
    spans: dict[str, tuple[int, int]] = {}
    for part in templates.lines:
        for latent, lag in sorted(readings(part, templates.hinges)):
            if latent in templates.hinges and templates.hinges[latent].kink.constant:
                continue
            first, last = part.max_lag - lag, n_samples - 1 - lag
            old = spans.get(latent, (first, last))
            spans[latent] = (min(old[0], first), max(old[1], last))
    return spans


def _readable(part: Template, times: Index, lost: Mapping[str, Mask]) -> Index:
    """Return the times at which nothing that a template reads is lost."""
    kept = np.ones(len(times), dtype=bool)
    for name, lag in part.samples | part.latents:
        if name in lost:
            kept &= ~lost[name][times - lag]
    return times[kept]


def _spread(n: int, times: Index, values: Index, elsewhere: int = -1) -> Index:
    whole = np.full(n, elsewhere, dtype=np.int64)
    whole[times] = values
    return whole


def _unbounded(templates: Templates, hinge: Hinge) -> ModelError:
    read = {name for term in hinge.argument.terms for name in term.parameters}
    loose = [p.name for p in templates.model.parameters if p.name in read and not np.isfinite(p.upper - p.lower)]
    what = f"give bounds to {', '.join(loose)}" if loose else "measure, or bound, every signal that it reads"
    return ModelError(f"{shown(hinge.kink.argument)} is inside Max, Min or Abs and may be arbitrarily large: {what}")


def _reach(defining: Polynomials, variables: Index, lower: Array, upper: Array) -> Array:
    """Return the largest magnitude of each latent that an equality gives explicitly, with coefficient one."""
    own = (defining.term_degrees == 1) & (defining.factors.max(axis=1) == variables[defining.rows])
    largest = np.maximum(np.abs(lower), np.abs(upper))
    sizes = Balls.exact(np.where(own, 0.0, defining.coefficients.magnitude()))
    with np.errstate(invalid="ignore"):
        for column in defining.factors.T:
            sizes = sizes * Balls.exact(np.where((column >= 0) & ~own, largest[column], 1.0))
        reach = sizes.segment_sum(defining.rows, defining.n_rows).upper
    return np.where(np.isfinite(reach), reach, np.inf)


def _within(latents: Index, bound: int) -> Polynomials:
    """Return ``bound - latent >= 0`` and ``bound + latent >= 0``."""
    count = len(latents)
    own = np.arange(2 * count)
    return Polynomials(
        2 * count,
        np.concatenate([own, own]),
        np.concatenate([np.tile(latents, 2), np.full(2 * count, bound)]).reshape(-1, 1),
        Balls.exact(np.concatenate([np.full(count, -1.0), np.ones(3 * count)])),
    )
