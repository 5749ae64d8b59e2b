"""The last comparison, after a search that was ended, or that saw windows only.

As far as the time goes, the best set is compared with its parts, so that no effect is named for lack of a comparison,
and with effects on the noise, which need no fit.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from contextlib import suppress

from relaxations.deadline import TimeIsUp
from smid.diagnosis.effects.effect import Effect
from smid.diagnosis.search.effect_set import EffectSet, reduced, with_noise_effects
from smid.diagnosis.search.ranking import Ranking, Visited
from smid.diagnosis.search.record import Record
from smid.diagnosis.search.search import Kept
from smid.diagnosis.search.trial import Base

__all__ = ["judged"]


def judged(record: Record, base: Base, sets: Iterable[EffectSet], effects: Sequence[Effect]) -> tuple[Visited, ...]:
    """Return the sets with their merits, and with them the parts of the best one and what its noise tells.

    Where the time is up, what was compared so far is returned.

    Parameters
    ----------
    record, base
        What the sets are compared on, and the base model fitted to it.
    """
    by_name = {e.name: e for e in effects}
    kept = Kept(base, {one.names: one for one in sets}, {})
    ranking = Ranking(record, base.errors, len(effects))
    ranked = ranking.rank(kept.sets.values())
    done: set[EffectSet] = set()
    with suppress(TimeIsUp):
        while (leader := ranked[0].effects) not in done:
            done.add(leader)
            kept.sets.update({v.names: v.effects for v in ranked})
            kept.add(with_noise_effects(leader, record, base.fit, effects))
            kept.add(reduced(leader, base, by_name, kept.sets))
            ranked = ranking.rank(kept.sets.values())
    return ranked
