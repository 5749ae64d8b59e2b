"""The search over sets of effects, best first.

All sets ever fitted are kept with their merit (`smid.diagnosis.search.evidence`).  A set is *grown* by putting every
effect on it, each time with a joint fit of everything from several starts.  Worth growing are

1. of each size below that of the best set, the `WIDTH` best sets: the first effect found need not be one of several.
   Small sets come first, because what a large set lacks is found in them for less, and sets that differ in two effects
   come before their neighbours, which one stand-in may all have;
2. the parts of the best set, which lack one of its effects: every other effect is tried in the place of each, before a
   further one is added (Pudil, Novovicova and Kittler, Pattern Recognition Letters 15, 1994);
3. the best set;
4. sets within `REACH` of it that are better than each of their parts.

The parts are fitted with the best set, so that an effect that is not needed drops out. A set whose fit becomes much
better is grown anew. In the `WIDTH` sets of each step that fit best, each effect is put on anew beside the others, so
that none keeps a variant that was the best alone. A variant that fits as well as the best is kept beside it: the next
effect may tell them apart. The search ends where nothing is left to grow. Nine numbers steer it: `WIDTH`, `MOST`
effects in a set, `REACH`, `FOLDS` blocks left out in turn, `TAIL` degrees of freedom of the noise, `DISCREPANCY`, what
laws may leave, `OFF`, by how much errors may exceed a noise bound, `SCREEN`, what an effect has to promise, and
`HALVING`, one in how many is fitted to the end.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass
from functools import partial

from relaxations.deadline import Progress, TimeIsUp, map_in_time
from smid.diagnosis.effects.effect import Effect, on_the_noise
from smid.diagnosis.search.effect_set import (
    EffectSet,
    criterion,
    enlarged,
    leading,
    put_again,
    reduced,
    reopened,
    with_noise_effects,
)
from smid.diagnosis.search.guarded import Failure
from smid.diagnosis.search.ranking import Ranking, Visited
from smid.diagnosis.search.record import Record
from smid.diagnosis.search.trial import REACH, Base, Trial

WIDTH = 3
MOST = 5


@dataclass(frozen=True, eq=False)
class Found:
    """The result of a search.

    Parameters
    ----------
    visited
        All sets that were fitted, best first.
    led
        Every effect that the best set had at some time.
    failed
        By effect that raised an exception, the last one.
    interrupted
        Whether the time limit or Ctrl-C ended it.
    """

    visited: tuple[Visited, ...]
    led: frozenset[str]
    failed: Mapping[str, str]
    interrupted: bool


def search(
    record: Record,
    base: Base,
    effects: Sequence[Effect],
    executor: Executor | None = None,
    progress: Progress | None = None,
    begun: Sequence[Trial] = (),
) -> Found:
    """Return the sets of effects that explain the record, with their merits.

    Parameters
    ----------
    begun
        Effects that an earlier search named; the set of them is visited first.
    """
    by_name = {e.name: e for e in effects}
    fitted = [e for e in effects if e.extend is not on_the_noise]
    ranking = Ranking(record, base.errors, len(effects))
    leader = EffectSet((), base.fit, base.errors)
    kept = Kept(base, {leader.names: leader}, {})
    parts: dict[EffectSet, list[EffectSet]] = {leader: []}
    grown: dict[tuple[str, ...], EffectSet] = {}
    heard: set[EffectSet] = set()
    ranked = ranking.rank(kept.sets.values())
    say = progress or (lambda _line: None)
    try:
        if begun and (again := put_again(begun, base, by_name, {})) is not None:
            kept.add([again])
        while True:
            ranked = ranking.rank(kept.sets.values())
            kept.sets.update({v.names: v.effects for v in ranked})
            best = ranked[0].effects
            if best.names != leader.names:
                leader = best
                say(f"best so far: {', '.join(best.names) or 'the base model'}")
            # The parts of the best set are ranked with it.
            if best not in parts:
                parts[best] = reduced(best, base, by_name, kept.sets)
                kept.add(parts[best])
                continue
            worth = [*widest(ranked), *parts[best], best, *(v.effects for v in _ahead_of_their_parts(ranked))]
            todo = next((s for s in worth if not s.detected and len(s.trials) < MOST and is_new(s, grown, base)), None)
            if todo is not None:
                grown[todo.names] = todo
                say(f"trying {len(fitted)} effects on {', '.join(todo.names) or 'the base model'}")
                new = enlarged(todo, base, fitted, executor, say)
                kept.add(new)
                # The effects that were there had no say in what came later: let each choose its variant again.
                ahead = leading([one for one in new if isinstance(one, EffectSet)], base, WIDTH)
                kept.add(map_in_time(executor, partial(reopened, base=base, effects=by_name), ahead))
                continue
            # Effects on the noise need no fit, and are compared where nothing else is left.
            near = [v.effects for v in ranked if v.merit >= ranked[0].merit - REACH]
            silent = [one for one in dict.fromkeys((*near, *parts[best], *widest(ranked))) if one not in heard]
            if not silent:
                return Found(ranked, _led(parts), kept.failed, False)
            heard.update(silent)
            for one in silent:
                kept.add(with_noise_effects(one, record, base.fit, effects))
    except (TimeIsUp, KeyboardInterrupt):
        return Found(ranked, _led(parts), kept.failed, True)


def is_new(one: EffectSet, grown: Mapping[tuple[str, ...], EffectSet], base: Base) -> bool:
    """Return whether a set has not been grown, or only from a fit that was worse by more than `REACH`."""
    before = grown.get(one.names)
    return before is None or criterion(one, base) < criterion(before, base) - 2 * REACH


def _led(parts: Mapping[EffectSet, object]) -> frozenset[str]:
    """Return every effect of the sets that were best at some time: those whose parts were fitted."""
    return frozenset(name for one in parts for name in one.names)


@dataclass(frozen=True, eq=False)
class Kept:
    """The sets that were fitted, by the names of their effects, and the reasons of the effects that failed."""

    base: Base
    sets: dict[tuple[str, ...], EffectSet]
    failed: dict[str, str]

    def add(self, found: Iterable[EffectSet | Failure]) -> None:
        """Keep what was fitted; of two sets with the same effects the better one, or the one whose noise tells more."""

        def order(one: EffectSet) -> tuple[float, bool]:
            return criterion(one, self.base), one.detected is None

        for one in found:
            if isinstance(one, Failure):
                self.failed[one.effect] = one.reason
            elif one.names not in self.sets or order(one) < order(self.sets[one.names]):
                self.sets[one.names] = one


def widest(ranked: Sequence[Visited]) -> list[EffectSet]:
    """Return the best sets of each size below that of the best, small sets first, and those apart before the others."""
    plain = [v.effects for v in ranked if not v.effects.detected]
    result: list[EffectSet] = []
    for size in range(len(ranked[0].names)):
        apart: list[EffectSet] = []
        near: list[EffectSet] = []
        for one in plain:
            if len(one.trials) == size:
                is_near = any((Counter(one.names) - Counter(other.names)).total() < 2 for other in apart)
                (near if is_near else apart).append(one)
        result += [*apart, *near][:WIDTH]
    return result


def _ahead_of_their_parts(ranked: Sequence[Visited]) -> list[Visited]:
    """Return the sets within reach of the best that are better than each set with only some of their effects."""
    result: list[Visited] = []
    for one in ranked:
        if one.merit >= ranked[0].merit - REACH and not any(Counter(v.names) < Counter(one.names) for v in result):
            result.append(one)
    return result
