"""What the merits of all visited sets say: how probable each effect is, and which may be named.

The probability of an effect is the share of exp(merit) that the sets with it hold, among all sets visited.  An effect
is *named* from `NAMED` on.  The record is *ambiguous* where effects that are not named reach `NAMED` together: one of
them is there, but which one it does not tell.  All others from `DOUBTED` on are doubts.  Two effects that no experiment
could tell apart are one equation under two names, and count as the likelier of them. So does an effect with further
numbers that do nothing on the record.
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

Element = tuple[str, int]
"""Name of an effect, and how often it is there before."""

Same = Callable[[Visited, Visited], bool]
"""Whether the second set says no more than the first, which is likelier."""


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
    synonyms
        Sets that say the same as the chosen one, with another name for one of its effects.
    """

    chosen: Visited
    probability: Mapping[str, float]
    alternatives: tuple[str, ...]
    doubts: tuple[str, ...]
    synonyms: tuple[Visited, ...]


def posterior(visited: Sequence[Visited], same: Same) -> Posterior:
    """Judge visited sets, best first.

    Examples
    --------
    >>> from types import SimpleNamespace
    >>> sets = [SimpleNamespace(names=names, merit=merit) for names, merit in ((("lag",), 9.0), ((), 0.0))]
    >>> posterior(sets, lambda first, second: False).chosen.names
    ('lag',)
    """
    visited, synonyms = _without_synonyms(visited, same)
    weights = shares(visited)
    held = [_elements(v.names) for v in visited]
    everything = dict.fromkeys(one for elements in held for one in elements)
    probability = {
        one: float(sum(w for elements, w in zip(held, weights, strict=True) if one in elements)) for one in everything
    }
    named = {one for one, p in probability.items() if p >= NAMED}
    others = sorted((one for one, p in probability.items() if DOUBTED <= p < NAMED), key=lambda one: -probability[one])
    alternatives = _alternatives(held, weights, named, others)
    wanted = named | set(alternatives[:1])
    chosen = next((v for v, elements in zip(visited, held, strict=True) if elements == wanted), visited[0])
    return Posterior(
        chosen,
        {name: p for (name, place), p in probability.items() if place == 0},
        tuple(dict.fromkeys(name for name, _ in alternatives)),
        tuple(dict.fromkeys(name for name, _ in others if (name, 0) not in {*named, *alternatives})),
        tuple(one for one, better in synonyms if better is chosen),
    )


def _elements(names: Sequence[str]) -> set[Element]:
    """Return the effects of a set, each with the number of times that it was there before."""
    return {(name, names[:k].count(name)) for k, name in enumerate(names)}


def shares(visited: Sequence[Visited]) -> Array:
    """Return the probability of each set, shape (n,)."""
    merits = np.array([v.merit for v in visited])
    weights = np.exp(merits - merits.max())
    return np.asarray(weights / weights.sum())


def _alternatives(
    held: Sequence[set[Element]], weights: Array, named: set[Element], others: Sequence[Element]
) -> tuple[Element, ...]:
    """Return the fewest effects, likeliest first, of which at least one is there."""
    for count in range(2, len(others) + 1):
        group = set(others[:count])
        together = (w for elements, w in zip(held, weights, strict=True) if group & elements and named <= elements)
        if sum(together) >= NAMED:
            return tuple(others[:count])
    return ()


def _without_synonyms(visited: Sequence[Visited], same: Same) -> tuple[list[Visited], list[tuple[Visited, Visited]]]:
    """Split off the sets that say the same as a better one with another name for one effect, each with that one."""
    kept: list[Visited] = []
    found: list[tuple[Visited, Visited]] = []
    for one, weight in zip(visited, shares(visited), strict=True):
        own = Counter(one.names)
        swapped = (v for v in kept if len(v.names) == len(one.names) and (Counter(v.names) - own).total() == 1)
        better = next((v for v in swapped if same(v, one)), None) if weight >= DOUBTED / 10 else None
        if better is None:
            kept.append(one)
        else:
            found.append((one, better))
    return kept, found
