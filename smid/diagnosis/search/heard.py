"""Effects on the noise on the best of some sets: they need no fit, so a search that was ended still compares them."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from smid.diagnosis.effects.effect import Effect
from smid.diagnosis.search.effect_set import EffectSet, with_noise_effects
from smid.diagnosis.search.ranking import Ranking, Visited
from smid.diagnosis.search.record import Record
from smid.diagnosis.search.trial import Base

__all__ = ["heard"]


def heard(record: Record, base: Base, sets: Iterable[EffectSet], effects: Sequence[Effect]) -> tuple[Visited, ...]:
    """Return the sets with their merits, and the best one also with each effect on the noise that its residual shows.

    Parameters
    ----------
    record, base
        What the sets are compared on, and the base model fitted to it.
    """
    sets = tuple(sets)
    ranking = Ranking(record, base.errors, len(effects))
    leader = ranking.rank(sets)[0].effects
    shown = [one for one in with_noise_effects(leader, record, base.fit, effects) if isinstance(one, EffectSet)]
    return ranking.rank([*sets, *shown])
