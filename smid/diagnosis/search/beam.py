"""The search over sets of effects, best first.

All sets ever fitted are kept with their merit (`smid.diagnosis.search.evidence`).  The set that is most worth it is
*grown*: every effect is put on it, and each time everything is fitted jointly, from several starts.  Worth growing are

- the best set and those within `REACH` nats of it, and
- the best set without one of its effects: what is put there instead is a swap, and what is left out is a drop.

The search ends where none of these is left.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, replace
from functools import cached_property, partial
from math import comb, inf, log

import numpy as np

from relaxations.deadline import Progress, TimeIsUp, map_in_time
from smid.diagnosis.effects.effect import Effect
from smid.diagnosis.search.evidence import Evidence, bound_of_evidence, evidence, excess
from smid.diagnosis.search.noise_model import NoiseModel, noise_model
from smid.diagnosis.search.record import Record
from smid.diagnosis.search.trial import Base, Trial, refit, try_effect
from smid.fitting.fit import Errors, Fit

MOST = 5
REACH = 7.0  # nats: odds of a thousand


@dataclass(frozen=True, eq=False)
class EffectSet:
    """Effects put on the base model, one after another, with the joint fit of all.

    Parameters
    ----------
    trials
        In the order in which they were put on.
    """

    trials: tuple[Trial, ...]
    fit: Fit
    errors: Errors

    @cached_property
    def names(self) -> tuple[str, ...]:
        """Sorted names of the effects: what tells one set from another."""
        return tuple(sorted(trial.effect for trial in self.trials))

    def boxes(self) -> dict[str, float]:
        """Return the width of the box of each parameter that an effect brought."""
        model = self.fit.model
        return {
            name: model.parameter(name).upper - model.parameter(name).lower
            for trial in self.trials
            for name in trial.parameters
        }


@dataclass(frozen=True, eq=False)
class Visited:
    """A set with its merit under the noise model of the search.

    Parameters
    ----------
    merit
        In nats.
    evidence
        None where its upper bound already lies too far below the best set.
    """

    found: EffectSet
    merit: float
    evidence: Evidence | None = None


@dataclass(frozen=True, eq=False)
class Found:
    """The result of a search.

    Parameters
    ----------
    visited
        All sets that were fitted, best first.
    """

    visited: tuple[Visited, ...]
    noise: NoiseModel
    interrupted: bool


def search(
    record: Record,
    base: Base,
    effects: Sequence[Effect],
    executor: Executor | None = None,
    progress: Progress | None = None,
) -> Found:
    """Return all sets visited, with the merit of each."""
    sets: dict[tuple[str, ...], EffectSet] = {}
    _keep(sets, record, EffectSet((), base.fit, base.errors))
    grown: set[tuple[str, ...]] = set()
    applicable = [e for e in effects if e.detect is None]
    ranking = Ranking(record, len(applicable))
    interrupted = False
    try:
        while True:
            visited = ranking.rank(sets)
            best = visited[0]
            near = _without_one(best.found, base, sets, applicable)
            near += [v.found for v in _ahead_of_their_parts(visited) if v.merit >= best.merit - REACH]
            todo = next((s for s in near if s.names not in grown and len(s.trials) < MOST), None)
            if todo is None:
                break
            if progress:
                progress(f"trying {len(applicable)} effects on {', '.join(todo.names) or 'the base model'}")
            grown.add(todo.names)
            for grownup in _grow(todo, base, applicable, executor):
                _keep(sets, record, grownup)
    except (TimeIsUp, KeyboardInterrupt):
        interrupted = True
        visited = ranking.rank(sets)
    return Found(tuple(visited), ranking.noise, interrupted)


def _keep(sets: dict[tuple[str, ...], EffectSet], record: Record, one: EffectSet) -> None:
    """Keep a set unless the same effects are known with a smaller error."""
    old = sets.get(one.names)
    if old is None or one.fit.cost < old.fit.cost:
        sets[one.names] = one


def _ahead_of_their_parts(visited: Sequence[Visited]) -> list[Visited]:
    """Return the sets, best first, that are better than each set which has only some of their effects."""
    result: list[Visited] = []
    for one in visited:
        own = Counter(one.found.names)
        if not any(Counter(v.found.names) < own for v in result):
            result.append(one)
    return result


def _grow(
    one: EffectSet, base: Base, effects: Sequence[Effect], executor: Executor | None
) -> list[EffectSet]:
    """Put every effect on a set."""
    start = replace(base, fit=one.fit)
    trials = map_in_time(executor, partial(try_effect, base=start), effects)
    there = {(t.effect, t.label) for t in one.trials}
    return [
        EffectSet((*one.trials, t), t.fit, t.errors)
        for t in trials
        if t is not None and (t.effect, t.label) not in there
    ]


def _without_one(
    best: EffectSet, base: Base, sets: dict[tuple[str, ...], EffectSet], effects: Sequence[Effect]
) -> list[EffectSet]:
    """Return the sets that have one effect less, fitted anew where they were not visited."""
    by_name = {e.name: e for e in effects}
    result = []
    for k in range(len(best.trials)):
        rest = [t for i, t in enumerate(best.trials) if i != k]
        names = tuple(sorted(t.effect for t in rest))
        if names not in sets:
            reduced = _replayed(rest, base, by_name, best)
            if reduced is None:
                continue
            sets[names] = reduced
        result.append(sets[names])
    return result


def _replayed(trials: Sequence[Trial], base: Base, by_name: dict[str, Effect], best: EffectSet) -> EffectSet | None:
    """Put effects on the base model again, from the values that they have in a larger set."""
    done: list[Trial] = []
    for trial in trials:
        again = refit(by_name[trial.effect], trial, base, best.fit.model.values)
        if again is None:
            return None
        base = replace(base, fit=again.fit)
        done.append(again)
    return EffectSet(tuple(done), base.fit, done[-1].errors if done else base.errors)


class Ranking:
    """The merits of visited sets under one noise model: that of the best set.

    Parameters
    ----------
    count
        How many effects may be put on a model.
    """

    def __init__(self, record: Record, count: int) -> None:
        self.record, self.count = record, count
        self.noise: NoiseModel
        self._bounds: dict[EffectSet, float] = {}
        self._known: dict[EffectSet, Visited] = {}
        self._best: EffectSet | None = None

    def rank(self, sets: dict[tuple[str, ...], EffectSet]) -> list[Visited]:
        """Return the sets with their merits, best first."""
        if self._best is None or self._best not in sets.values():
            self._adopt(min(sets.values(), key=lambda s: s.fit.cost))
        seen = set()
        while True:
            visited = self._ranked([*sets.values()])
            best = visited[0].found
            if best is self._best or best in seen:
                return visited
            seen.add(best)
            self._adopt(best)

    def _adopt(self, best: EffectSet) -> None:
        """Take the noise model of a set."""
        self._best = best
        errors: dict[str, list[np.ndarray]] = {}
        used = []
        for e, channel, error, _ in best.errors:
            errors.setdefault(channel, []).append(error)
            if len(errors) == 1:
                used.append(self.record.used[e][: len(error)])
        self.noise = noise_model(errors, used)
        self._bounds, self._known = {}, {}

    def _ranked(self, sets: Sequence[EffectSet]) -> list[Visited]:
        for one in sets:
            if one not in self._bounds:
                self._bounds[one] = self._bound(one)
        result: list[Visited] = []
        best = -inf
        for one in sorted(sets, key=lambda s: -self._bounds[s]):
            if self._bounds[one] < best - REACH:
                result.append(Visited(one, self._bounds[one]))
                continue
            if one not in self._known:
                self._known[one] = self._weighed(one)
            result.append(self._known[one])
            best = max(best, self._known[one].merit)
        return sorted(result, key=lambda v: -v.merit)

    def _prior(self, one: EffectSet) -> float:
        k = len(one.trials)
        return -log(comb(max(self.count, k), k)) - sum(log(max(t.variants, 1)) for t in one.trials)

    def _bound(self, one: EffectSet) -> float:
        places = {p: i for i, p in enumerate(p.name for p in one.fit.model.parameters if p.lower < p.upper)}
        boxes = {places[name]: width for name, width in one.boxes().items()}
        return self._prior(one) + bound_of_evidence(self.record, self.noise, one.errors, boxes)

    def _weighed(self, one: EffectSet) -> Visited:
        found = evidence(self.record, self.noise, one.fit, one.boxes())
        samples = sum(int(u.sum()) for u in self.record.used)
        import os
        merit = self._prior(one) + found.value - (samples * log(excess(self.record, one.fit)) if os.environ.get("EXC") else 0)
        return Visited(one, merit, found)
