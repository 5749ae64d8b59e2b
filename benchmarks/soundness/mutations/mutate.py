"""Draw a mutant: a genuine file, or two that are joined, changed by one to three mutations."""

from __future__ import annotations

import json
import random
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from benchmarks.soundness.mutations.bombs import BOMBS, TEXTS
from benchmarks.soundness.mutations.coupled import COUPLED, raised, with_claims
from benchmarks.soundness.mutations.forged import FORGED
from benchmarks.soundness.mutations.fresh import FRESH
from benchmarks.soundness.mutations.inside import INSIDE, joined
from benchmarks.soundness.mutations.library import Genuine
from benchmarks.soundness.mutations.simple import SIMPLE, foreign_row

__all__ = ["KINDS", "NOT_APPLICABLE", "Mutant", "mutant"]

SHARES = {
    "one thing": 0.21,
    "steps inside": 0.2,
    "claim and condition": 0.3,
    "new step": 0.1,
    "joined": 0.07,
    "text": 0.06,
    "forgery": 0.04,
    "bomb": 0.02,
}
KINDS = tuple(SHARES)
LARGE_JOINED = 30_000  # characters of both files
NOT_APPLICABLE = (KeyError, IndexError, TypeError, ValueError, AttributeError, ZeroDivisionError, OverflowError)


@dataclass(frozen=True)
class Mutant:
    """A changed file.

    Parameters
    ----------
    kind : str
        One of the kinds in :data:`KINDS`.
    changes : tuple of str
        What was done.
    text : str
    sources : tuple of Genuine
    """

    kind: str
    changes: tuple[str, ...]
    text: str
    sources: tuple[Genuine, ...]


def mutant(seed: int, number: int, genuine: Sequence[Genuine]) -> Mutant:
    """Return the mutant of a number; the same seed, number and files give the same one.

    Parameters
    ----------
    seed, number : int
    genuine : sequence of Genuine
    """
    rng = random.Random(f"{seed} {number}")
    (kind,) = rng.choices(KINDS, list(SHARES.values()))
    if kind == "bomb":
        name = rng.choice(list(BOMBS))
        return Mutant(kind, (name,), _dumped(BOMBS[name](rng)), ())
    weights = [_weight(one.text) for one in genuine]
    (source,) = rng.choices(genuine, weights)
    if kind == "forgery":
        name = rng.choice(list(FORGED))
        document, changes = FORGED[name](rng), [name]
        for _ in range(rng.choice([0, 0, 1, 2])):
            changes += _changed(kind, document, rng, genuine)
        return Mutant(kind, tuple(changes), _dumped(document), ())
    if kind == "text":
        name = rng.choice(list(TEXTS))
        return Mutant(kind, (name,), TEXTS[name](source.text, rng), (source,))
    sources, document, changes = (source,), source.document(), list[str]()
    if kind == "joined":
        other = rng.choice([one for one in genuine if len(one.text) + len(source.text) < LARGE_JOINED] or [source])
        sources, document = (source, other), joined(document, other.document())
        if rng.random() < 0.3:
            rng.shuffle(document["steps"])
    for _ in range(rng.choice([1, 1, 1, 2, 2, 3])):
        changes += _changed(kind, document, rng, genuine)
    if kind in ("claim and condition", "joined") or rng.random() < 0.25:
        changes += _tried("claims", with_claims, document, rng)
    elif rng.random() < 0.2:
        changes += _tried("claim raised", raised, document, rng)
    return Mutant(kind, tuple(changes), _dumped(document), sources)


def _weight(text: str) -> float:
    """Draw small files more often, that a run takes minutes, and those with more than plain bounds."""
    special = sum(f'"{key}":' in text for key in ("sides", "reach", "parts", "weights", "quotient"))
    return (1 + special) * (0.1 + 3000 / (3000 + len(text)))


def _changed(kind: str, document: Any, rng: random.Random, genuine: Sequence[Genuine]) -> list[str]:
    tables = {"one thing": SIMPLE, "steps inside": INSIDE, "claim and condition": COUPLED, "new step": FRESH}
    for _ in range(8):  # many mutations find nothing to change in most files
        table = tables.get(kind) or rng.choice(list(tables.values()))
        if kind in ("claim and condition", "new step") and rng.random() < 0.3:
            table = rng.choice([SIMPLE, INSIDE, COUPLED])
        name = rng.choice(list(table))
        if table is SIMPLE and rng.random() < 0.05:
            other = rng.choice(genuine).document()
            done = _tried("foreign row", lambda d, r, other=other: foreign_row(d, r, [other]), document, rng)
        else:
            done = _tried(name, table[name], document, rng)
        if done:
            return done
    return []


def _tried(name: str, change: Any, document: Any, rng: random.Random) -> list[str]:
    try:
        return [] if change(document, rng) is False else [name]
    except NOT_APPLICABLE:  # there is nothing to change, or an earlier change left nothing that this one knows
        return []


def _dumped(document: Any) -> str:
    text = json.dumps(document, separators=(",", ":"))
    return text.replace('"@digits"', "9" * 5000, 1).replace('"@decimal"', "0.25", 1)
