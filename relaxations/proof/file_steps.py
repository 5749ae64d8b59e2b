"""Each step of a proof as JSON, with the numbers of its variables and rows in the file."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from relaxations.algebra.arrays import Array
from relaxations.errors import ProblemError
from relaxations.points.recognition import equality_multipliers, product_multipliers
from relaxations.problem.statement import listed
from relaxations.proof.file_places import Place, Places
from relaxations.proof.proof_steps import (
    Bound,
    Branches,
    Consequence,
    Cut,
    Fixed,
    Hull,
    Level,
    Part,
    Quotient,
    Reach,
    Sides,
    Step,
)
from relaxations.writing import hexadecimal


def written_step(step: Step, places: Places) -> dict[str, Any]:
    """Return a step as the file holds it."""
    if isinstance(step, Reach):
        return _reach(step, places)
    if isinstance(step, Quotient):
        place = places.of(step.problem)
        return {"quotient": {"equality": place.equalities[step.equality], "variable": place.variables[step.variable]}}
    if isinstance(step, Consequence):
        return _consequence(step, places.of(step.problem))
    if isinstance(step, Branches):
        return _branches(step, places)
    if isinstance(step, Cut):
        return _cut(step, places)
    if isinstance(step, Sides):
        return _sides(step, places)
    if isinstance(step, Fixed):
        return _fixed(step, places)
    if isinstance(step, Level):
        return _level(step, places)
    if isinstance(step, Hull):
        place = places.of(step.problem)
        return {"hull": place.monomial(step.variables.tolist()), "parts": _parts(step.parts, place, places)}
    return _bound(step, places.of(step.relaxed.problem))


def _branches(step: Branches, places: Places) -> dict[str, Any]:
    place = places.of(step.problem)
    document: dict[str, Any] = {
        "objective": place.objective(step.objective),
        "bound": float(step.bound).hex(),
        "parts": _parts(step.parts, place, places),
    }
    if step.product:
        rows = listed(step.problem.equalities)
        vanishing = [k for k, row in enumerate(rows) if len(row) == 1 and set(row[0][2]) == set(step.product)]
        document["equality"] = place.equalities[vanishing[0]]
    return document


def _parts(parts: Sequence[Part], place: Place, places: Places) -> list[dict[str, Any]]:
    """Return the parts of a box or of a kink, with their steps."""
    written = []
    for part in parts:
        variable = place.variables[part.variable]
        where = (
            {"kink": places.kink(variable), "side": part.side}
            if part.side
            else {"variable": variable, "box": [part.lower.hex(), part.upper.hex()]}
        )
        written.append({**where, "steps": [written_step(own, places) for own in part.steps]})
    return written


def _sides(step: Sides, places: Places) -> dict[str, Any]:
    def number(name: str) -> int:
        return places.kink(places.variable(name))

    own = places.on(step.problem)
    return {
        "sides": [[number(name), side] for name, side in step.known],
        "rows": [[row.kind, number(row.kink), *(end.hex() for end in row.ends)] for row in step.rows],
        "defined": [{"equality": k, "variable": places.variable(name)} for k, name in step.defined],
        "steps": [written_step(each, own) for each in step.steps],
    }


def _fixed(step: Fixed, places: Places) -> dict[str, Any]:
    made = step.projected
    place, own = places.of(made.stated), places.on(made.whole)
    return {
        "fixed": [
            {
                "equality": place.equalities[row.equality],
                "sign": row.sign,
                "slack": row.slack.hex(),
                "values": [[place.variables[v], value.hex()] for v, value in row.values],
            }
            for row in made.rows
        ],
        "steps": [written_step(each, own) for each in step.steps],
    }


def _level(step: Level, places: Places) -> dict[str, Any]:
    own = places.on(step.problem)
    return {
        "objective": own.of(step.problem).objective(step.objective),
        "bound": float(step.bound).hex(),
        "level": float(step.level).hex(),
        "steps": [written_step(each, own) for each in step.steps],
    }


def _cut(step: Cut, places: Places) -> dict[str, Any]:
    place = places.of(step.problem)
    return {
        "objective": place.objective(step.objective),
        "bound": float(step.bound).hex(),
        "outer": place.monomial(step.outer.tolist()),
        "weights": [
            [places.number_of_cut(place, own), hexadecimal(weight)]
            for own, weight in zip(step.multipliers, step.weights, strict=True)
        ],
    }


def _reach(step: Reach, places: Places) -> dict[str, Any]:
    place = places.of(step.problem)
    places.add_cone(step)
    loose = zip(place.monomial(step.loose.tolist()), step.scale.tolist(), strict=True)
    document = {
        "variables": [[k, size.hex()] for k, size in loose],
        "riding": place.monomial(step.riding.tolist()),
        "faces": [
            {"variable": place.variables[k], "side": side, "steps": [written_step(own, places) for own in steps]}
            for k, side, steps in step.faces
        ],
    }
    return {"reach": document}


def _consequence(step: Consequence, place: Place) -> dict[str, Any]:
    weight = str(step.weight)
    rows = (place.equalities if step.equality else place.inequalities)[step.row]
    squares = [
        {
            "of": [],
            "weight": str(square.weight),
            "basis": [place.monomial(b) for b in square.basis],
            "factor": [[str(value) for value in line] for line in square.factor],
        }
        for square in step.squares
    ]
    one: dict[str, Any] = {"basis": [[]], "factor": [["1"]]}
    own = {"of": [["inequality", rows]], "weight": weight, **one}
    squares += [
        {"of": [["above" if side > 0 else "below", place.variables[v]]], "weight": str(size), **one}
        for v, side, size in step.ends
    ]
    return {
        "objective": place.objective(step.objective),
        "bound": float(step.bound).hex(),
        **_map(step.centre, step.scale, place),
        "equalities": [[rows, [[weight, []]]]] if step.equality else [],
        "products": squares if step.equality else [own, *squares],
    }


def _map(centre: Array, scale: Array, place: Place) -> dict[str, list[str]]:
    """Return the map ``x = centre + scale t`` of a step over all variables of the file."""
    whole = {"centre": np.zeros(place.n_variables), "scale": np.ones(place.n_variables)}
    whole["centre"][place.variables], whole["scale"][place.variables] = centre, scale
    return {key: [hexadecimal(v) for v in values] for key, values in whole.items()}


def _bound(step: Bound, place: Place) -> dict[str, Any]:
    if not np.isfinite(step.bound):
        raise ProblemError(f"the certificate's bound is {step.bound}: it proves nothing to be written")
    relaxed, relaxation = step.relaxed, step.relaxed.relaxation
    scaled = {
        name: relaxed.scaling.polynomials(family)
        for name, family in (("equality", relaxed.problem.equalities), ("inequality", relaxed.problem.inequalities))
    }
    equalities = equality_multipliers(relaxation, scaled["equality"], step.certificate.multipliers.equalities)
    products = product_multipliers(relaxation, scaled["inequality"], step.certificate.multipliers.factors)
    return {
        "objective": place.objective(step.objective),
        "bound": float(step.bound).hex(),
        **_map(relaxed.scaling.centre, relaxed.scaling.scale, place),
        "equalities": [
            [place.equalities[k], [[value, place.monomial(m)] for value, m in terms]] for k, terms in equalities
        ],
        "products": [
            {
                **product,
                "of": [
                    [kind, (place.inequalities if kind == "inequality" else place.variables)[k]]
                    for kind, k in product["of"]
                ],
                "basis": [place.monomial(b) for b in product["basis"]],
            }
            for product in products
        ],
    }
