"""Where the variables and rows of a step's problem stand among those of a certificate file."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from relaxations.algebra.arrays import Array
from relaxations.algebra.polynomial import Polynomials
from relaxations.errors import ProblemError
from relaxations.problem.problem import PolynomialProblem
from relaxations.problem.statement import listed
from relaxations.proof.proof_steps import Kinks, Reach
from relaxations.writing import hexadecimal


@dataclass(frozen=True)
class Place:
    """The numbers of a step's variables and rows among those of the file."""

    n_variables: int
    variables: list[int]
    equalities: list[int]
    inequalities: list[int]

    def monomial(self, m: Sequence[int]) -> list[int]:
        """Return a monomial with the numbers of the file."""
        return [self.variables[v] for v in m]

    def objective(self, polynomials: Polynomials) -> list[list[Any]]:
        """Return the terms of an objective with the numbers of the file."""
        return [[mid, rad, self.monomial(m)] for mid, rad, m in listed(polynomials)[0]]


class Places:
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
        self._found: dict[tuple[int, int, tuple[str, ...]], Place] = {}
        self.cuts = cuts
        self._numbers: dict[tuple[int, bytes], int] = {}
        self._kinks = kinks
        self._kink_of = {} if kinks is None else {v: n for n, v in enumerate(kinks.variables.tolist())}

    def on(self, problem: PolynomialProblem) -> Places:
        """Return the places among the rows of a problem with decided kinks."""
        return Places(problem, self._variables, self.cuts, self._kinks)

    def variable(self, name: str) -> int:
        """Return the number of a variable in the file."""
        return self._variables[name]

    def kink(self, variable: int) -> int:
        """Return the number of a kink in the file."""
        return self._kink_of[variable]

    def of(self, problem: PolynomialProblem) -> Place:
        """Return the place of a problem.

        Raises
        ------
        ProblemError
            When it has a variable or a row that the file has not.
        """
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
            self._found[known] = Place(len(self._variables), variables, *rows)
        return self._found[known]

    def number_of_cut(self, place: Place, multipliers: Array) -> int:
        """Return the number of a cut in the file; many steps share one."""
        known = id(place), multipliers.tobytes()
        if known not in self._numbers:
            self._numbers[known] = len(self.cuts)
            parts = np.split(multipliers, [len(place.equalities)])
            kinds = {"equalities": (place.equalities, parts[0]), "inequalities": (place.inequalities, parts[1])}
            self.cuts.append(
                {
                    kind: [[rows[k], hexadecimal(own[k])] for k in np.flatnonzero(own)]
                    for kind, (rows, own) in kinds.items()
                }
            )
        return self._numbers[known]

    def add_cone(self, reach: Reach) -> None:
        """Add the rows times s, which the check makes in the same order."""
        place, s = self.of(reach.problem), len(self._variables)
        first = self._stated.inequalities.n_rows
        self._found[_known(reach.cone)] = Place(
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
