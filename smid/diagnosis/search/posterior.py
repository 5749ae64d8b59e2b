"""What the merits of all visited sets say: how probable each effect is, and which may be named.

The probability of an effect is the share of exp(merit) that the sets with it hold, among all sets visited.  An effect
is *named* from `NAMED` on.  The record is *ambiguous* where effects that are not named reach `NAMED` together: one of
them is there, but which one it does not tell.  All others from `DOUBTED` on are doubts.  Two effects that no experiment
could tell apart are one equation under two names, and count as the likelier of them.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from relaxations.algebra.arrays import Array
from smid.diagnosis.search.ranking import Visited

NAMED = 0.95
DOUBTED = 0.05

Same = Callable[[Visited, Visited], bool]
"""Whether no experiment could tell two sets apart."""


@dataclass(frozen=True, eq=False)
class Posterior:
    """The judgement over all visited sets.

    Parameters
    ----------
    chosen
        The set of the named effects and, where ambiguous, of the likeliest alternative.
    probability
        Of each effect that some visited set has.
    alternatives
        Where ambiguous, the effects of which one is there, likeliest first; otherwise none.
    doubts
        Effects that are neither named nor alternatives, likeliest first.
    """

    chosen: Visited
    probability: Mapping[str, float]
    alternatives: tuple[str, ...]
    doubts: tuple[str, ...]


def posterior(visited: Sequence[Visited], same: Same) -> Posterior:
    """Judge visited sets, best first.

    Examples
    --------
    >>> from types import SimpleNamespace
    >>> sets = [SimpleNamespace(names=names, merit=merit) for names, merit in ((("lag",), 9.0), ((), 0.0))]
    >>> posterior(sets, lambda first, second: False).chosen.names
    ('lag',)
    """
    visited = _without_synonyms(visited, same)
    weights = shares(visited)
    names = dict.fromkeys(name for v in visited for name in v.names)
    probability = {n: float(sum(w for v, w in zip(visited, weights, strict=True) if n in v.names)) for n in names}
    named = {n for n, p in probability.items() if p >= NAMED}
    others = sorted((n for n, p in probability.items() if DOUBTED <= p < NAMED), key=lambda n: -probability[n])
    alternatives = _alternatives(visited, weights, named, others)
    wanted = named | set(alternatives[:1])
    chosen = next((v for v in visited if set(v.names) == wanted), visited[0])
    return Posterior(chosen, probability, alternatives, tuple(n for n in others if n not in alternatives))


def shares(visited: Sequence[Visited]) -> Array:
    """Return the probability of each set, shape (n,)."""
    merits = np.array([v.merit for v in visited])
    weights = np.exp(merits - merits.max())
    return np.asarray(weights / weights.sum())


def _alternatives(
    visited: Sequence[Visited], weights: Array, named: set[str], others: Sequence[str]
) -> tuple[str, ...]:
    """Return the fewest effects, likeliest first, of which at least one is there."""
    for count in range(2, len(others) + 1):
        group = set(others[:count])
        held = sum(w for v, w in zip(visited, weights, strict=True) if group & set(v.names) and named <= set(v.names))
        if held >= NAMED:
            return tuple(others[:count])
    return ()


def _without_synonyms(visited: Sequence[Visited], same: Same) -> list[Visited]:
    """Leave out sets that say the same as a better one with another name for one of its effects."""
    kept: list[Visited] = []
    weights = shares(visited)
    for one, weight in zip(visited, weights, strict=True):
        own = Counter(one.names)
        swapped = (v for v in kept if len(v.names) == len(one.names) and (Counter(v.names) - own).total() == 1)
        if weight < DOUBTED / 10 or not any(same(v, one) for v in swapped):
            kept.append(one)
    return kept
