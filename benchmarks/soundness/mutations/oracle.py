"""Judge accepted claims by feasible points of the changed problem, decided in fractions."""

from __future__ import annotations

import random
from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

from benchmarks.soundness.mutations.exact import Point, Stated, Terms, is_feasible, range_at, stated, theorem_terms
from benchmarks.soundness.mutations.library import Genuine, points_of
from benchmarks.soundness.mutations.points import Plan, repaired, sampled

__all__ = ["Judged", "judge"]

ATTACKED = 3  # claims for which a local search looks for a counterexample
SAMPLES = 12


@dataclass(frozen=True)
class Judged:
    """What the oracle says of an accepted file.

    Parameters
    ----------
    points : int
        Feasible points that it had.
    false : str
        The claim that a feasible point refutes, with the point; empty where there is none.
    """

    points: int
    false: str = ""


def judge(document: Any, theorems: Sequence[Any], sources: Sequence[Genuine], rng: random.Random) -> Judged:
    """Hold every theorem against feasible points of the statement.

    Parameters
    ----------
    document : object
        An accepted file's content.
    theorems : sequence
        Each with ``objective``, ``bound`` and ``empty``.
    sources : sequence of Genuine
        The files that it was made of: their points are the first guesses.
    rng : random.Random
    """
    own = stated(document)
    claims = [Claim.of(theorem) for theorem in theorems]
    guesses = _guesses(own, sources, rng)
    points = [list(guess) for guess in guesses if is_feasible(own, guess)]
    if len(points) < len(guesses):  # the statement was changed, or the set was empty
        points += _repaired(own, guesses, rng)
    false = _refuted(claims, points)
    if false or (points and len(points) == len(guesses) and _all_known(claims, sources)):
        return Judged(len(points), false)
    tight = sorted(claims, key=lambda claim: claim.slack(points))[:ATTACKED]
    goals = [claim.objective for claim in tight if not claim.is_empty]
    points = points_of(own, goals, points or guesses[:3], rng, starts=1)
    return Judged(len(points), _refuted(claims, points))


@dataclass(frozen=True)
class Claim:
    """``objective >= bound`` on the feasible set; nothing is feasible where the set is claimed empty."""

    objective: Terms
    bound: Fraction
    is_empty: bool

    @staticmethod
    def of(theorem: Any) -> Claim:
        """Read a theorem of the checker."""
        terms = theorem_terms(theorem.objective.mid, theorem.objective.rad)
        return Claim(terms, theorem.bound, theorem.empty)

    def excludes(self, point: Point) -> bool:
        """Say whether the claim is false at a feasible point, for all choices of the objective's coefficients."""
        return self.is_empty or range_at(self.objective, point)[1] < self.bound

    def slack(self, points: Sequence[Point]) -> Fraction:
        """Return how far the least value lies above the bound, over the points."""
        return min((range_at(self.objective, point)[1] for point in points), default=Fraction(0)) - self.bound


def _guesses(own: Stated, sources: Sequence[Genuine], rng: random.Random) -> list[list[Fraction]]:
    """Return points of the sources, one beside the other where two are joined."""
    if not sources:
        return []
    first = sources[0].guesses
    if len(sources) == 1:
        found = first
    else:
        other = sources[1].guesses
        found = [[*rng.choice(first), *rng.choice(other)] for _ in range(8)] if first and other else []
    return [point for point in found if len(point) == len(own.box)]


def _repaired(own: Stated, guesses: Sequence[Point], rng: random.Random) -> list[list[Fraction]]:
    found = []
    plans = [Plan.of(own), Plan.of(own, rng)]
    chosen = rng.sample(list(guesses), min(len(guesses), 6))
    for guess in [*chosen, *(sampled(own, rng) for _ in range(SAMPLES))]:
        for plan in plans:
            good = repaired(own, plan, guess)
            if good is not None:
                found.append(good)
                break
    return found


def _all_known(claims: Sequence[Claim], sources: Sequence[Genuine]) -> bool:
    """Say whether the points of the sources were made for these objectives: they lie at their least values."""
    known = [objective for source in sources for objective in source.objectives]
    return all(sorted(claim.objective) in known for claim in claims)


def _refuted(claims: Sequence[Claim], points: Sequence[Point]) -> str:
    for point in points:
        for claim in claims:
            if claim.excludes(point):
                value = "empty" if claim.is_empty else f"{_written(claim.objective)} >= {_short(claim.bound)}"
                return f"{value} is false at ({', '.join(map(_short, point))})"[:1000]
    return ""


def _written(terms: Terms) -> str:
    return " + ".join(f"{_short(mid)} {''.join(f'x{v} ' for v in m)}".strip() for mid, _, m in terms[:6]) or "0"


def _short(value: Fraction) -> str:
    try:
        return f"{float(value):.12g}"
    except OverflowError:
        return "huge"
