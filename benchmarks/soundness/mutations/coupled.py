"""Mutations that move a claim together with what it rests on: only the conditions beside the arithmetic refuse them."""

from __future__ import annotations

import random
from collections.abc import Callable
from fractions import Fraction
from typing import Any

from benchmarks.soundness.mutations.exact import number
from benchmarks.soundness.mutations.inside import of_kind
from benchmarks.soundness.mutations.places import bounds, claims
from benchmarks.soundness.mutations.residual import claim_all
from benchmarks.soundness.mutations.simple import changed_number, shown

__all__ = ["COUPLED", "raised"]

Document = dict[str, Any]


def scale_to_zero(document: Document, rng: random.Random) -> None:
    """Leave a point of the box, or a smaller box, in one variable or in all."""
    step = rng.choice(bounds(document))
    count = len(step["scale"])
    factor = rng.choice([0, 0, Fraction(-1), Fraction(1, 2), Fraction(99, 100), Fraction(-2)])
    shift = Fraction(rng.randint(-4, 4), 4)
    chosen = list(range(count)) if rng.random() < 0.3 else [rng.randrange(count)]
    if rng.random() < 0.6:  # a box that is not made use of might not be looked at either
        _without(step, set(chosen))
    for k in chosen:
        old = number(step["scale"][k])
        step["centre"][k] = shown(number(step["centre"][k]) + shift * old)
        step["scale"][k] = shown(old * factor)


def _without(step: Any, variables: set[int]) -> None:
    """Leave out of a step's multipliers what holds some of its variables t."""
    for pair in step["equalities"]:
        pair[1] = [term for term in pair[1] if not variables & set(term[1])]
    step["products"] = [
        p for p in step["products"] if not any(kind != "inequality" and v in variables for kind, v in p["of"])
    ]
    for product in step["products"]:
        pairs = zip(product["basis"], product["factor"], strict=True)
        left = [(m, factor) for m, factor in pairs if not variables & set(m)]
        product["basis"], product["factor"] = [m for m, _ in left], [factor for _, factor in left]


def moved_centre(document: Document, rng: random.Random) -> None:
    step = rng.choice(bounds(document))
    k = rng.randrange(len(step["centre"]))
    step["centre"][k] = changed_number(step["centre"][k], rng)


def point_of_steps(document: Document, rng: random.Random) -> None:
    """Shrink every step of the file to the same smaller box."""
    k = rng.randrange(len(document["variables"]))
    share = rng.choice([Fraction(0), Fraction(1, 2), Fraction(9, 10)])
    for step in bounds(document):
        if k < len(step["scale"]):
            step["scale"][k] = shown(number(step["scale"][k]) * share)


def negative_weight(document: Document, rng: random.Random) -> None:
    products = [p for step in bounds(document) for p in step["products"]]
    own = rng.choice([p for p in products if p["of"]] or products)
    own["weight"] = shown(-number(own["weight"]) * rng.choice([1, 1, 2, 10]))


def wider_box(document: Document, rng: random.Random) -> None:
    """Let a variable go farther than any step looks, or anywhere."""
    k = rng.randrange(len(document["box"]))
    low, high = document["box"][k]
    if rng.random() < 0.4 or low is None or high is None:
        document["box"][k] = [None, None]
        return
    more = (number(high) - number(low) or 1) * rng.choice([Fraction(1, 10**6), Fraction(1, 4), Fraction(2)])
    document["box"][k] = [shown(number(low) - more), shown(number(high) + more)]


def fewer_rows(document: Document, rng: random.Random) -> None:
    """Make a row say nothing, the multipliers unchanged."""
    family = rng.choice([kind for kind in ("equalities", "inequalities") if document[kind]])
    document[family][rng.randrange(len(document[family]))] = rng.choice([[], [[1, 0, []]], [[0, 1, []]]])


def wider_balls(document: Document, rng: random.Random) -> None:
    """Let coefficients stand for more numbers."""
    families = ("equalities", "inequalities")
    rows = [row for kind in families for row in document[kind] if row]
    row = rng.choice(rows)
    for term in row if rng.random() < 0.3 else [rng.choice(row)]:
        term[1] = rng.choice([0, 0, 0, "1/100", "1/2", 1, "1/10000000", "1/10000000", "1/9", "-1/100"])


def parts_lost(document: Document, rng: random.Random) -> None:
    """Drop or narrow parts, and leave it to the claims to follow."""
    parts = of_kind(document, "parts", rng)["parts"]
    if rng.random() < 0.5 or "box" not in parts[0]:
        del parts[rng.randrange(len(parts))]
        return
    part = rng.choice(parts)
    low, high = (number(end) for end in part["box"])
    share = Fraction(rng.randint(0, 8), 8)
    part["box"] = [shown(low), shown(low + share * (high - low))]
    for step in part["steps"]:
        if "scale" in step:
            v = part["variable"]
            step["centre"][v], step["scale"][v] = shown(low + share * (high - low) / 2), shown(share * (high - low) / 2)


def narrow_rows(document: Document, rng: random.Random) -> None:
    """Move the ends of chords and hulls inwards."""
    step = of_kind(document, "sides", rng)
    share = rng.choice([Fraction(1, 2), Fraction(9, 10), Fraction(0), Fraction(999999, 10**6)])
    for row in step["rows"]:
        row[2:] = [shown(number(end) * share) for end in row[2:]]


def decided(document: Document, rng: random.Random) -> None:
    """Take a kink as decided that is open, its rows unchanged."""
    step = of_kind(document, "sides", rng)
    known = {n for n, _ in step["sides"]}
    open_ones = [n for n in range(len(document["kinks"])) if n not in known]
    step["sides"].append([rng.choice(open_ones), rng.choice([1, -1])])


def flipped(document: Document, rng: random.Random) -> None:
    """Flip sides of kinks in parts and steps alike."""
    n = rng.randrange(len(document["kinks"]))

    def walk(node: Any) -> None:
        if isinstance(node, dict):
            if node.get("kink") == n and "side" in node:
                node["side"] = -node["side"]
            for pair in node.get("sides", []):
                if pair[0] == n:
                    pair[1] = -pair[1]
            for value in node.values():
                walk(value)
        elif isinstance(node, list):
            for value in node:
                walk(value)

    walk(document["steps"])


def ridden(document: Document, rng: random.Random) -> None:
    """Change what is multiplied by s, or the sizes, and the claims of the faces with it."""
    own = of_kind(document, "reach", rng)["reach"]
    kind = rng.randrange(3)
    if kind == 0:
        own["riding"] = [v for v in range(len(document["variables"])) if rng.random() < 0.3]
    elif kind == 1:
        pair = rng.choice(own["variables"])
        pair[1] = shown(number(pair[1]) * rng.choice([Fraction(1, 8), Fraction(-1), Fraction(0), Fraction(4)]))
    else:
        own["faces"][rng.randrange(len(own["faces"]))]["side"] *= -1


def emptied(document: Document, rng: random.Random) -> None:
    """Claim of nothing what was claimed of something: no point at all."""
    for claim in claims(document) if rng.random() < 0.3 else [rng.choice(claims(document))]:
        claim["objective"] = []
        if rng.random() < 0.5:
            claim["bound"] = "1/1000"


def raised(document: Document, rng: random.Random) -> None:
    """Claim more: a little, or a lot."""
    claim = rng.choice(claims(document))
    old = number(claim["bound"])
    more = Fraction(10) ** rng.randint(-15, 3)
    claim["bound"] = shown(rng.choice([old + more, old + abs(old) * more, -old, old + 1]))


def repaired_only(document: Document, rng: random.Random) -> None:
    """Claim exactly what the arithmetic allows, of whatever was changed before."""


COUPLED: dict[str, Callable[[Document, random.Random], Any]] = {
    "scale to zero": scale_to_zero,
    "centre": moved_centre,
    "scale of all steps": point_of_steps,
    "weight negated": negative_weight,
    "box widened": wider_box,
    "row without effect": fewer_rows,
    "balls": wider_balls,
    "parts lost": parts_lost,
    "rows of kinks narrowed": narrow_rows,
    "kink decided": decided,
    "sides flipped": flipped,
    "sizes of a derived box": ridden,
    "claimed empty": emptied,
    "claim repaired": repaired_only,
}


def with_claims(document: Document, rng: random.Random) -> None:
    """Let the claims follow: to what the arithmetic allows, or by a step upwards."""
    if rng.random() < 0.85:
        claim_all(document)
    else:
        raised(document, rng)
