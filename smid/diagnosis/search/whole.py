"""The sets that a search on windows found, fitted to the whole record and compared there."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from relaxations.deadline import Progress
from smid.diagnosis.effects.effect import Effect
from smid.diagnosis.search.effect_set import EffectSet, put_again
from smid.diagnosis.search.judged import judged
from smid.diagnosis.search.record import Record
from smid.diagnosis.search.search import Found
from smid.diagnosis.search.trial import REACH, Base

__all__ = ["compared"]

_MOST = 12


def compared(record: Record, base: Base, found: Found, effects: Sequence[Effect], progress: Progress) -> Found:
    """Return the best sets of a search, their merits those on another record: each is fitted to it from its values.

    Compared are the best set and the sets within reach of it, a dozen at most, and the parts of the best.

    Parameters
    ----------
    record, base
        The whole record without its test part, and the base model fitted to it.
    """
    by_name = {e.name: e for e in effects}
    least = found.visited[0].merit - REACH
    near = [v for v in found.visited if v.effects.trials and not v.effects.detected and v.merit >= least]
    sets: dict[tuple[str, ...], EffectSet] = {(): EffectSet((), base.fit, base.errors)}
    for one in near[:_MOST]:
        progress(f"fitting {', '.join(one.names)} to the whole record")
        again = put_again(one.effects.trials, base, by_name, one.effects.fit.model.values)
        if again is not None:
            sets[again.names] = again
    return replace(found, visited=judged(record, base, sets.values(), effects))
