"""Where things stand in a certificate file: its steps, rows, claims and numbers."""

from __future__ import annotations

import json
import random
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

__all__ = [
    "Place",
    "bounds",
    "claims",
    "copied",
    "monomials",
    "polynomials",
    "put_numbers",
    "step_lists",
    "steps",
    "terms",
]

Node = Any  # what JSON holds


@dataclass(frozen=True)
class Place:
    """One entry of a list or object."""

    holder: Any
    key: Any

    @property
    def value(self) -> Any:
        """Return what stands there."""
        return self.holder[self.key]

    def put(self, value: Any) -> None:
        """Put something else there."""
        self.holder[self.key] = value


def copied(node: Node) -> Node:
    """Return a copy: what stood twice in a document, or in itself, would change twice or never end."""
    return json.loads(json.dumps(node))


def holders(step: Node) -> list[Node]:
    """Return the objects in a step that hold steps of their own."""
    if not isinstance(step, dict):
        return []
    reach = step.get("reach")
    faces = reach.get("faces", []) if isinstance(reach, dict) else []
    inner = [step, *_listed(step.get("parts")), *_listed(faces)]
    return [holder for holder in inner if isinstance(holder, dict) and isinstance(holder.get("steps"), list)]


def step_lists(document: Node) -> Iterator[list[Node]]:
    """Yield each list of steps, what is outside first."""
    waiting = [document["steps"]] if isinstance(document.get("steps"), list) else []
    while waiting:
        own = waiting.pop(0)
        yield own
        waiting += [holder["steps"] for step in own for holder in holders(step)]


def steps(document: Node) -> list[Place]:
    """Return all steps."""
    return [Place(own, k) for own in step_lists(document) for k, step in enumerate(own) if isinstance(step, dict)]


def bounds(document: Node) -> list[Node]:
    """Return the steps with multipliers of their own."""
    return [place.value for place in steps(document) if isinstance(place.value.get("products"), list)]


def claims(document: Node) -> list[Node]:
    """Return the steps that claim a bound."""
    return [place.value for place in steps(document) if "bound" in place.value]


def polynomials(document: Node) -> list[Place]:
    """Return all rows, arguments of kinks and objectives."""
    rows = [Place(document[kind], k) for kind in ("equalities", "inequalities") for k in range(len(document[kind]))]
    arguments = [Place(kink, "argument") for kink in _listed(document.get("kinks"))]
    return rows + arguments + [Place(claim, "objective") for claim in claims(document)]


def terms(document: Node, rng: random.Random) -> list[list[Node]]:
    """Return the terms of one polynomial."""
    return [term for term in _listed(rng.choice(polynomials(document)).value) if isinstance(term, list)]


def monomials(document: Node, rng: random.Random) -> list[Place]:
    """Return the monomials of one polynomial, multiplier or basis."""
    found = [Place(term, 2) for term in terms(document, rng) if len(term) == 3]
    own = bounds(document)
    if own and rng.random() < 0.5:
        step = rng.choice(own)
        found += [Place(term, 1) for _, multiplier in step["equalities"] for term in multiplier]
        found += [Place(product["basis"], k) for product in step["products"] for k in range(len(product["basis"]))]
    return [place for place in found if isinstance(place.value, list)]


def put_numbers(document: Node, rng: random.Random, change: Callable[[Any], Any]) -> bool:
    """Change one number of a kind that is drawn first, so that factors do not take all."""
    found = _numbers(document, rng)
    if not found:
        return False
    place = rng.choice(found)
    place.put(change(place.value))
    return True


def _numbers(document: Node, rng: random.Random) -> list[Place]:
    own, everything = bounds(document), steps(document)
    kind = rng.choice(["box", "terms", "terms", "bound", "centre", "scale", "factor", "multiplier", "weight", "other"])
    if kind == "box":
        return [Place(pair, k) for pair in document["box"] for k in (0, 1)]
    if kind == "terms":
        return [Place(term, 0) for term in terms(document, rng)]
    if kind == "bound":
        return [Place(claim, "bound") for claim in claims(document)]
    if kind == "other":
        found = [Place(part["box"], k) for s in everything for part in _listed(s.value.get("parts")) if "box" in part
                 for k in (0, 1)]  # fmt: skip
        found += [Place(row, k) for s in everything for row in _listed(s.value.get("rows")) for k in range(2, len(row))]
        found += [Place(pair, 1) for s in everything for pair in _listed(s.value.get("weights"))]
        found += [Place(pair, 1) for cut in _listed(document.get("cuts")) for rows in cut.values() for pair in rows]
        reaches = [s.value["reach"] for s in everything if "reach" in s.value]
        return found + [Place(pair, 1) for reach in reaches for pair in reach["variables"]]
    if not own:
        return []
    step = rng.choice(own)
    if kind in ("centre", "scale"):
        return [Place(step[kind], k) for k in range(len(step[kind]))]
    if kind == "multiplier":
        return [Place(term, 0) for _, multiplier in step["equalities"] for term in multiplier]
    products = step["products"]
    if kind == "weight":
        return [Place(product, "weight") for product in products]
    rows = [row for product in products for row in product["factor"]]
    return [Place(row, k) for row in rng.sample(rows, min(len(rows), 3)) for k in range(len(row))]


def _listed(value: Any) -> list[Any]:
    return value if isinstance(value, list) else []
