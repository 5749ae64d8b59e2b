"""Whether a statement about a problem of the library is false, by its known optimum."""

from __future__ import annotations

from collections.abc import Iterator
from fractions import Fraction

import numpy as np

from benchmarks.frontier.analytic import TOLERANCE, judged, table
from relaxations.library import NamedProblem, load, names
from relaxations.problem.problem import PolynomialProblem
from relaxations.search.minimum import Minimum, minimise

KNOWN = 1e-6  # of the optimum's magnitude: the optima of the library are known to about seven digits
REACH = 10.0  # box of the library's variables that have none
SECONDS = 60.0  # a problem


def boxed(case: NamedProblem) -> PolynomialProblem | None:
    """Return a problem of the library in a box of 10 where it has none; None where no known minimiser lies inside."""
    problem = case.problem
    if case.is_bounded:
        return problem
    lower, upper = np.maximum(problem.lower, -REACH), np.minimum(problem.upper, REACH)
    inside = any(((lower <= p) & (p <= upper)).all() for p in map(np.array, case.minimisers))
    return problem.with_box(lower, upper) if inside else None


def run() -> str:
    """Return the table as Markdown."""
    cases = [(name, case, in_box) for name in names() if (in_box := boxed(case := load(name))) is not None]
    head = (
        f"`relaxations.search.minimise` solves {len(cases)} of the {len(names())} named problems with a tolerance of "
        f"{TOLERANCE:g}, in at most {SECONDS:g} s each. A variable without a box gets a box of {REACH:g}. The other "
        "problems have no known minimiser in such a box."
    )
    return "\n".join(["## Named problems: whether a statement is false", "", head, table(_judged(cases))])


def _judged(
    cases: list[tuple[str, NamedProblem, PolynomialProblem]],
) -> Iterator[tuple[str, str, Minimum, tuple[str, ...]]]:
    for name, case, problem in cases:
        found = minimise(problem, case.objective, tolerance=TOLERANCE, seconds=SECONDS)
        slack = Fraction(KNOWN) * max(Fraction(1), abs(Fraction(case.optimum)))
        yield "named problems", name, found, judged(found, Fraction(case.optimum), slack)
