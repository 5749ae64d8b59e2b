"""The genuine files, kept in the cache, each with feasible points close to the least value of what it proves."""

from __future__ import annotations

import hashlib
import json
import random
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from typing import Any

from benchmarks.soundness.mutations import identified, small_proofs
from benchmarks.soundness.mutations.exact import Point, Stated, Terms, is_feasible, stated, theorem_terms
from benchmarks.soundness.mutations.points import Plan, minimised, mixed, repaired, sampled
from relaxations import check

__all__ = ["RECIPES", "Genuine", "library", "points_of"]

RECIPES = small_proofs.RECIPES | identified.RECIPES  # name to a function that writes the file
MOST_POINTS = 14


@dataclass(frozen=True)
class Genuine:
    """A file that is accepted.

    Parameters
    ----------
    name : str
    text : str
    guesses : list of Point
        Feasible points where the set has any; else points of the box.
    objectives : list of Terms
        What the file bounds, each sorted: some of the points lie close to its least value.
    """

    name: str
    text: str
    guesses: list[list[Fraction]]
    objectives: list[Terms]

    def document(self) -> Any:
        """Return a fresh copy of the content."""
        return json.loads(self.text)


def library(folder: Path, names: Sequence[str] = tuple(RECIPES)) -> list[Genuine]:
    """Return the genuine files; what is not in the folder is made.

    Parameters
    ----------
    folder : Path
    names : sequence of str
    """
    folder.mkdir(parents=True, exist_ok=True)
    found = []
    for name in names:
        path = folder / f"{name.replace(' ', '_').replace(',', '')}.json"
        points = path.with_suffix(".points")
        if not points.exists():
            truth = RECIPES[name](path)
            listed = _guesses(check.read(path), truth)
            points.write_text(json.dumps([[str(value) for value in point] for point in listed]), encoding="utf-8")
        kept = json.loads(points.read_text(encoding="utf-8"))
        guesses = [[Fraction(value) for value in point] for point in kept]
        objectives = [sorted(_objective(theorem)) for theorem in check.check(check.read(path))]
        found.append(Genuine(name, path.read_text(encoding="utf-8"), guesses, objectives))
    return found


def digest(genuine: Iterable[Genuine]) -> str:
    """Return a fingerprint of the files and of the checker, on which a result depends."""
    found = hashlib.sha256()
    for one in genuine:
        found.update(one.text.encode())
    kernel = Path(check.__file__)
    for source in sorted(kernel.parent.rglob("*.py")) if kernel.name == "__init__.py" else [kernel]:
        found.update(source.read_bytes())
    return found.hexdigest()[:16]


def _guesses(document: Any, truth: Sequence[float]) -> list[list[Fraction]]:
    theorems, own = check.check(document), stated(document)
    objectives = [_objective(theorem) for theorem in theorems]
    rng = random.Random(0)
    known = []
    if truth:  # of the parameters; noise is first none, then any
        first = [Fraction(value) for value in truth]
        rest = [[Fraction(0)] * len(own.box), *(sampled(own, rng) for _ in range(300))]
        known = [[*first, *point[len(first) :]] for point in rest]
    found = points_of(own, objectives, known, rng, starts=6)
    if any(theorem.empty for theorem in theorems):
        assert not found, "a set that is proven empty has a point"
        return [sampled(own, rng) for _ in range(4)]
    return found


def _objective(theorem: Any) -> Terms:
    return theorem_terms(theorem.objective.mid, theorem.objective.rad)


def points_of(
    own: Stated, objectives: Iterable[Terms], known: Sequence[Point], rng: random.Random, starts: int
) -> list[list[Fraction]]:
    """Return feasible points, those with small values of the objectives among them.

    Parameters
    ----------
    own : Stated
    objectives : iterable of Terms
    known : sequence of Point
        Guesses; they need not be feasible.
    rng : random.Random
    starts : int
        Of the local search, for each objective, and random guesses beside.
    """
    inner: list[list[Fraction]] = []
    steady = Plan.of(own)
    for guess in [*known, *(sampled(own, rng) for _ in range(3 * starts))]:
        if len(guess) == len(own.box):
            good = list(guess) if is_feasible(own, guess) else repaired(own, steady, guess)
            good = good or repaired(own, Plan.of(own, rng), guess)
            if good is not None and good not in inner:
                inner.append(good)
    found: list[list[Fraction]] = inner[:4]
    goals = list(objectives)
    for number in range(starts if found else 2 * starts):
        plan = Plan.of(own, rng) if number % 3 else steady
        if not inner:  # no objective: only the constraints count
            start = rng.choice(list(known)) if known and number % 2 else sampled(own, rng)
            if len(start) == len(own.box):
                least = minimised(own, plan, [], _floats(start), margin=1e-7)
                inner += mixed(own, plan, least, []) if least else []
                found += inner[:1]
            continue
        for goal in goals:
            if len(found) >= MOST_POINTS:
                break
            least = minimised(
                own, plan, goal, _floats(sampled(own, rng) if number % 3 == 1 else rng.choice([*inner, *found]))
            )
            if least:
                nearest = mixed(own, plan, least, [rng.choice(inner), rng.choice([*inner, *found])])
                found += [point for point in nearest if point not in found]
    return found


def _floats(point: Point) -> list[float]:
    return [max(-1e9, min(1e9, float(value))) for value in point]
