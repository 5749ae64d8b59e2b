"""Feasible points of a statement: single variables are solved for exactly, the others come from guesses.

Each equality is solved for a variable in which it is affine, and each kink takes the value of its argument. The order
is found by peeling: what gives a variable that no other one reads can be done last. Guesses are known points, points of
the box, and minimisers that a local search in floating point finds over the variables that stay free.
"""

from __future__ import annotations

import math
import random
from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction

import numpy as np
from scipy.optimize import minimize

from benchmarks.soundness.mutations.exact import Kink, Point, Stated, Terms, is_feasible, range_at

__all__ = ["Plan", "minimised", "mixed", "repaired", "sampled"]

LARGE = 1e9  # of a float that stands for a missing end
MIXTURES = (0.0, 1e-13, 1e-10, 1e-7, 1e-4, 1e-2, 0.1, 0.3, 0.6)


Waiting = tuple[Terms | Kink, frozenset[int], list[int]]  # an equality or kink, what it reads, what it may give


@dataclass(frozen=True)
class Plan:
    """The order in which variables follow from others: an equality and its variable, or a kink."""

    assignments: list[tuple[Terms, int] | Kink]
    free: list[int]
    lean: int = 0  # -1, 0 or 1: to which end of their balls the coefficients are taken

    @staticmethod
    def of(stated: Stated, rng: random.Random | None = None) -> Plan:
        """Peel the equalities and kinks; where that ends early the rest is left to the guess."""
        kinks = {kink.variable for kink in stated.kinks}
        left: list[Waiting] = [
            (kink, frozenset(_variables(kink.argument)) | {kink.variable}, [kink.variable]) for kink in stated.kinks
        ]
        left += [
            (row, frozenset(_variables(row)), [v for v in _affine(row) if v not in kinks]) for row in stated.equalities
        ]
        found: list[tuple[Terms, int] | Kink] = []
        given: set[int] = set()
        while left:
            readers: dict[int, int] = {}
            for _, read, _ in left:
                for v in read:
                    readers[v] = readers.get(v, 0) + 1
            able = [(k, v) for k, (_, _, pivots) in enumerate(left) for v in pivots if readers[v] == 1]
            if not able:
                spare = _spare(left)
                if spare is None:
                    break
                del left[spare]
                continue
            k, v = rng.choice(able) if rng and rng.random() < 0.5 else able[-1]
            item = left.pop(k)[0]
            found.append(item if isinstance(item, Kink) else (item, v))
            given.add(v)
        lean = rng.choice([-1, 0, 0, 1]) if rng else 0
        return Plan(found[::-1], [v for v in range(len(stated.box)) if v not in given], lean)


def repaired(stated: Stated, plan: Plan, guess: Point) -> list[Fraction] | None:
    """Return the feasible point whose free variables are those of a guess, moved into the box."""
    point = [_clipped(value, *ends) for value, ends in zip(guess, stated.box, strict=True)]
    for item in plan.assignments:
        if isinstance(item, Kink):
            low, high = range_at(item.argument, point)
            value = (low, (low + high) / 2, high)[plan.lean + 1]
            point[item.variable] = Fraction((value > 0) - (value < 0)) if item.is_sign else max(value, Fraction(0))
            continue
        terms, v = item
        constant, slope = _split(terms, v, point, plan.lean)
        if slope:
            point[v] = _clipped(-constant / slope, *stated.box[v]) if _has_radius(terms) else -constant / slope
    return point if is_feasible(stated, point) else None


def mixed(stated: Stated, plan: Plan, guess: Sequence[float], inner: Sequence[Point]) -> list[list[Fraction]]:
    """Return the first feasible points on the way from a guess to each of some inner points."""
    exact = [Fraction(value) for value in guess]
    found = []
    for other in inner or [exact]:
        for share in MIXTURES if inner else (0.0,):
            point = [a if not share else a + Fraction(share) * (b - a) for a, b in zip(exact, other, strict=True)]
            good = repaired(stated, plan, [_rounded(value) for value in point])
            if good is not None:
                found.append(good)
                break
    return found


def sampled(stated: Stated, rng: random.Random) -> list[Fraction]:
    """Return a point of the box: inside, or with each variable at an end now and then."""
    share = rng.choice([0.0, 0.3, 1.0])
    point = []
    for low, high in stated.box:
        size = Fraction(10) ** rng.randint(-1, 3)
        a = low if low is not None else (high if high is not None else Fraction(0)) - size
        b = high if high is not None else (low if low is not None else Fraction(0)) + size
        at = rng.choice([Fraction(0), Fraction(1)]) if rng.random() < share else Fraction(rng.randrange(65), 64)
        point.append(a + at * (b - a))
    return point


def minimised(
    stated: Stated, plan: Plan, objective: Terms, start: Sequence[float], margin: float = 0.0
) -> list[float] | None:
    """Return a local minimiser by floats over the free variables; it need not be feasible exactly."""
    if not plan.free or len(plan.free) > 30:
        return None
    rows = [_floats(row) for row in stated.inequalities]
    goal = _floats([(mid, rad, m) for mid, rad, m in objective])
    steps = [
        (_floats(item.argument), item.variable, item.is_sign) if isinstance(item, Kink) else (_floats(item[0]), item[1])
        for item in plan.assignments
    ]
    low = [-LARGE if a is None else _float(a) for a, _ in stated.box]
    high = [LARGE if b is None else _float(b) for _, b in stated.box]
    ends = [(v, end, sign) for v in set(range(len(low))) - set(plan.free) for end, sign in ((low, 1.0), (high, -1.0))]
    free = np.array(plan.free)
    width = np.array([max(min(high[v] - low[v], 1e3), 1e-6) for v in plan.free])
    base = np.array(start, dtype=float)

    def complete(z: np.ndarray) -> list[float]:
        x = base.copy()
        x[free] = base[free] + z * width
        values: list[float] = x.tolist()
        for step in steps:
            if len(step) == 3:
                value = _value(step[0], values)
                values[step[1]] = float(np.sign(value)) if step[2] else max(value, 0.0)
                continue
            terms, v = step
            constant, slope = _value_split(terms, v, values)
            values[v] = -constant / (slope if abs(slope) > 1e-9 else math.copysign(1e-9, slope))
        return values

    def inequalities(z: np.ndarray) -> np.ndarray:
        x = complete(z)
        own = [_value(row, x, 1.0) for row in rows]
        return np.array([*own, *((x[v] - end[v]) * sign for v, end, sign in ends)] or [0.0])

    box = [((low[v] - base[v]) / w, (high[v] - base[v]) / w) for v, w in zip(plan.free, width, strict=True)]
    box = [(min(a, 0.0), max(b, 0.0)) for a, b in box]
    try:
        result = minimize(
            lambda z: _value(goal, complete(z), 1.0),
            np.zeros(len(free)),
            method="SLSQP",
            bounds=box,
            constraints={"type": "ineq", "fun": lambda z: inequalities(z) - margin},
            options={"maxiter": 40},
        )
    except (ValueError, OverflowError, ZeroDivisionError):
        return None
    found = complete(np.asarray(result.x))
    return found if np.isfinite(found).all() else None


def _spare(left: list[Waiting]) -> int | None:
    """Return an equality that may follow from the others, as of rows and their products: without it another peels."""
    reading: dict[int, list[int]] = {}
    for k, (_, read, _) in enumerate(left):
        for v in read:
            reading.setdefault(v, []).append(k)
    for k, (_, _, pivots) in enumerate(left):
        for v in pivots:
            others = [j for j in reading[v] if j != k]
            if len(others) == 1 and not isinstance(left[others[0]][0], Kink):
                return others[0]
    return None


def _variables(terms: Terms) -> set[int]:
    return {v for _, _, monomial in terms for v in monomial}


def _affine(terms: Terms) -> list[int]:
    """Return the variables in which a row is affine, those with a number as coefficient last (the best pivots)."""
    affine = [v for v in _variables(terms) if all(monomial.count(v) < 2 for *_, monomial in terms)]
    alone = {v for v in affine if all(len(m) == 1 for *_, m in terms if v in m)}
    return sorted(affine, key=lambda v: (v in alone, v))


def _split(terms: Terms, v: int, point: Point, lean: int) -> tuple[Fraction, Fraction]:
    """Return both parts of a row; a lean of one makes the first as large and the second as small as the balls allow."""
    total = [Fraction(0), Fraction(0)]
    radius = [Fraction(0), Fraction(0)]
    for mid, rad, monomial in terms:
        power = Fraction(1)
        for w in monomial:
            if w != v:
                power *= point[w]
        part = v in monomial
        total[part] += mid * power
        radius[part] += rad * abs(power)
    if lean:
        total[0] += lean * radius[0] * (1 if total[0] >= 0 else -1)
        total[1] -= lean * radius[1] * (1 if total[1] >= 0 else -1)
    return total[0], total[1]


def _has_radius(terms: Terms) -> bool:
    return any(rad for _, rad, _ in terms)


def _clipped(value: Fraction, low: Fraction | None, high: Fraction | None) -> Fraction:
    if low is not None and value < low:
        return low
    return high if high is not None and value > high else value


def _rounded(value: Fraction) -> Fraction:
    """Keep denominators short: free variables may move a little."""
    return value if value.denominator.bit_length() < 80 else Fraction(round(value * (1 << 60)), 1 << 60)


def _float(value: Fraction) -> float:
    try:
        return max(-LARGE, min(LARGE, float(value)))
    except OverflowError:
        return LARGE if value > 0 else -LARGE


def _floats(terms: Terms) -> list[tuple[float, float, tuple[int, ...]]]:
    return [(_float(mid), _float(rad), monomial) for mid, rad, monomial in terms]


def _value(terms: list[tuple[float, float, tuple[int, ...]]], x: list[float], share: float = 0.0) -> float:
    """Return the middle, or with a share of one the upper end."""
    total = 0.0
    for mid, rad, monomial in terms:
        power = 1.0
        for v in monomial:
            power *= x[v]
        total += mid * power + share * rad * abs(power)
    return total


def _value_split(terms: list[tuple[float, float, tuple[int, ...]]], v: int, x: list[float]) -> tuple[float, float]:
    constant = slope = 0.0
    for mid, _, monomial in terms:
        value = mid
        for w in monomial:
            if w != v:
                value *= x[w]
        if v in monomial:
            slope += value
        else:
            constant += value
    return constant, slope
