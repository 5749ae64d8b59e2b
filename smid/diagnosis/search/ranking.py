"""The merits of visited sets under one noise model: that of the best set, found by iteration."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from math import comb, inf, log

from smid.diagnosis.search.effect_set import EffectSet
from smid.diagnosis.search.evidence import Evidence, bound_of_evidence, evidence, evidence_with_noise_effect
from smid.diagnosis.search.noise_model import NoiseModel, noise_model
from smid.diagnosis.search.record import Record

REACH = 7.0
"""Nats below the best, odds of a thousand, up to which sets are compared by all blocks, and grown."""


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


class Ranking:
    """Ranks sets, and remembers what it knows of each.

    Parameters
    ----------
    count
        How many effects may be put on a model.
    """

    def __init__(self, record: Record, count: int) -> None:
        self.record, self.count = record, count
        self.noise = NoiseModel({})
        self._best: EffectSet | None = None
        self._bounds: dict[EffectSet, float] = {}
        self._known: dict[EffectSet, Visited] = {}

    def rank(self, sets: Iterable[EffectSet]) -> tuple[Visited, ...]:
        """Return the sets with their merits, best first."""
        sets = tuple(sets)
        if self._best not in sets:
            self._adopt(min(sets, key=lambda s: s.fit.cost))
        seen: set[EffectSet] = set()
        while True:
            ranked = self._ranked(sets)
            best = ranked[0].effects
            # A circle of best sets ends at the first that comes again.
            if best is self._best or best in seen:
                return ranked
            seen.add(best)
            self._adopt(best)

    def _adopt(self, best: EffectSet) -> None:
        """Take the noise model of a set, and forget the merits under another one."""
        self._best, self._bounds, self._known = best, {}, {}
        self.noise = noise_model(best.errors, self.record.used)

    def _ranked(self, sets: Sequence[EffectSet]) -> tuple[Visited, ...]:
        for one in sets:
            if one not in self._bounds:
                self._bounds[one] = self._prior(one) + self._bound(one)
        result, best = [], -inf
        for one in sorted(sets, key=lambda s: -self._bounds[s]):
            if one not in self._known and self._bounds[one] >= best - REACH:
                found = self._evidence(one)
                self._known[one] = Visited(one, self._prior(one) + found.value, found)
            result.append(self._known.get(one) or Visited(one, self._bounds[one]))
            best = max(best, result[-1].merit)
        return tuple(sorted(result, key=lambda v: -v.merit))

    def _prior(self, one: EffectSet) -> float:
        """Return the log probability of a set before the record was seen, all sizes and variants being equal."""
        size = len(one.names)
        return -log(comb(max(self.count, size), size)) - sum(log(max(t.variants, 1)) for t in one.trials)

    def _bound(self, one: EffectSet) -> float:
        if one.detected:
            return inf
        free = [p.name for p in one.fit.model.parameters if p.lower < p.upper]
        boxes = {free.index(name): width for name, width in one.boxes.items()}
        return bound_of_evidence(self.record, self.noise, one.errors, boxes)

    def _evidence(self, one: EffectSet) -> Evidence:
        if one.detected:
            return evidence_with_noise_effect(self.record, one.fit, one.errors, one.boxes, one.detected[1].score_drop)
        return evidence(self.record, self.noise, one.fit, one.boxes)
