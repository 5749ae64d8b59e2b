"""Polynomial problems with known optima, by name: for tests, documentation and benchmarks.

``problems.json`` contains the problems as Python expressions, with the source of each and the verification of its
optimum. Decimals are exact fractions. Some problems are difficult on purpose: no certificate exists (``motzkin``,
``robinson``), the minimum is not attained (``not_attained``), or solvers report wrong bounds (``gms_Bex9_2_6``,
``waki_strange``). Many have variables without bounds.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from fractions import Fraction
from functools import cache
from importlib.resources import files
from typing import Any

from relaxations.algebra.polynomial import Polynomials
from relaxations.errors import ProblemError
from relaxations.formats.expressions import Constraint, stated_problem, variables
from relaxations.formats.text import parse
from relaxations.problem.problem import PolynomialProblem

__all__ = ["NamedProblem", "load", "names"]


@dataclass(frozen=True)
class NamedProblem:
    """A problem with its known optimum.

    Parameters
    ----------
    problem
        As stated in its source; no bounds are derived.
    objective
        To be minimised.
    optimum
        The known minimum (or infimum), to the digits of its source and verification.
    minimisers
        Known minimisers, possibly not all.
    order
        Order of the relaxation that reaches the optimum; None if no order does, or none is known.
    order_is
        Source of the order.
    """

    name: str
    problem: PolynomialProblem
    objective: Polynomials
    optimum: float
    minimisers: tuple[tuple[float, ...], ...]
    order: int | None
    order_is: str | None
    source: str
    verification: str
    notes: str

    @property
    def is_bounded(self) -> bool:
        """Return whether every variable has finite bounds, which a certificate needs."""
        return not self.problem.unbounded


@cache
def _entries() -> dict[str, dict[str, Any]]:
    """Return the entries of ``problems.json`` by name."""
    text = files("relaxations.library").joinpath("problems.json").read_text(encoding="utf-8")
    return {entry["name"]: entry for entry in json.loads(text)}


def names() -> tuple[str, ...]:
    """Return the names of all problems.

    Examples
    --------
    >>> "motzkin" in names()
    True
    """
    return tuple(_entries())


def load(name: str) -> NamedProblem:
    """Return a problem by its name.

    Raises
    ------
    ProblemError
        When the library has no problem of this name.

    Examples
    --------
    >>> found = load("gms_st_e01")
    >>> found.problem.n_variables, found.objective.degree, found.optimum
    (2, 1, -6.6666667)
    """
    if name not in _entries():
        raise ProblemError(f"the library holds no problem {name!r}: relaxations.library.names() lists them")
    return _problem(name)


@cache
def _problem(name: str) -> NamedProblem:
    entry = _entries()[name]
    own = dict(zip(entry["variables"], variables(" ".join(entry["variables"])), strict=True))
    problem, objective = stated_problem(
        parse(entry["objective"], own),
        [Constraint(parse(text, own), equality=True) for text in entry["equalities"]]
        + [Constraint(parse(text, own), equality=False) for text in entry["inequalities"]],
        {v: (_end(entry["bounds"][v][0]), _end(entry["bounds"][v][1])) for v in entry["variables"]},
    )
    return NamedProblem(
        name,
        problem,
        objective,
        float(entry["optimum"]),
        tuple(tuple(float(value) for value in point) for point in entry["minimizers"]),
        entry["order"],
        entry["order_is"],
        entry["source"],
        entry["verification"],
        entry["notes"],
    )


def _end(value: float | None) -> Fraction | None:
    """Return a bound as the exact decimal that the file contains."""
    return None if value is None else Fraction(repr(value))
