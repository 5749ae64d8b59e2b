"""Problems whose minimum is known in fractions: whether a statement is false, and whether a point is feasible."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from fractions import Fraction
from math import prod

import numpy as np

from benchmarks.frontier.analytic_problems import AnalyticProblem, problems
from relaxations.algebra.polynomial import Polynomials
from relaxations.formats.expressions import problem_of
from relaxations.problem.problem import PolynomialProblem
from relaxations.search.minimum import Minimum, MinimumReason, minimise

TOLERANCE = 1e-6
ROUNDED = Fraction(1, 10**12)  # of the sum of a constraint's terms: a point is printed in floats


@dataclass(frozen=True)
class Verdict:
    """What a result says, and what of it is false."""

    reason: MinimumReason
    false: tuple[str, ...]
    seconds: float


def judged(found: Minimum, minimum: Fraction | None, slack: Fraction = Fraction(0)) -> tuple[str, ...]:
    """Return what is false in a result; ``minimum`` is None where the set is empty, and known to within ``slack``."""
    false = []
    if found.reason is MinimumReason.TIGHT and not (
        found.points and found.upper - found.lower <= TOLERANCE * max(1.0, abs(found.upper))
    ):
        false.append("tight without a verified point within the tolerance")
    if minimum is None:
        false += ["a verified point of an empty set"] if found.points else []
        return tuple(false)
    if found.reason is MinimumReason.EMPTY or found.lower == np.inf:
        return (*false, "a set with a point called empty")
    if np.isfinite(found.lower) and Fraction(found.lower) > minimum + slack:
        false.append(f"lower end {found.lower!r} above the minimum")
    if np.isfinite(found.upper) and Fraction(found.upper) < minimum - slack:
        false.append(f"value {found.upper!r} at a verified point below the minimum")
    false += ["a verified point is not feasible" for point in found.points if not feasible(found.problem, point)]
    return tuple(false)


def feasible(problem: PolynomialProblem, point: np.ndarray) -> bool:
    """Return whether the constraints hold at a point in fractions, but for the last digits that floats lose."""
    exact = [Fraction(x) for x in point.tolist()]
    inside = all(low <= x <= high for x, low, high in zip(point.tolist(), problem.lower, problem.upper, strict=True))
    equal, least = _values(problem.equalities, exact), _values(problem.inequalities, exact)
    return (
        inside and all(abs(v) <= ROUNDED * size for v, size in equal) and all(v >= -ROUNDED * size for v, size in least)
    )


def _values(polynomials: Polynomials, exact: list[Fraction]) -> Iterable[tuple[Fraction, Fraction]]:
    """Yield the value of each member, and the sum of its terms' magnitudes or one."""
    for row in polynomials.terms():
        terms = [Fraction(mid) * prod((exact[v] for v in factor), start=Fraction(1)) for mid, _, factor in row]
        yield sum(terms, Fraction(0)), max(sum(map(abs, terms), Fraction(0)), Fraction(1))


def table(judgements: Iterable[tuple[str, str, Minimum, tuple[str, ...]]]) -> str:
    """Return what is decided and what is false by kinds, of (kind, name, result, what is false of it), as Markdown."""
    verdicts: dict[str, list[Verdict]] = {}
    wrong: list[str] = []
    for kind, name, found, false in judgements:
        verdicts.setdefault(kind, []).append(Verdict(found.reason, false, found.seconds))
        wrong.extend(f"{kind}, {name}: {text}" for text in false)
        print(f"{kind}, {name}: {found.reason.name.lower()}, {found.seconds:.1f} s {'; '.join(false)}", flush=True)
    rows = [*verdicts.items(), ("all", [v for found in verdicts.values() for v in found])]
    return "\n".join(
        [
            "",
            "A result is false if one of these holds:",
            "",
            "- a lower end is above the minimum;",
            "- a value at a verified point is below the minimum;",
            "- a set with a point is called empty;",
            "- a verified point violates a constraint, in fractions;",
            "- the result is `tight` without a verified point within the tolerance.",
            "",
            "An empty set is decided if it is proven empty. Any other set is decided if the result is tight.",
            "",
            "| kind | problems | decided | no verified point | gap left | time used up | false | s |",
            "|---|---|---|---|---|---|---|---|",
            *(_row(kind, found) for kind, found in rows),
            "",
            f"False statements: {len(wrong)}. {'; '.join(wrong)}".strip(),
        ]
    )


def run() -> str:
    """Return the table as Markdown."""
    cases = problems()
    head = (
        f"`relaxations.search.minimise` solves {len(cases)} problems from `benchmarks/frontier/analytic_problems.py` "
        f"with a tolerance of {TOLERANCE:g}. The minimum of each problem, or its emptiness, is known in fractions."
    )
    return "\n".join(["## Problems whose minimum is known in fractions", "", head, table(map(_judged, cases))])


def _judged(case: AnalyticProblem) -> tuple[str, str, Minimum, tuple[str, ...]]:
    found = minimise(*problem_of(case.objective, case.constraints), tolerance=TOLERANCE)
    return case.kind, case.name, found, judged(found, case.minimum)


def _row(kind: str, verdicts: list[Verdict]) -> str:
    counts = [
        sum(v.reason in reasons for v in verdicts)
        for reasons in (
            (MinimumReason.TIGHT, MinimumReason.EMPTY),
            (MinimumReason.UNVERIFIED,),
            (MinimumReason.ORDERS,),
            (MinimumReason.TIME,),
        )
    ]
    numbers = [len(verdicts), *counts, sum(bool(v.false) for v in verdicts)]
    return f"| {kind} | {' | '.join(map(str, numbers))} | {sum(v.seconds for v in verdicts):.1f} |"
