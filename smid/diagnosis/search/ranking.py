"""The merits of visited sets under one noise model: that of the best set, found by iteration."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from math import comb, inf, log

from smid.diagnosis.search.effect_set import EffectSet
from smid.diagnosis.search.evidence import (
    Evidence,
    bound_of_evidence,
    evidence,
    evidence_with_noise_effect,
    noise_of,
)
from smid.diagnosis.search.noise_model import NoiseModel
from smid.diagnosis.search.record import Record
from smid.diagnosis.search.trial import REACH
from smid.fitting.problem import Errors


@dataclass(frozen=True, eq=False)
class Visited:
    """A set with its merit.

    Parameters
    ----------
    merit
        In nats.
    evidence
        None where its upper bound already lies more than `REACH` below the best set.
    """

    effects: EffectSet
    merit: float
    evidence: Evidence | None = None

    @property
    def names(self) -> tuple[str, ...]:
        """Sorted names of the effects."""
        return self.effects.names


@dataclass(frozen=True, eq=False)
class _Table:
    """What is known of each set under one noise model."""

    noise: NoiseModel
    bounds: dict[EffectSet, float] = field(default_factory=dict)
    known: dict[EffectSet, Visited] = field(default_factory=dict)


class Ranking:
    """Ranks sets under one noise model, and remembers what it knows of each.

    The noise model is that of the best set under it.  Where several noise models have this property, and one of them
    takes what a set fails to explain for noise, the one counts whose best set has the largest merit.  So the iteration
    begins twice: at the best set known and at the set of the least error.

    Parameters
    ----------
    base
        Errors of the base model.
    count
        How many effects may be put on a model.
    """

    def __init__(self, record: Record, base: Errors, count: int) -> None:
        self.record, self.base, self.count = record, base, count
        self._best: EffectSet | None = None
        self._tables: dict[EffectSet, _Table] = {}

    def rank(self, sets: Iterable[EffectSet]) -> tuple[Visited, ...]:
        """Return the sets with their merits, best first; of those that are tied the best one alone."""
        given = {one.names: one for one in sets}
        every = tuple(one for first in given.values() for one in first.alike)
        starts = dict.fromkeys(s for s in (self._best, min(every, key=lambda s: s.fit.cost)) if s in every)
        settled = [self._settled(every, start) for start in starts if start is not None]
        ranked, table = max(settled, key=lambda pair: pair[0][0].merit - pair[1].noise.price)
        self._tables = {one: t for one, t in self._tables.items() if any(t is used for _, used in settled)}
        leading: dict[tuple[str, ...], Visited] = {}
        for one in ranked:
            first = given[one.names]
            if one.names not in leading and (one.evidence or one.effects is first):
                leading[one.names] = one if one.effects is first else self._led(first, one, table)
        self._best = next(iter(leading.values())).effects
        return tuple(leading.values())

    def _led(self, first: EffectSet, one: Visited, table: _Table) -> Visited:
        """Return a set that is better than the one it is tied with in the place of that one."""
        leader = first.led_by(one.effects)
        found = table.known[leader] = replace(one, effects=leader)
        table.bounds[leader] = table.bounds[one.effects]
        if one.effects in self._tables:
            self._tables[leader] = self._tables.pop(one.effects)
        return found

    def _settled(self, sets: Sequence[EffectSet], start: EffectSet) -> tuple[tuple[Visited, ...], _Table]:
        """Rank under the noise model of the best set, beginning with that of a given one."""
        seen = [start]
        while True:
            if seen[-1] not in self._tables:
                one = seen[-1]
                noise = noise_of(self.record, self.base, one.fit, one.errors, one.boxes)
                self._tables[one] = _Table(noise)
            table = self._tables[seen[-1]]
            ranked = self._ranked(sets, table)
            # A circle of best sets ends at the first that comes again.
            if ranked[0].effects in seen:
                return ranked, table
            seen.append(ranked[0].effects)

    def _ranked(self, sets: Sequence[EffectSet], table: _Table) -> tuple[Visited, ...]:
        for one in sets:
            if one not in table.bounds:
                table.bounds[one] = self._prior(one) + self._bound(one, table.noise)
        result, best = [], -inf
        for one in sorted(sets, key=lambda s: -table.bounds[s]):
            if one not in table.known and table.bounds[one] >= best - REACH:
                found = self._evidence(one, table.noise)
                table.known[one] = Visited(one, self._prior(one) + found.value, found)
            result.append(table.known.get(one) or Visited(one, table.bounds[one]))
            best = max(best, result[-1].merit)
        return tuple(sorted(result, key=lambda v: -v.merit))

    def _prior(self, one: EffectSet) -> float:
        """Return the log probability of a set before the record was seen, all sizes and variants being equal."""
        size = len(one.names)
        return -log(comb(max(self.count, size), size)) - sum(log(max(t.variants, 1)) for t in one.trials)

    def _bound(self, one: EffectSet, noise: NoiseModel) -> float:
        if one.detected:
            return inf
        free = [p.name for p in one.fit.model.parameters if p.lower < p.upper]
        boxes = {free.index(name): width for name, width in one.boxes.items()}
        return bound_of_evidence(self.record, noise, one.errors, boxes)

    def _evidence(self, one: EffectSet, noise: NoiseModel) -> Evidence:
        if one.detected:
            gained = one.detected[1].score_drop or 0.0
            return evidence_with_noise_effect(self.record, self.base, one.fit, one.errors, one.boxes, gained)
        return evidence(self.record, noise, one.fit, one.boxes)
