"""Genuine certificates of problems in two to four variables, one for each kind of step and relaxation.

Most coefficients are rational numbers that no float holds, so that the files hold balls with a radius.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import sympy

from relaxations import check
from relaxations.algebra.polynomial import Polynomials
from relaxations.problem.problem import PolynomialProblem, from_sympy, polynomials_from_sympy
from relaxations.proof.bounding import relax
from relaxations.proof.certificate_file import write_certificate
from relaxations.proof.proof_steps import Bound, Cut, Hull, Kinks, Part, Quotient, Row, Sides, Step
from relaxations.search.boxes import derive_box
from relaxations.search.branching import branch_and_bound
from relaxations.search.hierarchy import intervals

__all__ = ["RECIPES"]

x, y, z, w, v = sympy.symbols("x y z w v")
R = sympy.Rational
Proof = tuple[Any, ...]  # problem, steps and, where there are any, kinks


def bounded(problem: PolynomialProblem, objective: Polynomials, method: str, order: int) -> Proof:
    relaxed = relax(problem, method, order, objective=objective)
    return problem, [Bound.of(relaxed, objective, relaxed.bound(objective))]


def quadratic(method: str) -> Proof:
    box = {x: (-1, 2), y: (-2, 1)}
    return bounded(*from_sympy(x * y + y**2 / 3 - x / 7, [1 - x**2 - y**2, x - y / 9], [], [x, y], box), method, 2)


def cubic(method: str) -> Proof:
    box = {x: (-1, 2), y: (-2, 1)}
    return bounded(*from_sympy(y - 2 * x, [x * y + R(1, 7)], [x**3 - y], [x, y], box), method, 2)


def chain() -> Proof:
    """Return a problem whose variables form a chain, for cliques."""
    box = dict.fromkeys((x, y, z, w), (-1, 1))
    goal = x * y + y * z + z * w - w / 3
    problem, objective = from_sympy(goal, [1 - x**2 - y**2, 1 - z**2 - w**2 / 2], [], [x, y, z, w], box)
    return bounded(problem, objective, "chordal", 1)


def nothing(method: str) -> Proof:
    box = {x: (-2, 2), y: (-1, 3)}
    problem, _ = from_sympy(None, [R(3, 2) - x**2 - y**2], [x + y - 2], [x, y], box)
    return bounded(problem, Polynomials.from_terms([{}]), method, 1)


def product(method: str, order: int = 1) -> Proof:
    """Return the range of x where x y is given: the lift and its products."""
    problem, _ = from_sympy(None, [x - y / 3], [x * y - R(1, 3), y + z - R(4, 3)], [x, y, z], unit(x, y, z, top=2))
    steps: list[Step] = []
    intervals(problem, [0, 1], method=method, order=order, rounds=2, record=steps.append)
    return problem, steps


def unit(*symbols: sympy.Symbol, top: int = 1) -> dict[sympy.Symbol, tuple[int, int]]:
    return dict.fromkeys(symbols, (0, top))


def contradiction() -> Proof:
    """Return two bounds of y that leave nothing between them."""
    problem, _ = from_sympy(None, [y - x / 10, -y - x / 10 - R(1, 2)], [], [x, y], {x: (0, 1), y: (-1, 1)})
    steps: list[Step] = []
    intervals(problem, [1], witnesses=False, record=steps.append)
    return problem, steps


def branched(empty: bool = False, nodes: int = 10) -> Proof:
    box = {x: (-1, 2), y: (-2, 1)}
    ring = x**2 + y**2 - R(1, 3)
    if empty:  # inside a circle and outside a larger one
        problem, objective = from_sympy(x, [R(1, 7) - x**2 - y**2, y - x**3 - R(1, 2)], [], [x, y], box)
    else:
        problem, objective = from_sympy(x * y + y**2 / 3 - x / 7, [1 - x**2 - y**2, ring], [], [x, y], box)
    return problem, _branches(problem, objective, nodes, 2 if empty else 1)


def cases() -> Proof:
    """Return a bound by the cases of a product that vanishes."""
    box = {x: (-1, R(3, 2)), y: (-2, 1)}
    problem, objective = from_sympy(x + 2 * y, [1 - x**2 - y**2], [x * y / 3], [x, y], box)
    return problem, _branches(problem, objective, 12)


def triple() -> Proof:
    """Return a product of three variables that vanishes, one of which cannot be zero, and another product."""
    box = {x: (-1, 1), y: (-1, 1), z: (R(1, 3), 1), w: (-1, 1)}
    goal = x + y - z + w / 7
    problem, objective = from_sympy(goal, [1 - x**2 - y**2 - w**2], [x * y * z, w * x], [x, y, z, w], box)
    return problem, _branches(problem, objective, 16, 2)


def _branches(problem: PolynomialProblem, objective: Polynomials, nodes: int, order: int = 1) -> list[Step]:
    relaxed = partial(relax, method="sparse", order=order, objective=objective)
    steps: list[Step] = []
    branch_and_bound(
        problem,
        objective,
        np.arange(problem.n_variables),
        relaxed,
        start=min(relaxed(problem).bound(objective).bound, 1e3),
        goal=lambda _: np.inf,
        nodes=nodes,
        report=lambda *_: None,
        record=steps.append,
    )
    return steps


def unbounded() -> Proof:
    """Return a problem whose x has no box, the box that was derived, and bounds that rest on it."""
    problem, _ = from_sympy(None, [x - y / 7], [2 * x + y - 1], [x, y], {y: (-R(1, 2), 1)})
    return _reached(problem)


def riding() -> Proof:
    """Return two unbounded variables, one of one sign, and bounded ones that are multiplied by s as well."""
    rows = [x + y / 3 + z - 1, x - y - w + R(1, 3)]
    problem, _ = from_sympy(None, [y], rows, [x, y, z, w], {y: (0, None), z: (-R(1, 5), R(1, 5)), w: (-R(1, 9), 1)})
    return _reached(problem)


def multiplied() -> Proof:
    """Return an unbounded gain y behind a pole x, as in identification; the others are noise."""
    rows = [z - R(1, 5) - x * (w - R(1, 2)) - y, v + w / 3 - y * R(2, 3) - x / 5]
    noise = (-R(1, 5), R(1, 5))
    box = {x: (-R(1, 2), R(1, 2)), v: noise, z: noise, w: noise}
    problem, _ = from_sympy(None, [], rows, [x, y, z, w, v], box)
    return _reached(problem)


def _reached(problem: PolynomialProblem) -> Proof:
    steps: list[Step] = []
    box = derive_box(problem, np.ones(problem.n_variables), record=steps.append)
    intervals(box.problem, [0], rounds=1, record=steps.append)
    return problem, steps


def divided() -> Proof:
    """Return a problem whose x is 1 / y, with y away from zero, and a bound that rests on it."""
    problem, _ = from_sympy(None, [], [x * y - 1], [x, y], {y: (R(1, 3), 1)})
    steps = [_bound_of(y, [], {y: (R(1, 3), 1)}), Quotient(problem, 0, 0)]
    return problem, [*steps, _bound_of(x - y / 3, [x * y - 1], {x: (-4, 4), y: (R(1, 3), 1)}, equal=True)]


def defined() -> Proof:
    """Return a variable that an equality gives with a number as its coefficient, and one with a polynomial."""
    box = {y: (0, 1), z: (-1, 1)}
    problem, _ = from_sympy(None, [], [3 * x - y + z / 7, w * (2 + y / 3) - z], [x, y, z, w], box)
    away = _bound_of(2 + y / 3, [], {y: (0, 1)})
    return problem, [Quotient(problem, 0, 0), away, Quotient(problem, 1, 3)]


def _bound_of(goal: sympy.Expr, rows: Sequence[sympy.Expr], box: dict[Any, Any], equal: bool = False) -> Bound:
    problem, objective = from_sympy(goal, [] if equal else rows, rows if equal else [], list(box), box)
    relaxed = relax(problem, "dense", 1)
    return Bound.of(relaxed, objective, relaxed.bound(objective))


def cut() -> Proof:
    """Return a problem that is affine in y, and the range of x by cuts, in several boxes."""
    rows = [x * y - R(1, 3), R(3, 2) - x**2 - y * x**2 / 2 - y]
    problem, _ = from_sympy(None, rows, [], [x, y], {x: (-1, 2), y: (-2, 1)})
    steps: list[Step] = []
    intervals(problem, [0], method="benders", tolerance=1e-1, record=steps.append)
    return problem, steps


def cut_equality() -> Proof:
    """Return the least x with x y + z = 1, by a multiplier of the equality: x >= (1 - 1/5) / 2."""
    rows = [x * y + z - 1]
    problem, _ = from_sympy(
        None, [1 - y * x / 3], rows, [x, y, z], {x: (R(1, 9), 2), y: (0, 2), z: (-R(1, 5), R(1, 5))}
    )
    return problem, [Cut(problem, problem.variable(0), 0.39, np.array([0]), np.array([0.5]), np.array([[1.0, 0.0]]))]


def kinked() -> Proof:
    """Return x + y <= 3/2 with y = max(0, 2 x - 1), and the largest x: open, on each side, and where it is decided."""
    argument, limit = 2 * x - 1, R(3, 2) - x - y
    problem, _ = from_sympy(None, [limit], [], [x, y], {x: (-1, 2), y: (0, None)})
    hull = (Row("above", "y"), Row("chord", "y", (-3.0, 3.0)))
    on = (Row("side", "y"),)
    low, high = limit.subs(y, 0), limit.subs(y, argument)
    chord = 3 * (argument + 3) - 6 * y
    parts = (
        Part(1, 0.0, 0.0, (_sides([low, -argument], {x: (-1, 2)}, on, y=-1),), -1),
        Part(1, 0.0, 0.0, (_sides([high, argument], {x: (-1, 2)}, on, y=1),), 1),
    )
    ranges = (
        Part(0, -1.0, 0.5, (_sides([low], {x: (-1, 0.5)}, (), y=-1),)),
        Part(0, 0.5, 2.0, (_sides([high], {x: (0.5, 2)}, (), y=1),)),
    )
    steps = [
        _sides([limit, y - argument, chord], {x: (-1, 2), y: (0, 3)}, hull),
        Hull(problem, np.array([0]), parts),
        Hull(problem, np.array([0]), ranges),
    ]
    return problem, steps, Kinks(np.array([1]), np.array([False]), polynomials_from_sympy([argument], [x, y]))


def nested() -> Proof:
    """Return z = max(0, y - x / 3) of y = max(0, 2 x - 1), and the largest x with z <= 1/2, on each side of y."""
    one, two, limit = 2 * x - 1, y - x / 3, R(1, 2) - z
    problem, _ = from_sympy(None, [limit], [], [x, y, z], {x: (-1, 2)})
    box = {x: (-1, 2), y: (0, 3), z: (0, 4)}
    rows = (Row("above", "y"), Row("chord", "y", (-3.0, 3.0)), Row("above", "z"), Row("chord", "z", (-1.0, 4.0)))
    relations = [limit, y - one, *_chord(one, y, -3, 3), z - two, *_chord(two, z, -1, 4)]
    parts = []
    for side, decided, ends in ((-1, -x / 3, (-1, 1)), (1, one - x / 3, (-3, 3))):
        here = (Row("side", "y"), Row("above", "z"), Row("chord", "z", tuple(map(float, ends))))
        own = [limit, side * one, z - decided, *_chord(decided, z, *ends)]
        parts.append(Part(1, 0.0, 0.0, (_sides(own, {x: box[x], z: box[z]}, here, y=side),), side))
    steps = [_sides(relations, box, rows), Hull(problem, np.array([0, 2]), tuple(parts))]
    return problem, steps, Kinks(np.array([1, 2]), np.array([False, False]), polynomials_from_sympy([one, two], [x, y]))


def _chord(argument: sympy.Expr, kink: sympy.Symbol, low: int, high: int) -> list[sympy.Expr]:
    return [high * (argument - low) - (high - low) * kink]


def signed() -> Proof:
    """Return x + y / 2 <= 1 with y = sign(x - 1/3), so that x <= 1/2."""
    third, limit = R(1, 3), 1 - x - y / 2
    problem, _ = from_sympy(None, [limit], [], [x, y], {x: (-1, 2), y: (-1, 1)})
    low, high = 2 * (x - third) + 2 * (1 - y), 2 * (y + 1) - 2 * (x - third)
    rows = (Row("low", "y", (-2.0,)), Row("high", "y", (2.0,)))
    parts = (
        Part(0, -1.0, 0.375, ()),
        Part(0, 0.375, 2.0, (_sides([limit.subs(y, 1)], {x: (0.375, 2)}, (), y=1),)),
    )
    steps = [_sides([limit, low, high], {x: (-1, 2), y: (-1, 1)}, rows), Hull(problem, np.array([0]), parts)]
    return problem, steps, Kinks(np.array([1]), np.array([True]), polynomials_from_sympy([x - third], [x, y]))


def given() -> Proof:
    """Return z = x + 1/2, whose box follows from a definition beside a kink y = max(0, x) that the box decides."""
    problem, _ = from_sympy(None, [3 - z - y], [2 * z - 2 * x - 1], [x, y, z], {x: (0, 2)})
    box = {x: (0, 2), z: (-2.5, 2.5)}
    decided = _sides([3 - z - x], box, (), equal=[2 * z - 2 * x - 1], y=1)
    decided = Sides(decided.problem, decided.known, decided.rows, ((0, "z"),), decided.steps)
    return problem, [decided], Kinks(np.array([1]), np.array([False]), polynomials_from_sympy([x], [x, y, z]))


def _sides(
    inequalities: Sequence[sympy.Expr],
    box: dict[Any, Any],
    rows: tuple[Row, ...],
    equal: Sequence[sympy.Expr] = (),
    **known: int,
) -> Sides:
    """Return the steps that bound x from above, on the given sides of kinks."""
    problem, objective = from_sympy(-x, list(inequalities), list(equal), list(box), box)
    relaxed = relax(problem, "sparse", 1)
    proven = Bound.of(relaxed, objective, relaxed.bound(objective))
    return Sides(problem, tuple(known.items()), rows, (), (proven,))


def level(path: Path, order: int = 1) -> tuple[float, ...]:
    """Write a bound that is proven below a level only: the row of the level stands behind all inequalities."""
    box = {x: (-1, 2), y: (-2, 1)}
    problem, objective = from_sympy(x * y + y**2 / 3 - x / 7, [1 - x**2 - y**2], [], [x, y], box)
    top = -R(1, 5)
    below = problem.with_inequalities(objective.below(float(top)))
    relaxed = relax(below, "sparse", order, objective=objective)
    write_certificate(path, below, [Bound.of(relaxed, objective, relaxed.bound(objective))])
    document = check.read(path)
    document["inequalities"].pop()
    (step,) = document["steps"]
    document["steps"] = [
        {**{key: step[key] for key in ("objective", "bound")}, "level": float(top).hex(), "steps": [step]}
    ]
    path.write_text(json.dumps(document), encoding="utf-8")
    return ()


def written(recipe: Callable[[], Proof], path: Path) -> tuple[float, ...]:
    write_certificate(path, *recipe())
    return ()  # no point is known


METHODS = ("lift", "sparse", "dense", "terms", "textbook")
MADE: dict[str, Callable[[], Proof]] = {
    **{f"quadratic, {method}": partial(quadratic, method) for method in METHODS},
    "cubic, sparse": partial(cubic, "sparse"),
    "chain, chordal": chain,
    "product, lift": partial(product, "lift"),
    "product, rlt": partial(product, "rlt"),
    "empty, dense": partial(nothing, "dense"),
    "empty, lift": partial(nothing, "lift"),
    "empty by two bounds": contradiction,
    "branches": branched,
    "branches, empty": partial(branched, True),
    "cases of a product": cases,
    "cases of two products": triple,
    "derived box": unbounded,
    "derived box, riding": riding,
    "derived box, gain": multiplied,
    "quotient": divided,
    "quotient by a number": defined,
    "cuts": cut,
    "cuts of equalities": cut_equality,
    "kink": kinked,
    "kink of a kink": nested,
    "sign": signed,
    "kink with a definition": given,
}
RECIPES: dict[str, Callable[[Path], tuple[float, ...]]] = {
    name: partial(written, recipe) for name, recipe in MADE.items()
} | {"level": level}
