"""New steps that state a row itself, so that a rule which gives a wrong row gives a false theorem.

The multiplier of a row g is one and the objective is g, so the arithmetic leaves nothing and the claim is ``g >= 0``.
"""

from __future__ import annotations

import random
from collections.abc import Callable
from typing import Any

from benchmarks.soundness.mutations.places import copied
from benchmarks.soundness.mutations.residual import Polynomial, claimed, stated_view, views

__all__ = ["FRESH"]

Document = dict[str, Any]


def row_stated(document: Document, rng: random.Random) -> None:
    """State a row as some step sees it, with a negative weight now and then."""
    own, template, view = _step(document, rng)
    sign = rng.choice([1, 1, 1, -1])
    kind = "equality" if view.equalities and rng.random() < 0.3 else "inequality"
    rows = view.equalities if kind == "equality" else view.inequalities
    k = rng.randrange(len(rows) - min(3, len(rows)), len(rows)) if rng.random() < 0.6 else rng.randrange(len(rows))
    step = {
        "objective": _listed(rows[k], sign),
        "bound": 0,
        "centre": copied(template["centre"]),
        "scale": copied(template["scale"]),
        "equalities": [[k, [[sign, []]]]] if kind == "equality" else [],
        "products": [] if kind == "equality" else [_constant([["inequality", k]], sign)],
    }
    step["bound"] = claimed(step, view) or 0
    own.insert(rng.randrange(len(own) + 1), step)


def box_stated(document: Document, rng: random.Random) -> None:
    """State an end of the box as a step has it: ``x >= centre - scale``, or the product of two such factors."""
    own, template, view = _step(document, rng)
    step = copied({key: template[key] for key in ("centre", "scale")})
    v, kind = rng.randrange(len(step["centre"])), rng.choice(["above", "below", "inside"])
    sign = -1 if kind == "below" else 1
    objective = [[sign, 0, [v]]] if kind != "inside" else [[-1, 0, [v, v]]]
    factor = _constant([[kind, v]], step["scale"][v] if kind != "inside" else 1)
    step |= {"objective": objective, "bound": 0, "equalities": [], "products": [factor] if rng.random() < 0.7 else []}
    step["bound"] = claimed(step, view) or 0
    own.insert(rng.randrange(len(own) + 1), step)


def nothing_weighed(document: Document, rng: random.Random) -> None:
    """Subtract a square, or a product of no constraint, with a weight below zero."""
    own, template, view = _step(document, rng)
    step = copied(template)
    product = _constant([], rng.choice([-1, "-1/1000", -7]))
    product["basis"] = rng.choice([[[]], [[0]]])
    step["products"] = [product, *(step["products"] if rng.random() < 0.5 else [])]
    if rng.random() < 0.5:
        step["objective"], step["equalities"], step["products"] = [], [], [product]
    step["bound"] = claimed(step, view) or 0
    own.insert(rng.randrange(len(own) + 1), step)


def cut_stated(document: Document, rng: random.Random) -> None:
    """State a row through a cut whose outer variables are some or all of the row's."""
    view = stated_view(document)
    kind = rng.choice([name for name in ("equalities", "inequalities") if document[name]])
    rows = view.equalities if kind == "equalities" else view.inequalities
    k, sign = rng.randrange(len(rows)), rng.choice([1, 1, -1])
    cuts = document.setdefault("cuts", [])
    cuts.append({"equalities": [], "inequalities": [], kind: [[k, sign]]})
    variables = sorted({v for m in rows[k] for v in m})
    outer = [v for v in variables if rng.random() < 0.8]
    left = {m: ball for m, ball in rows[k].items() if set(m) <= set(outer)}
    step = {"objective": _listed(left, sign), "bound": rng.choice(["-1/100", 0, -1]), "outer": outer}
    own = document["steps"]
    own.insert(rng.randrange(len(own) + 1), {**step, "weights": [[len(cuts) - 1, rng.choice([1, 1, -1])]]})


def _step(document: Document, rng: random.Random) -> tuple[list[Any], Any, Any]:
    found = [entry for entry in views(document["steps"], stated_view(document)) if "products" in entry[1]]
    return rng.choice(found)


def _constant(of: list[Any], weight: Any) -> dict[str, Any]:
    return {"of": of, "weight": weight, "basis": [[]], "factor": [[1]]}


def _listed(row: Polynomial, sign: int) -> list[Any]:
    return [[str(sign * mid), 0, list(m)] for m, (mid, _) in row.items()]


FRESH: dict[str, Callable[[Document, random.Random], Any]] = {
    "row stated": row_stated,
    "box stated": box_stated,
    "negative weight of nothing": nothing_weighed,
    "cut stated": cut_stated,
}
