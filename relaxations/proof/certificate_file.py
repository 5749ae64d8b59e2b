"""Write proofs to files that :mod:`relaxations.check` proves again, with its own arithmetic and code.

Every row of a relaxation is recognised (:mod:`relaxations.points.recognition`) and written as a product of
constraints of the problem as the file states it. A row that is no such product is refused: it could not be checked.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from relaxations import check
from relaxations.check import bundle
from relaxations.check.runs.read import is_run
from relaxations.errors import ProblemError
from relaxations.problem.problem import PolynomialProblem
from relaxations.problem.statement import listed, statement
from relaxations.proof.file_places import Places
from relaxations.proof.file_steps import written_step
from relaxations.proof.proof_steps import Fixed, Hull, Kinks, Quotient, Reach, Sides, Step
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
    places = Places(problem, {name: k for k, name in enumerate(problem.names)}, [], kinks)
    written = [written_step(step, places) for step in _until_empty(steps)]
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


def _until_empty(steps: Sequence[Step]) -> Sequence[Step]:
    """Leave out the steps after a proof that no point is feasible: their boxes are arbitrary."""
    for number, step in enumerate(steps, start=1):
        if isinstance(step, Reach | Quotient | Sides | Fixed | Hull):
            continue
        if step.bound > 0 and not step.objective.coefficients.magnitude().any():
            return steps[:number]
    return steps


def _kinks(kinks: Kinks) -> list[dict[str, Any]]:
    members = zip(kinks.variables.tolist(), kinks.signs.tolist(), listed(kinks.arguments), strict=True)
    return [
        {"variable": variable, "kind": "sign" if sign else "positive part", "argument": argument}
        for variable, sign, argument in members
    ]
