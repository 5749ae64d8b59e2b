"""Random models with priors whose truth is rational, often at the very end of a prior, decided in fractions.

The numbers are such that every condition can be met with equality: poles that are floats, sevenths, or complex of
rational modulus (3/5 and 4/5 of it), and a last numerator coefficient that gives the gain a value of the pool. What a
prior means is written here once more, root by root and without the package's algebra.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from fractions import Fraction
from math import isqrt
from operator import le, lt
from typing import Any

import numpy as np

from smid import Dataset, ErrorsInVariables, Model, OutputError

__all__ = ["PriorCase", "is_met", "prior_case"]

Polynomial = tuple[Fraction, ...]  # highest power first
Below = Callable[[Any, Any], bool]

_FLOATS = (0.1, 0.2, 0.3, 0.4, 0.55, 0.6, 0.7, 0.8, 0.85, 0.9, 0.95, 0.25, 0.5, 0.75, 0.875)
_OTHERS = (Fraction(6, 7), Fraction(2, 3), Fraction(1, 9), Fraction(5, 11), Fraction(1))
_GAINS = (0.3, 0.7, 1.0, 1.5, 2.0, 3.0, 7.0, 0.1)
_LARGE = Fraction(2**52 + 1, 2)  # beside it a float has no room for the other coefficients
_ODDS = 0.4  # of each prior


@dataclass(frozen=True)
class PriorCase:
    """A model of a linear plant with priors, data that the truth explains, and that truth.

    Parameters
    ----------
    seed : int
    kind : {"output error", "errors in variables"}
    orders : tuple of int
        Degrees na and nb.
    priors : dict
        Options of the model; floats, whole numbers and fractions.
    data : Dataset
    noise_bound : dict channel -> float
    truth : dict
        Every coefficient, those that priors fix or eliminate included.
    noises : dict
        Every sample of the noises, named as the variables of the problem are.
    """

    seed: int
    kind: str
    orders: tuple[int, int]
    priors: dict[str, Any]
    data: Dataset
    noise_bound: dict[str, float]
    truth: dict[str, Fraction]
    noises: dict[str, Fraction]

    def model(self) -> Model:
        """Return the model; what its constructor refuses is an error of the priors."""
        build = OutputError if self.kind == "output error" else ErrorsInVariables
        return build(*self.orders, **self.priors)

    @property
    def is_feasible(self) -> bool:
        """Tell whether the truth meets the priors; it always explains the data."""
        return is_met(self.priors, *self._plant(), self.truth)

    @property
    def is_at_an_end(self) -> bool:
        """Tell whether the truth meets the priors, one of them at its very end."""
        return self.is_feasible and not is_met(self.priors, *self._plant(), self.truth, lt)

    def _plant(self) -> tuple[Polynomial, Polynomial]:
        na, nb = self.orders
        denominator = (Fraction(1), *(self.truth[f"a{k + 1}"] for k in range(na)))
        return denominator, tuple(self.truth[f"b{k}"] for k in range(nb + 1))


def is_met(priors: dict[str, Any], a: Polynomial, b: Polynomial, truth: dict[str, Fraction], below: Below = le) -> bool:
    """Decide in fractions whether a plant meets priors.

    Parameters
    ----------
    priors : dict
        Options as in :class:`smid.models.Priors`.
    a, b : tuple of Fraction
        Coefficients of denominator and numerator, of degree two at most; the leading ones are not zero.
    truth : dict
        Coefficients by name.
    below : callable
        ``operator.le`` for closed ranges, ``operator.lt`` for open ones.
    """
    gain = priors.get("dc_gain")
    bounds, fixed = priors.get("bounds", {}), priors.get("fixed", {})
    met = [below(Fraction(low), truth[name]) for name, (low, _) in bounds.items() if np.isfinite(float(low))]
    met += [below(truth[name], Fraction(high)) for name, (_, high) in bounds.items() if np.isfinite(float(high))]
    met += [truth[name] == Fraction(value) for name, value in fixed.items()]
    poles = a
    if priors.get("integrator"):
        met.append(sum(a) == 0)
        poles = _without_one(a)
    if priors.get("stable"):
        met.append(_in_disc(poles, Fraction(1), below))
    if "pole_radius" in priors:
        met.append(_in_disc(poles, Fraction(priors["pole_radius"]), below))
    if priors.get("minimum_phase"):
        met.append(_in_disc(b, Fraction(1), below))
    met += [_on_span(p, priors[o], below) for o, p in (("pole_range", poles), ("zero_range", b)) if o in priors]
    if gain is not None:
        true = sum(b, Fraction(0)) / sum(a) if sum(a) else None
        if isinstance(gain, tuple):
            met.append(true is not None and below(Fraction(gain[0]), true) and below(true, Fraction(gain[1])))
        else:
            met.append(true == Fraction(gain))
    return all(met)


def _without_one(a: Polynomial) -> Polynomial:
    """Divide by z - 1, by Horner's rule."""
    rest, value = [], Fraction(0)
    for coefficient in a[:-1]:
        value += coefficient
        rest.append(value)
    return tuple(rest)


def _in_disc(p: Polynomial, radius: Fraction, below: Below) -> bool:
    if len(p) < 3:
        return len(p) < 2 or below(abs(p[1] / p[0]), radius)
    half, product = -p[1] / p[0] / 2, p[2] / p[0]
    if half**2 < product:  # a complex pair, whose squared modulus is the product
        return below(product, radius**2)
    return _on_span(p, (-radius, radius), below)


def _on_span(p: Polynomial, span: tuple[Any, Any], below: Below) -> bool:
    """Tell whether all roots are real and on the span, root by root."""
    low, high = map(Fraction, span)
    if len(p) < 3:
        return len(p) < 2 or (below(low, -p[1] / p[0]) and below(-p[1] / p[0], high))
    half, product = -p[1] / p[0] / 2, p[2] / p[0]
    spread = half**2 - product  # the roots are half -+ sqrt(spread)
    if spread < 0:
        return False
    left, right = half - low, high - half
    return below(0, left) and below(spread, left**2) and below(0, right) and below(spread, right**2)


def prior_case(seed: int) -> PriorCase:
    """Draw a case; the priors are drawn around its truth, and a few of them miss it by a rounding."""
    rng = np.random.default_rng([seed, 28])
    na, nb = int(rng.integers(1, 3)), int(rng.integers(0, 3))
    kind = str(rng.choice(["output error", "output error", "errors in variables"]))
    integrates = rng.random() < 0.1
    poles = _roots(rng, na - integrates)
    a = _product(poles, Fraction(1), Fraction(1)) if integrates else _product(poles, Fraction(1), None)
    scale = _pick(rng, _FLOATS) * int(rng.choice([-1, 1]))
    b = _product(_roots(rng, nb), scale, None)
    if sum(a) and rng.random() < 0.6:
        last = _pick(rng, _GAINS) * sum(a) - sum(b[:-1])
        b = (*b[:-1], last) if last or nb else b
    cancels = nb == 2 and na > integrates and kind == "output error" and rng.random() < 0.3
    if cancels:
        b = (_LARGE, scale, -_LARGE)
    truth = {f"a{k}": v for k, v in enumerate(a) if k} | {f"b{k}": v for k, v in enumerate(b)}
    priors = _priors(rng, a, b, truth, integrates)
    if cancels:
        priors["fixed"] = {name: float(value) for name, value in truth.items() if name[0] == "b"}
        if not isinstance(priors.get("dc_gain", ()), tuple):
            del priors["dc_gain"]
    return _with_data(rng, seed, kind, (na, nb), priors, truth)


def _pick(rng: np.random.Generator, pool: tuple[Any, ...]) -> Fraction:
    return Fraction(pool[int(rng.integers(len(pool)))])


def _roots(rng: np.random.Generator, count: int) -> list[Polynomial]:
    """Draw factors with the given number of roots: real, or a complex pair of rational modulus."""

    def size() -> Fraction:
        return _pick(rng, _FLOATS if rng.random() < 0.7 else _OTHERS)

    if count == 2 and rng.random() < 0.4:
        modulus = size()
        return [(Fraction(1), -2 * modulus * Fraction(int(rng.choice([-4, -3, 3, 4])), 5), modulus**2)]
    signs = (int(rng.choice([-1, 1, 1])) for _ in range(count))
    return [(Fraction(1), -sign * size()) for sign in signs]


def _product(factors: list[Polynomial], scale: Fraction, also: Fraction | None) -> Polynomial:
    """Multiply factors, a number, and ``z - also``."""
    result: Polynomial = (scale,)
    for factor in [*factors, *([(Fraction(1), -also)] if also is not None else [])]:
        terms = [Fraction(0)] * (len(result) + len(factor) - 1)
        for i, x in enumerate(result):
            for j, y in enumerate(factor):
                terms[i + j] += x * y
        result = tuple(terms)
    return result


def _priors(
    rng: np.random.Generator, a: Polynomial, b: Polynomial, truth: dict[str, Fraction], integrates: bool
) -> dict[str, Any]:
    def some(odds: float = _ODDS) -> bool:
        return bool(rng.random() < odds)

    def stated(value: Fraction, side: int) -> Any:
        """Give a number on one side of a value, or the value: as it is, or as the float next to it."""
        if some(0.4):
            return float(value) + side * float(rng.choice([0.01, 0.3, 1.0]))
        return value if some(0.7) and float(value) != value else float(value)

    def span(low: Fraction, high: Fraction) -> tuple[Any, Any]:
        ends = stated(low, -1), stated(high, 1)
        return ends if ends[0] <= ends[1] else (low, high)

    priors: dict[str, Any] = {"integrator": True} if integrates else {}
    others = _without_one(a) if integrates else a
    if some(0.6):
        priors["stable"] = True
    if some() and len(others) > 1 and any(others[1:]):
        priors["pole_radius"] = abs(stated(_radius(others), 1))
    real = _real_roots(others)
    if real and some():
        priors["pole_range"] = span(min(real), max(real))
    zeros = _real_roots(b)
    if zeros and some():
        priors["zero_range"] = span(min(zeros), max(zeros))
    if some(0.25):
        priors["minimum_phase"] = True
    fixed = {
        name: _as_float(value)
        for name, value in truth.items()
        if some(0.2) and not (integrates and name == f"a{len(a) - 1}")
    }
    if sum(a) and not integrates and some(0.5):
        gain = sum(b) / sum(a)
        is_stable = priors.get("stable") or ("pole_radius" in priors and priors["pole_radius"] <= 1)
        if some(0.4) and not {f"b{k}" for k in range(len(b))} <= fixed.keys():
            priors["dc_gain"] = _as_float(gain)
        elif is_stable:
            priors["dc_gain"] = span(gain, gain)
    while len(fixed) + integrates + isinstance(priors.get("dc_gain"), float | Fraction) >= len(truth):
        fixed.popitem()  # one parameter at least is free
    if fixed:
        priors["fixed"] = fixed
    bounds = {}
    for name, value in truth.items():
        if some(0.25):
            low, high = span(value, value)
            sign = (0.0, float("inf")) if value >= 0 else (float("-inf"), 0.0)
            bounds[name] = sign if some(0.3) else (low, high)
    if bounds:
        priors["bounds"] = bounds
    return priors


def _as_float(value: Fraction) -> Any:
    """Write a number that a float holds as a float."""
    return float(value) if float(value) == value else value


def _radius(p: Polynomial) -> Fraction:
    """Return the largest modulus of the roots, or a little more where it is no fraction."""
    real = _real_roots(p)
    if real:
        return max(map(abs, real))
    return _root(p[2] / p[0]) or Fraction(float(np.sqrt(float(p[2] / p[0])))) + Fraction(1, 1000)


def _real_roots(p: Polynomial) -> list[Fraction]:
    """Return the roots where they are fractions."""
    if len(p) < 3:
        return [-p[1] / p[0]] if len(p) == 2 else []
    half, product = -p[1] / p[0] / 2, p[2] / p[0]
    spread = _root(half**2 - product)
    return [] if spread is None else [half - spread, half + spread]


def _root(value: Fraction) -> Fraction | None:
    """Return the square root where it is a fraction."""
    if value < 0:
        return None
    found = Fraction(isqrt(value.numerator), isqrt(value.denominator))
    return found if found**2 == value else None


def _with_data(
    rng: np.random.Generator,
    seed: int,
    kind: str,
    orders: tuple[int, int],
    priors: dict[str, Any],
    truth: dict[str, Fraction],
) -> PriorCase:
    na, nb = orders
    late = 1 if kind == "output error" else 0
    n = int(rng.integers(max(na, nb + late) + na + nb + 3, 14))
    u = [Fraction(float(v)) for v in (rng.uniform(-1, 1, n) if rng.random() < 0.5 else rng.integers(-8, 9, n) / 8)]
    if len(set(u)) < 2:
        u[0] += 1
    if _LARGE in truth.values():
        u = [v / 2**51 for v in u]
    first = max(na, nb + late)
    w = [Fraction(float(v)) for v in rng.uniform(-0.5, 0.5, first)]
    for k in range(first, n):
        past = sum((-truth[f"a{i}"] * w[k - i] for i in range(1, na + 1)), Fraction(0))
        w.append(past + sum((truth[f"b{j}"] * u[k - late - j] for j in range(nb + 1)), Fraction(0)))
    noise_bound = {"y": float(rng.choice([0.01, 0.05, 0.2]))}
    y = [_measured(rng, value, noise_bound["y"]) for value in w]
    seen = [float(v) for v in u]
    if kind != "output error":
        noise_bound["u"] = 0.03
        seen = [_measured(rng, value, noise_bound["u"]) for value in u]
    noises = {f"eta[{k}]": Fraction(y[k]) - w[k] for k in range(n)}
    noises |= {f"zeta[{k}]": Fraction(seen[k]) - u[k] for k in range(n)}
    data = Dataset.from_arrays(input={"u": np.array(seen)}, output={"y": np.array(y)}, sampling_time=1.0)
    return PriorCase(seed, kind, orders, priors, data, noise_bound, truth, noises)


def _measured(rng: np.random.Generator, value: Fraction, bound: float) -> float:
    """Add noise, at its bound or within, and stay within it when rounding."""
    share = float(rng.choice([-1.0, 1.0])) if rng.random() < 0.5 else float(rng.uniform(-1, 1))
    seen = float(value + Fraction(bound) * Fraction(share))
    while abs(Fraction(seen) - value) > Fraction(bound):
        seen = float(np.nextafter(seen, float(value)))
    return seen
