"""Small polynomial problems whose minimum, or whose emptiness, is decided by hand in fractions.

Each kind has a closed form: rational critical points, vertices that are enumerated, Pythagorean triples on circles, one
case for each factor of a vanishing product. The empty sets miss a point by a margin that is a power of two.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from fractions import Fraction
from itertools import combinations, product
from math import prod

import numpy as np

from relaxations.formats.expressions import Constraint, Expression, constant, variables

x, y, z = variables("x y z")
TRIPLES = ((3, 4, 5), (5, 12, 13), (8, 15, 17), (7, 24, 25))
MARGINS = tuple(Fraction(1, 2**k) for k in (10, 20, 30, 40))


@dataclass(frozen=True)
class AnalyticProblem:
    """A problem with its minimum; None where no point satisfies the constraints."""

    kind: str
    name: str
    objective: Expression
    constraints: tuple[Constraint, ...]
    minimum: Fraction | None


def problems() -> list[AnalyticProblem]:
    """Return all problems, the empty sets last."""
    kinds = (
        univariate(),
        quadratics(),
        concave_quadratics(),
        linear_programs(),
        ellipses(),
        complementarity(),
        products(),
        single_points(),
        curves(),
        scales(),
        empty_sets(),
    )
    return [case for kind in kinds for case in kind]


def _within(low: int | Fraction, high: int | Fraction, *names: Expression) -> list[Constraint]:
    return [end for v in names for end in (v >= low, v <= high)]


def _drawn(rng: np.random.Generator, low: int, high: int, divisor: int = 1) -> Fraction:
    return Fraction(int(rng.integers(low, high + 1)), divisor)


def value_at(expression: Expression, point: Mapping[str, Fraction]) -> Fraction:
    """Return the value of a polynomial at a point, in fractions."""
    return sum(
        (c * prod((point[name] for name in m), start=Fraction(1)) for m, c in expression.terms.items()), Fraction(0)
    )


def univariate() -> Iterator[AnalyticProblem]:
    """Yield quartics whose derivative has three rational roots."""
    for seed in range(10):
        rng = np.random.default_rng(seed)
        roots = [_drawn(rng, -6, 6, 3) for _ in range(3)]
        slope = (x - roots[0]) * (x - roots[1]) * (x - roots[2]) * (1 if seed % 2 else -1)
        objective = constant(0)
        for m, c in slope.terms.items():
            objective = objective + x ** (len(m) + 1) * (c / (len(m) + 1))
        least = min(value_at(objective, {"x": at}) for at in (*roots, Fraction(-3), Fraction(3)))
        yield AnalyticProblem("one variable", f"quartic {seed}", objective, tuple(_within(-3, 3, x)), least)


def quadratics() -> Iterator[AnalyticProblem]:
    """Yield separable convex quadratics whose minimiser is clipped to the box."""
    for seed in range(8):
        rng = np.random.default_rng(100 + seed)
        objective, least = constant(0), Fraction(0)
        for v in (x, y, z):
            weight, centre = _drawn(rng, 1, 5), _drawn(rng, -9, 9, 4)
            objective = objective + weight * (v - centre) ** 2
            least += weight * (min(max(centre, Fraction(-1)), Fraction(1)) - centre) ** 2
        yield AnalyticProblem("convex quadratic", f"box {seed}", objective, tuple(_within(-1, 1, x, y, z)), least)


def concave_quadratics() -> Iterator[AnalyticProblem]:
    """Yield quadratics that are concave along each axis: a vertex of the box is a minimiser."""
    for seed in range(10):
        rng = np.random.default_rng(200 + seed)
        objective = constant(0)
        for v, w in ((x, y), (y, z), (z, x)):
            objective = objective + _drawn(rng, -3, 0) * v**2 + _drawn(rng, -4, 4) * v * w + _drawn(rng, -4, 4) * v
        corners = product((Fraction(-1), Fraction(2)), repeat=3)
        least = min(value_at(objective, dict(zip("xyz", corner, strict=True))) for corner in corners)
        box = tuple(_within(-1, 2, x, y, z))
        yield AnalyticProblem("concave quadratic", f"vertices {seed}", objective, box, least)


def linear_programs() -> Iterator[AnalyticProblem]:
    """Yield linear programs in two variables, their vertices enumerated."""
    for seed in range(8):
        rng = np.random.default_rng(300 + seed)
        # a x + b y <= c: the box, and three cuts that keep the origin.
        rows = [(Fraction(s), Fraction(0), Fraction(4)) for s in (-1, 1)]
        rows += [(Fraction(0), Fraction(s), Fraction(4)) for s in (-1, 1)]
        rows += [(_drawn(rng, -5, 5), _drawn(rng, -5, 5), _drawn(rng, 1, 9)) for _ in range(3)]
        p, q = _drawn(rng, -5, 5), _drawn(rng, -5, 5)
        values = []
        for (a, b, c), (d, e, f) in combinations(rows, 2):
            pivot = a * e - b * d
            if pivot:
                u, v = (c * e - b * f) / pivot, (a * f - c * d) / pivot
                if all(r * u + s * v <= t for r, s, t in rows):
                    values.append(p * u + q * v)
        constraints = [r * x + s * y <= t for r, s, t in rows if r or s]
        yield AnalyticProblem("linear program", f"cuts {seed}", p * x + q * y, tuple(constraints), min(values))


def ellipses() -> Iterator[AnalyticProblem]:
    """Yield linear objectives on ellipses: the minimum over (x/r)^2 + (y/s)^2 <= 1 of a/r x + b/s y is -c."""
    for k, (a, b, c) in enumerate(TRIPLES):
        for r, s in ((1, 1), (Fraction(1, 7), 300)):
            constraints = [(x / r) ** 2 + (y / s) ** 2 <= 1, *_within(-r, r, x), *_within(-s, s, y)]
            name = f"{a}, {b}, {c} of half axes {r}, {s}"
            yield AnalyticProblem("ellipse", name, x * a / r + y * b / s, tuple(constraints), Fraction(-c))
            if k < 2:
                yield AnalyticProblem("ellipse", f"far from {name}", -((x / r) ** 2), tuple(constraints), Fraction(-1))


def complementarity() -> Iterator[AnalyticProblem]:
    """Yield problems where x or y vanishes, and z fills the rest: linear on each piece."""
    for seed in range(8):
        rng = np.random.default_rng(400 + seed)
        p, q, r = (_drawn(rng, -6, 6) for _ in range(3))
        total = _drawn(rng, 1, 12, 4)
        # On the piece y = 0: x + z = total, 0 <= x <= 3, 0 <= z <= total.
        ends = [(u, Fraction(0), total - u) for u in (Fraction(0), min(total, Fraction(3)))]
        ends += [(Fraction(0), u, total - u) for u in (Fraction(0), min(total, Fraction(3)))]
        least = min(p * u + q * v + r * w for u, v, w in ends)
        constraints = [x * y == 0, x + y + z == total, *_within(0, 3, x, y), *_within(0, total, z)]
        yield AnalyticProblem("complementarity", f"pieces {seed}", p * x + q * y + r * z, tuple(constraints), least)


def products() -> Iterator[AnalyticProblem]:
    """Yield sums under a product: x + y is least at x = y."""
    for k in (1, 2, 3, Fraction(1, 2)):
        box = _within(0, 8, x, y)
        yield AnalyticProblem("product", f"at least {k * k}", x + y, (x * y >= k * k, *box), 2 * Fraction(k))
        yield AnalyticProblem("product", f"equal to {k * k}", x + y, (x * y == k * k, *box), 2 * Fraction(k))


def single_points() -> Iterator[AnalyticProblem]:
    """Yield sets of a single point: constraints that only touch."""
    for a, b, c in TRIPLES:
        touching = (x**2 + y**2 <= 1, a * x + b * y >= c, *_within(-1, 1, x, y))
        yield AnalyticProblem("single point", f"disc and half-plane {a}, {b}, {c}", x - y, touching, Fraction(a - b, c))
        discs = (
            x**2 + y**2 <= 1,
            (x - Fraction(2 * a, c)) ** 2 + (y - Fraction(2 * b, c)) ** 2 <= 1,
            *_within(-3, 3, x, y),
        )
        yield AnalyticProblem("single point", f"two discs {a}, {b}, {c}", x + y, discs, Fraction(a + b, c))
    for k in (2, 3):
        nothing = ((x - Fraction(1, k)) ** 2 + y**2 <= 0, *_within(-1, 1, x, y))
        yield AnalyticProblem("single point", f"disc without a radius at 1/{k}", x + y, nothing, Fraction(1, k))


def curves() -> Iterator[AnalyticProblem]:
    """Yield points and arcs of curves."""
    box = _within(-6, 6, x, y)
    for a, b, c in TRIPLES[:2]:
        wide = _within(-c, c, x, y)
        circle = x**2 + y**2 == c * c
        yield AnalyticProblem("curve", f"circle {c}, line", x, (circle, x + y == a + b, *wide), Fraction(min(a, b)))
        yield AnalyticProblem("curve", f"circle {c}, hyperbola", x, (circle, x * y == a * b, *wide), Fraction(-b))
        yield AnalyticProblem("curve", f"circle {c}", a * x + b * y, (circle, *wide), Fraction(-c * c))
    yield AnalyticProblem("curve", "parabola", y - x, (y == x**2, *box), Fraction(-1, 4))
    yield AnalyticProblem("curve", "cubic", y, (y == x**3 - 3 * x, *_within(-2, 2, x, y)), Fraction(-2))
    yield AnalyticProblem("curve", "cusp", x, (x**3 == y**2, *box), Fraction(0))
    yield AnalyticProblem("curve", "two sheets", y, (x * y == 0, (x - 1) ** 2 + y**2 == 1, *box), Fraction(0))


def scales() -> Iterator[AnalyticProblem]:
    """Yield problems whose coefficients or boxes span many powers of ten."""
    for k in (2, 4, 6):
        big = 10**k
        box = _within(Fraction(1, 2 ** (3 * k)), big, x, y)
        yield AnalyticProblem("scale", f"hyperbola to 1e{k}", x + y, (x * y == 1, *box), Fraction(2))
    for k in (3, 6, 10, 12):
        big = 10**k
        box = [*_within(0, 1, x), *_within(0, big, y)]
        yield AnalyticProblem("scale", f"slope 1e{k}", y - big * x, (y >= big * x, *box), Fraction(0))
        yield AnalyticProblem("scale", f"line of slope 1e{k}", y - big * x, (y == big * x, *box), Fraction(0))
    for k in (4, 8):
        small = Fraction(1, 2 ** (3 * k))
        yield AnalyticProblem("scale", f"curvature 2**-{3 * k}", small * x**2 - x, tuple(_within(0, 1, x)), small - 1)


def empty_sets() -> Iterator[AnalyticProblem]:
    """Yield sets that miss a point by a margin."""
    unit, disc = _within(0, 1, x, y), _within(-1, 1, x, y)
    for m in MARGINS:
        sets = {
            "corner": [x + y >= 2 + m, *unit],
            "product": [x * y >= 1 + m, *unit],
            "parallel lines": [x + y == 1, x + y == 1 + m, *unit],
            "disc and half-plane": [x**2 + y**2 <= 1, 3 * x + 4 * y >= 5 * (1 + m), *disc],
            "circle and line": [x**2 + y**2 == 1, 3 * x + 4 * y == 5 * (1 + m), *disc],
            "vanishing product": [x * y == 0, x >= m, y >= m, x <= 1, y <= 1],
            "square below zero": [x**2 + y**2 <= -m, *disc],
        }
        for name, constraints in sets.items():
            margin = m.denominator.bit_length() - 1
            yield AnalyticProblem("empty set", f"{name}, margin 2**-{margin}", x, tuple(constraints), None)
