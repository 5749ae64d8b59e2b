"""Write proofs to files that :mod:`relaxations.check` proves again, with its own arithmetic and code.

Every row of a relaxation is recognised (:mod:`relaxations.points.recognition`) and written as a product of
constraints of the problem as the file states it. A row that is no such product is refused: it could not be checked.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from relaxations import check
from relaxations.algebra.arrays import Array
from relaxations.algebra.polynomial import Polynomials
from relaxations.check import bundle
from relaxations.check.runs.read import is_run
from relaxations.errors import ProblemError
from relaxations.points.recognition import equality_multipliers, product_multipliers
from relaxations.problem.problem import PolynomialProblem
from relaxations.problem.statement import listed, statement
from relaxations.proof.proof_steps import (
    Bound,
    Branches,
    Consequence,
    Cut,
    Fixed,
    Hull,
    Kinks,
    Level,
    Part,
    Quotient,
    Reach,
    Sides,
    Step,
)
from relaxations.writing import write_text


def write_certificate(
    path: str | Path,
    problem: PolynomialProblem,
    steps: Sequence[Step],
    kinks: Kinks | None = None,
    origin: Mapping[str, Any] | None = None,
) -> None:
    """Write a proof, once :mod:`relaxations.check` has accepted it.

    Parameters
    ----------
    problem
        As it is stated in the file: its box is what the first step may rest on.
    steps
        In the order in which they were proven (:mod:`relaxations.proof.proof_steps`). Their problems may have a
        smaller box, which the steps before must prove, and fewer variables and rows; those they have are recognised
        by their names.
    kinks
        What some of the variables are beside the constraints.
    origin
        Where the problem comes from, for readers and for programs that compare it with a model and data. JSON without
        decimals.

    Raises
    ------
    ProblemError
        When the steps do not prove what they claim of this problem, or a row of a relaxation is no product of
        constraints.

    Examples
    --------
    >>> import sympy, tempfile
    >>> from relaxations import check
    >>> from relaxations.proof.bounding import relax
    >>> from relaxations.problem.problem import from_sympy
    >>> from relaxations.proof.proof_steps import Bound
    >>> x = sympy.Symbol("x")
    >>> problem, objective = from_sympy(x**2 - x, [], [], [x], {x: (0, 2)})
    >>> relaxed = relax(problem, "dense", 1)
    >>> file = Path(tempfile.mkdtemp()) / "certificate.json"
    >>> write_certificate(file, problem, [Bound.of(relaxed, objective, relaxed.bound(objective))])
    >>> theorem = check.check(check.read(file))[0]
    >>> -0.25 - 1e-6 < theorem.bound <= -0.25
    True
    """
    write_content(path, content_of(problem, steps, kinks, origin))


def content_of(
    problem: PolynomialProblem,
    steps: Sequence[Step],
    kinks: Kinks | None = None,
    origin: Mapping[str, Any] | None = None,
) -> dict[str, Any]:
    """Return the content of a certificate, which is not checked yet; see `write_certificate`."""
    if not steps:
        raise ProblemError("there are no steps: nothing is proven beyond the box")
    places = _Places(problem, {name: k for k, name in enumerate(problem.names)}, [], kinks)
    written = [_step(step, places) for step in _until_empty(steps)]
    return {
        "format": check.FORMAT,
        "version": check.VERSION,
        **({"origin": origin} if origin else {}),
        **statement(problem),
        **({"kinks": _kinks(kinks)} if kinks else {}),
        **({"cuts": places.cuts} if places.cuts else {}),
        "steps": written,
    }


def write_content(path: str | Path, content: Mapping[str, Any]) -> None:
    """Write a certificate or a bundle, once :mod:`relaxations.check` has accepted it.

    A run certificate is written as it is: the checker's own arithmetic made it.

    Raises
    ------
    ProblemError
        When it is refused.
    """
    try:
        if bundle.is_bundle(content):
            bundle.claim_of(bundle.document(content))
        elif not is_run(content):
            check.theorems(content)
    except check.Refused as refusal:
        raise ProblemError(
            f"the steps do not prove what they claim ({refusal}): give each the objective that its certificate was "
            "made for (zero for an empty set), and the steps that contracted the box"
        ) from None
    write_text(path, json.dumps(content, separators=(",", ":")) + "\n")


# ---------------------------------------------------------------- steps


def _until_empty(steps: Sequence[Step]) -> Sequence[Step]:
    """Leave out the steps after a proof that no point is feasible: their boxes are arbitrary."""
    for number, step in enumerate(steps, start=1):
        if isinstance(step, Reach | Quotient | Sides | Fixed | Hull):
            continue
        if step.bound > 0 and not step.objective.coefficients.magnitude().any():
            return steps[:number]
    return steps


@dataclass(frozen=True)
class _Place:
    """The numbers of a step's variables and rows among those of the file."""

    n_variables: int
    variables: list[int]
    equalities: list[int]
    inequalities: list[int]

    def monomial(self, m: Sequence[int]) -> list[int]:
        return [self.variables[v] for v in m]

    def objective(self, polynomials: Polynomials) -> list[list[Any]]:
        return [[mid, rad, self.monomial(m)] for mid, rad, m in listed(polynomials)[0]]


class _Places:
    """Finds the place of each problem by its names and the terms of its rows, once for all that share them."""

    def __init__(
        self,
        stated: PolynomialProblem,
        variables: dict[str, int],
        cuts: list[dict[str, Any]],
        kinks: Kinks | None,
    ) -> None:
        self._stated = stated
        self._variables = variables
        own = [variables[name] for name in stated.names]
        families = (stated.equalities, stated.inequalities)
        self._rows = [{key: k for k, key in enumerate(_keys(family, own))} for family in families]
        self._found: dict[tuple[int, int, tuple[str, ...]], _Place] = {}
        self.cuts = cuts
        self._numbers: dict[tuple[int, bytes], int] = {}
        self._kinks = kinks
        self._kink_of = {} if kinks is None else {v: n for n, v in enumerate(kinks.variables.tolist())}

    def on(self, problem: PolynomialProblem) -> _Places:
        """Return the places among the rows of a problem with decided kinks."""
        return _Places(problem, self._variables, self.cuts, self._kinks)

    def variable(self, name: str) -> int:
        return self._variables[name]

    def kink(self, variable: int) -> int:
        """Return the number of a kink in the file."""
        return self._kink_of[variable]

    def of(self, problem: PolynomialProblem) -> _Place:
        families = (problem.equalities, problem.inequalities)
        known = _known(problem)
        if known not in self._found:
            try:
                variables = [self._variables[name] for name in problem.names]
                rows = [
                    [own[key] for key in _keys(family, variables)]
                    for own, family in zip(self._rows, families, strict=True)
                ]
            except KeyError:
                raise ProblemError(
                    "a step has a variable or constraint that the problem has not: give the problem that the steps "
                    "were proven for"
                ) from None
            self._found[known] = _Place(len(self._variables), variables, *rows)
        return self._found[known]

    def number_of_cut(self, place: _Place, multipliers: Array) -> int:
        """Return the number of a cut in the file; many steps share one."""
        known = id(place), multipliers.tobytes()
        if known not in self._numbers:
            self._numbers[known] = len(self.cuts)
            parts = np.split(multipliers, [len(place.equalities)])
            kinds = {"equalities": (place.equalities, parts[0]), "inequalities": (place.inequalities, parts[1])}
            self.cuts.append(
                {
                    kind: [[rows[k], float(own[k]).hex()] for k in np.flatnonzero(own)]
                    for kind, (rows, own) in kinds.items()
                }
            )
        return self._numbers[known]

    def add_cone(self, reach: Reach) -> None:
        """Add the rows times s, which the check makes in the same order."""
        place, s = self.of(reach.problem), len(self._variables)
        first = self._stated.inequalities.n_rows
        self._found[_known(reach.cone)] = _Place(
            s + 1,
            [*place.variables, s],
            [place.equalities[k] for k in reach.equalities],
            [*(place.inequalities[k] for k in reach.inequalities), *range(first, first + 2 * len(reach.riding))],
        )


def _known(problem: PolynomialProblem) -> tuple[int, int, tuple[str, ...]]:
    return id(problem.equalities), id(problem.inequalities), problem.names


def _keys(family: Polynomials, variables: list[int]) -> list[frozenset[tuple[Any, ...]]]:
    rows = listed(family)
    return [frozenset((mid, rad, tuple(sorted(variables[v] for v in m))) for mid, rad, m in row) for row in rows]


def _step(step: Step, places: _Places) -> dict[str, Any]:
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


def _branches(step: Branches, places: _Places) -> dict[str, Any]:
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


def _parts(parts: Sequence[Part], place: _Place, places: _Places) -> list[dict[str, Any]]:
    """Return the parts of a box or of a kink, with their steps."""
    written = []
    for part in parts:
        variable = place.variables[part.variable]
        where = (
            {"kink": places.kink(variable), "side": part.side}
            if part.side
            else {"variable": variable, "box": [part.lower.hex(), part.upper.hex()]}
        )
        written.append({**where, "steps": [_step(own, places) for own in part.steps]})
    return written


def _kinks(kinks: Kinks) -> list[dict[str, Any]]:
    members = zip(kinks.variables.tolist(), kinks.signs.tolist(), listed(kinks.arguments), strict=True)
    return [
        {"variable": variable, "kind": "sign" if sign else "positive part", "argument": argument}
        for variable, sign, argument in members
    ]


def _sides(step: Sides, places: _Places) -> dict[str, Any]:
    def number(name: str) -> int:
        return places.kink(places.variable(name))

    own = places.on(step.problem)
    return {
        "sides": [[number(name), side] for name, side in step.known],
        "rows": [[row.kind, number(row.kink), *(end.hex() for end in row.ends)] for row in step.rows],
        "defined": [{"equality": k, "variable": places.variable(name)} for k, name in step.defined],
        "steps": [_step(each, own) for each in step.steps],
    }


def _fixed(step: Fixed, places: _Places) -> dict[str, Any]:
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
        "steps": [_step(each, own) for each in step.steps],
    }


def _level(step: Level, places: _Places) -> dict[str, Any]:
    own = places.on(step.problem)
    return {
        "objective": own.of(step.problem).objective(step.objective),
        "bound": float(step.bound).hex(),
        "level": float(step.level).hex(),
        "steps": [_step(each, own) for each in step.steps],
    }


def _cut(step: Cut, places: _Places) -> dict[str, Any]:
    place = places.of(step.problem)
    return {
        "objective": place.objective(step.objective),
        "bound": float(step.bound).hex(),
        "outer": place.monomial(step.outer.tolist()),
        "weights": [
            [places.number_of_cut(place, own), float(weight).hex()]
            for own, weight in zip(step.multipliers, step.weights, strict=True)
        ],
    }


def _reach(step: Reach, places: _Places) -> dict[str, Any]:
    place = places.of(step.problem)
    places.add_cone(step)
    loose = zip(place.monomial(step.loose.tolist()), step.scale.tolist(), strict=True)
    document = {
        "variables": [[k, size.hex()] for k, size in loose],
        "riding": place.monomial(step.riding.tolist()),
        "faces": [
            {"variable": place.variables[k], "side": side, "steps": [_step(own, places) for own in steps]}
            for k, side, steps in step.faces
        ],
    }
    return {"reach": document}


def _consequence(step: Consequence, place: _Place) -> dict[str, Any]:
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


def _map(centre: Array, scale: Array, place: _Place) -> dict[str, list[str]]:
    """Return the map ``x = centre + scale t`` of a step over all variables of the file."""
    whole = {"centre": np.zeros(place.n_variables), "scale": np.ones(place.n_variables)}
    whole["centre"][place.variables], whole["scale"][place.variables] = centre, scale
    return {key: [float(v).hex() for v in values] for key, values in whole.items()}


def _bound(step: Bound, place: _Place) -> dict[str, Any]:
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
