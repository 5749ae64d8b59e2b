"""False proofs made by hand: each breaks one condition of one rule, and everything else in it holds.

Random changes seldom meet all that a false theorem needs. A forgery that is accepted has a feasible point that refutes
it; a few are true of what they state, with claims that are as strong as a rule allows.
"""

from __future__ import annotations

import random
from collections.abc import Callable
from fractions import Fraction
from typing import Any

__all__ = ["FORGED"]

Document = dict[str, Any]


def file_of(box: list[Any], steps: list[Any], **more: Any) -> Document:
    return {
        "format": "relaxations certificate",
        "version": 1,
        "variables": [f"x{k}" for k in range(len(box))],
        "box": box,
        "equalities": [],
        "inequalities": [],
        **more,
        "steps": steps,
    }


def bound(objective: list[Any], value: Any, centre: list[Any], scale: list[Any], **more: Any) -> Document:
    own = {"objective": objective, "bound": value, "centre": centre, "scale": scale}
    return {**own, "equalities": [], "products": [], **more}


def square(weight: Any, *of: list[Any]) -> Document:
    """Return a product of constraints and a number."""
    return {"of": list(of), "weight": weight, "basis": [[]], "factor": [[1]]}


X, Y, Z = [[1, 0, [0]]], [[1, 0, [1]]], [[1, 0, [2]]]
UNIT = [0, 1]


def scale_zero(rng: random.Random) -> Document:
    """Look at one point of the box: x >= 5 on [0, 10]."""
    at = rng.randint(1, 10)
    return file_of([[0, 10]], [bound(X, at, [at], [0])])


def scale_zero_empty(rng: random.Random) -> Document:
    """Look at one point, where an equality fails."""
    at = rng.randint(2, 10)
    equality = [[1, 0, [1]], [-1, 0, [0]]]
    steps = [bound([], 1, [at, 0], [0, 0], equalities=[[0, [[f"1/{at}", []]]]])]
    return file_of([[0, 10], UNIT], steps, equalities=[equality])


def scale_zero_reach(rng: random.Random) -> Document:
    """Bound a free variable by one value of s."""
    faces = [{"variable": 0, "side": side, "steps": [bound(Y, 1, [0, 1], [1, 0])]} for side in (1, -1)]
    return file_of([[None, None]], [{"reach": {"variables": [[0, rng.randint(1, 3)]], "riding": [], "faces": faces}}])


def cover_of_two(rng: random.Random) -> Document:
    """Cover the box with ranges of two variables: y - x >= -1/2."""
    goal, middle = [[1, 0, [1]], [-1, 0, [0]]], rng.choice(["1/2", "1/4"])
    half = Fraction(middle) / 2
    low = bound(goal, str(-Fraction(middle)), [str(half), "1/2"], [str(half), "1/2"])
    rest = (1 + Fraction(middle)) / 2, (1 - Fraction(middle)) / 2
    high = bound(goal, str(Fraction(middle) - 1), ["1/2", str(rest[0])], ["1/2", str(rest[1])])
    parts = [
        {"variable": 0, "box": [0, middle], "steps": [low]},
        {"variable": 1, "box": [middle, 1], "steps": [high]},
    ]
    claim = str(min(-Fraction(middle), Fraction(middle) - 1))
    return file_of([UNIT, UNIT], [{"objective": goal, "bound": claim, "parts": parts}])


def sides_of_a_sign(rng: random.Random) -> Document:
    """Split at the sign s of x, which may be zero: z <= 1/2 - s^2."""
    rows = [[["1/2", 0, []], [-1, 0, [2]], [-1, 0, [1, 1]]]]
    parts = [{"kink": 0, "side": side, "steps": [_below(side)]} for side in rng.sample([1, -1], 2)]
    step = {"hull": [2], "parts": parts}
    return file_of([[-1, 1]] * 3, [step], inequalities=rows, kinks=[_sign(X)])


def sign_at_zero(rng: random.Random) -> Document:
    """Take a sign as decided on a box that holds zero at its end."""
    rows = [[["1/2", 0, []], [-1, 0, [2]], [-1, 0, [1, 1]]]]
    side = rng.choice([1, -1])
    box = [UNIT if side > 0 else [-1, 0], [-1, 1], [-1, 1]]
    return file_of(box, [_below(side)], inequalities=rows, kinks=[_sign(X)])


def _sign(argument: list[Any]) -> Document:
    return {"variable": 1, "kind": "sign", "argument": argument}


def _below(side: int) -> Document:
    """Return the proof of z <= -1/2 for a decided sign."""
    own = bound([[-1, 0, [2]]], "1/2", [0, 0, 0], [1, 1, 1], products=[square(1, ["inequality", 0])])
    return {"sides": [[0, side]], "rows": [], "defined": [], "steps": [own]}


def kink_of_a_ball(rng: random.Random) -> Document:
    """Take a positive part as zero where only the midpoint of its argument is below zero."""
    kink = {"variable": 1, "kind": "positive part", "argument": [[1, 0, [0]], [0, rng.choice(["1/2", "1/19"]), []]]}
    own = bound([[-1, 0, [2]]], 0, ["-1/2", 0, 0], ["1/2", 2, 2], equalities=[[0, [[1, []]]]])
    step = {"sides": [[0, -1]], "rows": [], "defined": [], "steps": [own]}
    equality = [[1, 0, [1]], [-1, 0, [2]]]
    return file_of([[-1, "-1/20"], [0, 2], [0, 2]], [step], equalities=[equality], kinks=[kink])


def kinks_exchanged(rng: random.Random) -> Document:
    """Use the rows of a sign for a positive part, or the other way round."""
    is_sign = rng.random() < 0.5
    kink = {"variable": 1, "kind": "sign" if is_sign else "positive part", "argument": X}
    row = rng.choice([["above", 0], ["chord", 0, -4, 4]] if is_sign else [["low", 0, -4], ["high", 0, 4]])
    goals = {
        "above": [[1, 0, [1]], [-1, 0, [0]]],
        "chord": [[4, 0, [0]], [-8, 0, [1]], [16, 0, []]],
        "low": [[2, 0, [0]], [-4, 0, [1]], [4, 0, []]],
        "high": [[-2, 0, [0]], [4, 0, [1]], [4, 0, []]],
    }
    own = bound(goals[row[0]], 0, [0, 0], [4, 4], products=[square(1, ["inequality", 0])])
    step = {"sides": [], "rows": [row], "defined": [], "steps": [own]}
    return file_of([[-4, 4], [-4, 4]], [step], kinks=[kink])


def quotient_of_a_square(rng: random.Random) -> Document:
    """Divide by what holds the variable itself: x^2 = x / 8."""
    share = f"1/{rng.randint(2, 9)}"
    return file_of(
        [[-1, 1]], [{"quotient": {"equality": 0, "variable": 0}}], equalities=[[[1, 0, [0, 0]], [f"-{share}", 0, [0]]]]
    )


def quotient_of_balls(rng: random.Random) -> Document:
    """Divide a ball by a ball: true, and with the largest values that are feasible."""
    row = [[1, rng.choice(["9/10", "1/3"]), [0]], [-1, rng.choice([0, "1/2"]), []]]
    return file_of([[None, None]], [{"quotient": {"equality": 0, "variable": 0}}], equalities=[row])


def face_missing(rng: random.Random) -> Document:
    """Bound x = 1 - y on one side only, with y in [-8, 8]."""
    side = rng.choice([1, -1])
    row = [[1, 0, [0]], [1, 0, [1]], [-1, 0, []]]
    # On the face x = side: side + y - s = 0 with y >= -8 s, y <= 8 s, rows 0 and 1.
    steps = [_least_s(side)]
    faces = [{"variable": 0, "side": side, "steps": steps}]
    if rng.random() < 0.5:
        faces.append({"variable": 0, "side": -side, "steps": [_least_s(-side)] if rng.random() < 0.5 else []})
    step = {"reach": {"variables": [[0, 1]], "riding": [1], "faces": faces}}
    return file_of([[None, None], [-8, 8]], [step], equalities=[row])


def _least_s(side: int) -> Document:
    """Prove s >= 1/9 where 1 + y = s, or s >= 1/7 where -1 + y = s."""
    size = Fraction(1, 9) if side > 0 else Fraction(1, 7)
    # side > 0: (1 + 8) s - 1 is (s - 1 - y) + (8 s + y), the second of the rows of y; side < 0 with 8 s - y.
    products = [square(str(size), ["inequality", 1 if side > 0 else 0])]
    multiplier = -size if side > 0 else size
    claim = str(size)
    return bound(
        Z, claim, [side, 0, "1/2"], [0, 8, "1/2"], products=products, equalities=[[0, [[str(multiplier), []]]]]
    )


def curved_reach(rng: random.Random) -> Document:
    """Multiply x^2 = c by s once: |x| <= c."""
    root = rng.randint(2, 6)
    c, size = Fraction(1, root**2), Fraction(1, 2 * root**2)
    row = [[1, 0, [0, 0]], [str(-c), 0, []]]
    faces = []
    for side in (1, -1):
        own = bound(Y, str(size / c), [side, "1/2"], [0, "1/2"], equalities=[[0, [[str(-1 / c), []]]]])
        faces.append({"variable": 0, "side": side, "steps": [own]})
    return file_of(
        [[None, None]], [{"reach": {"variables": [[0, str(size)]], "riding": [], "faces": faces}}], equalities=[row]
    )


def riding_from_zero(rng: random.Random) -> Document:
    """Let s z stay in the box of z: x = 4 z with z in [1, 2]."""
    factor = rng.randint(3, 5)
    row = [[1, 0, [0]], [-factor, 0, [1]]]
    faces = []
    for side, size in ((1, Fraction(1, factor - 1)), (-1, Fraction(1, factor + 1))):
        own = bound([], 1, [side, "3/2", "1/2"], [0, "1/2", "1/2"], equalities=[[0, [[str(size), []]]]])
        faces.append({"variable": 0, "side": side, "steps": [own]})
    return file_of(
        [[None, None], [1, 2]], [{"reach": {"variables": [[0, 1]], "riding": [1], "faces": faces}}], equalities=[row]
    )


def part_of_nothing(rng: random.Random) -> Document:
    """Leave a part without a proof, or with a proof of something else."""
    goal = [[1, 0, [0, 1]]]
    claim = rng.choice([0, "-1/8", 1])
    other = rng.choice([[[claim, 0, []]], [[2, 0, [0]], [4, 0, []]], []])
    low = other[-1][0] - 2 if len(other) > 1 else claim
    steps = [] if rng.random() < 0.4 else [bound(other, low, [0, 0], [1, 1])]
    parts = [{"variable": 0, "box": ends, "steps": steps} for ends in ([-1, 0], [0, 1])]
    return file_of([[-1, 1], [-1, 1]], [{"objective": goal, "bound": claim, "parts": parts}])


def ball_that_may_be_zero(rng: random.Random) -> Document:
    """Let a product vanish whose coefficient may be zero: x y = 0 with y away from zero."""
    row = [["1/10", rng.choice(["1/5", "1/10"]), [0, 1]]]
    steps = [bound([[-1, 0, [0]]], 0, [0, "3/4"], [0, "1/4"])]
    if rng.random() < 0.5:
        steps = [{"hull": [0], "equality": 0, "parts": [{"variable": 0, "box": [0, 0], "steps": []}]}]
    return file_of([UNIT, ["1/2", 1]], steps, equalities=[row])


def sum_that_vanishes(rng: random.Random) -> Document:
    """Branch by the cases of an equality of two terms: x y = 1 / 16."""
    row = [[1, 0, [0, 1]], [-1, 0, []] if rng.random() < 0.5 else ["-1/16", 0, []]]
    parts = [{"variable": v, "box": [0, 0], "steps": []} for v in (0, 1)]
    return file_of([[-1, 1]] * 2, [{"hull": [0], "equality": 0, "parts": parts[: rng.randint(1, 2)]}], equalities=[row])


def hull_without_an_end(rng: random.Random) -> Document:
    """Take the hull over the parts that bound y, of parts that do not all."""
    row = [[1, 0, [1]], [-1, 0, [0]]]
    proof = {"quotient": {"equality": 0, "variable": 1}}
    parts = [{"variable": 0, "box": [0, "1/2"], "steps": [proof]}, {"variable": 0, "box": ["1/2", 1], "steps": []}]
    return file_of([UNIT, [None, None]], [{"hull": [1], "parts": rng.sample(parts, 2)}], equalities=[row])


def curved_cut(rng: random.Random) -> Document:
    """Treat y z as affine: x <= y z with y <= 1, z <= 3."""
    row = [[-1, 0, [0]], [1, 0, [1, 2]]]
    step = {"objective": [[-1, 0, [0]]], "bound": -1, "outer": [0], "weights": [[0, 1]]}
    cuts = [{"equalities": [], "inequalities": [[0, 1]]}]
    return file_of([[0, 3], UNIT, [0, rng.randint(2, 3)]], [step], inequalities=[row], cuts=cuts)


def cut_of_a_ball(rng: random.Random) -> Document:
    """Leave out a radius of a cut: x <= 0 +- 1."""
    rad = rng.choice([1, "1/2", "1/100"])
    row = rng.choice([[[-1, 0, [0]], [0, rad, []]], [[-1, 0, [0]], [0, rad, [1]]], [[-1, rad, [0]], [0, 0, []]]])
    step = {"objective": [[-1, 0, [0]]], "bound": 0, "outer": [0], "weights": [[0, 1]]}
    return file_of([[0, 3], UNIT], [step], inequalities=[row], cuts=[{"equalities": [], "inequalities": [[0, 1]]}])


def objective_of_inner(rng: random.Random) -> Document:
    """Bound an inner variable by cuts that hold none of it."""
    step = {"objective": Y, "bound": rng.choice([0, "1/4"]), "outer": [0], "weights": []}
    return file_of([UNIT, [-1, 1]], [step], cuts=[])


def signs_of_cuts(rng: random.Random) -> Document:
    """Take an inequality, or a cut, with a weight below zero: x >= 0 as x <= 0."""
    inner, outer = rng.choice([(-1, 1), (1, -1)])
    step = {"objective": [[-1, 0, [0]]], "bound": 0, "outer": [0], "weights": [[0, outer]]}
    cuts = [{"equalities": [], "inequalities": [[0, inner]]}]
    return file_of([[0, 3]], [step], inequalities=[[[1, 0, [0]]]], cuts=cuts)


def level_too_low(rng: random.Random) -> Document:
    """Claim more than the level below which something is proven."""
    low, claim = rng.choice([(-1, "1/2"), (-1, 0), ("-1/2", 1)])
    shift = 1 if low == -1 else 2
    own = bound([], 1, ["1/2"], ["1/2"], products=[square(shift, ["inequality", 0])])
    return file_of([UNIT], [{"objective": X, "bound": claim, "level": low, "steps": [own]}])


def level_of_another(rng: random.Random) -> Document:
    """Prove below a level, of another objective than the one that is claimed."""
    goal = [[1, 0, [0]], [1, 0, [1]]]
    own = bound([[2, 0, [0]], [1, 0, [1]], [1, 0, []]], 1, ["1/2", "1/2"], ["1/2", "1/2"])
    step = {"objective": goal, "bound": rng.choice(["1/4", "1/2"]), "level": rng.choice([1, 2]), "steps": [own]}
    return file_of([UNIT, UNIT], [step])


FORGED: dict[str, Callable[[random.Random], Document]] = {
    own.__name__.replace("_", " "): own
    for own in (scale_zero, scale_zero_empty, scale_zero_reach, cover_of_two, sides_of_a_sign, sign_at_zero,
                kink_of_a_ball, kinks_exchanged, quotient_of_a_square, quotient_of_balls, face_missing, curved_reach,
                riding_from_zero, part_of_nothing, ball_that_may_be_zero, sum_that_vanishes, hull_without_an_end,
                curved_cut, cut_of_a_ball, objective_of_inner, signs_of_cuts, level_too_low, level_of_another)
}  # fmt: skip
