"""Prior knowledge on a transfer function as plain options, turned into boxes, constraints and eliminations.

All conditions are closed (>= 0), because intervals are computed over closed sets. Arithmetic is in fractions; only the
ends of boxes become floats, rounded outwards, so that no model that meets the conditions is lost.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from itertools import accumulate
from numbers import Real
from typing import Any

import sympy

from smid.models.errors import ModelError, refuse_unknown
from smid.models.model import Model
from smid.models.schur_cohn import schur_cohn
from smid.models.symbols import end, number
from smid.models.transfer import symbols

__all__ = ["Priors", "Range"]

Range = tuple[float, float]
TransferFunction = tuple[Sequence[str], Sequence[str]]
"""The parameters of a denominator and of a numerator, by name."""


@dataclass(frozen=True)
class Priors:
    """Prior knowledge on ``G = B/A``; by default there is none.

    Attributes
    ----------
    stable
        All poles in the closed unit disc (with `integrator`: all others).
    pole_radius
        All poles within ``|z| <= pole_radius``; implies `stable` when at most 1.
    minimum_phase
        All zeros in the closed unit disc.
    dc_gain
        ``B(1)/A(1)``: a number eliminates the last free numerator coefficient; a range ``(lower, upper)`` is
        linear once the model is stable.  In output units per input unit.
    pole_range, zero_range
        All poles (zeros) real and within ``(lower, upper)``; degrees 1 and 2.
    integrator
        One pole at ``z = 1``; it eliminates the last denominator coefficient.
    bounds
        Boxes or signs, as in ``{"b0": (0, inf)}``; intersected with what the other options imply.
    fixed
        Parameters that are known exactly.

    Raises
    ------
    ModelError
        If options contradict each other or ranges are empty.

    Examples
    --------
    >>> Priors(stable=True, dc_gain=(0.5, 2.0)).pole_radius is None
    True
    >>> Priors(pole_radius=-1.0)
    Traceback (most recent call last):
        ...
    smid.models.errors.ModelError: pole_radius = -1.0 leaves no pole: give a positive radius
    """

    stable: bool = False
    pole_radius: float | None = None
    minimum_phase: bool = False
    dc_gain: float | Range | None = None
    pole_range: Range | None = None
    zero_range: Range | None = None
    integrator: bool = False
    bounds: Mapping[str, Range] = field(default_factory=dict)
    fixed: Mapping[str, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        for name in ("dc_gain", "pole_range", "zero_range"):
            span = getattr(self, name)
            if span is not None and not isinstance(span, float | Real) and not (len(span) == 2 and span[0] <= span[1]):
                raise ModelError(f"{name} = {span} is not a range: give (lower, upper) with lower <= upper")
        if self.pole_radius is not None and self.pole_radius <= 0:
            raise ModelError(f"pole_radius = {self.pole_radius} leaves no pole: give a positive radius")
        if self.integrator and self.dc_gain is not None:
            raise ModelError("an integrator has no finite DC gain: drop dc_gain or integrator")

    @staticmethod
    def of(options: Mapping[str, Any]) -> Priors:
        """Read options by name.

        Parameters
        ----------
        options
            Fields of this class.

        Raises
        ------
        ModelError
            If an option is unknown; the message names the nearest one.
        """
        refuse_unknown("option", options, [item.name for item in fields(Priors)])
        return Priors(**options)

    def apply(self, model: Model, *functions: TransferFunction) -> Model:
        """Return the model with the prior knowledge, which holds for each of some transfer functions.

        Parameters
        ----------
        functions
            Names of ``a_1, ..., a_n`` of ``A = 1 + a_1 q^-1 + ...`` (2.3), which functions may share, and names of
            ``b_0, ..., b_m`` (2.4); none where the numerator is not free.

        Raises
        ------
        ModelError
            If an option does not fit the degrees, or names an unknown parameter.
        """
        polynomials = [([sympy.Integer(1), *symbols(a)], symbols(b)) for a, b in functions]
        for denominator, _ in functions:
            model = self._boxes(model, denominator)
        swap: dict[str, sympy.Expr] = {}
        for a, b in polynomials:
            swap |= self._eliminations(model, a, b)
        # Boxes of eliminated parameters stay as constraints: `substitute` and `fix` see to that.
        model = model.fix(**self.fixed)
        for name, expression in swap.items():
            model = model.substitute(name, expression)
        rules = {sympy.Symbol(name, real=True): number(value) for name, value in self.fixed.items()}
        rules |= {sympy.Symbol(name, real=True): expression for name, expression in swap.items()}
        constraints = []
        for both in polynomials:
            a, b = ([sympy.expand(item.xreplace(rules)) for item in polynomial] for polynomial in both)
            positive = bool(b) and self._is_positive(model, b[0])
            constraints += [
                *self._pole_conditions(a),
                *self._zero_conditions(b, positive),
                *self._gain_conditions(a, b),
            ]
        return _with_new_constraints(model, constraints)

    def _radius(self) -> float | None:
        radii = ([1.0] if self.stable else []) + ([self.pole_radius] if self.pole_radius is not None else [])
        return min(radii, default=None)

    def _boxes(self, model: Model, denominator: Sequence[str]) -> Model:
        order, radius = len(denominator), self._radius()
        if radius is not None:
            # |a_i| is at most the sum of all products of i poles.
            own, one = number(radius), sympy.Integer(1)
            reach = [max(own, one) if self.integrator and k == 0 else own for k in range(order)]
            magnitudes = [one]
            for pole in reach:
                magnitudes = [x + pole * y for x, y in zip([*magnitudes, 0], [0, *magnitudes], strict=True)]
            for name, magnitude in zip(denominator, magnitudes[1:], strict=True):
                model = _tightened(model, name, (-magnitude, magnitude))
        if self.pole_range is not None and order == 1 and not self.integrator:
            model = _tightened(model, denominator[0], (-self.pole_range[1], -self.pole_range[0]))
        for name, box in self.bounds.items():
            model = _tightened(model, name, box)
        return model

    def _eliminations(self, model: Model, a: Sequence[sympy.Expr], b: Sequence[sympy.Expr]) -> dict[str, sympy.Expr]:
        for name in self.fixed:
            model.parameter(name)
        swap: dict[str, sympy.Expr] = {}
        rules = {sympy.Symbol(name, real=True): number(value) for name, value in self.fixed.items()}
        if self.integrator:
            if len(a) < 2 or a[-1].name in self.fixed:
                raise ModelError("integrator=True needs a free pole: raise the number of poles or fix less")
            swap[a[-1].name] = -sum(a[:-1]).xreplace(rules)
        if isinstance(self.dc_gain, float | Real):
            free = [item for item in b if item.name not in self.fixed]
            if not free:
                raise ModelError("dc_gain needs a free numerator coefficient: fix less, or drop dc_gain")
            rest = sum((item for item in b if item != free[-1]), sympy.Integer(0))
            swap[free[-1].name] = (number(self.dc_gain) * sum(a) - rest).xreplace(rules)
        return swap

    def _is_positive(self, model: Model, leading: sympy.Expr) -> bool:
        boxes = {item.symbol: item.lower for item in model.parameters}
        return bool(leading.is_positive) or boxes.get(leading, -math.inf) >= 0

    def _pole_conditions(self, a: Sequence[sympy.Expr]) -> list[sympy.Expr]:
        # With A(1) = 0 the quotient A(z)/(z - 1) has the partial sums of A as coefficients.
        poles = list(accumulate(a))[:-1] if self.integrator else list(a)
        radius = self._radius()
        conditions: list[sympy.Expr] = []
        if radius is not None and len(poles) > 1:
            conditions += schur_cohn(poles, radius)
        if self.pole_range is not None:
            conditions += _real_roots(poles, self.pole_range, True, "pole_range")
        return conditions

    def _zero_conditions(self, b: Sequence[sympy.Expr], positive: bool) -> list[sympy.Expr]:
        conditions: list[sympy.Expr] = []
        if self.minimum_phase and len(b) > 1:
            conditions += schur_cohn(b, positive_leading=positive)
        if self.zero_range is not None:
            conditions += _real_roots(b, self.zero_range, positive, "zero_range")
        return conditions

    def _gain_conditions(self, a: Sequence[sympy.Expr], b: Sequence[sympy.Expr]) -> list[sympy.Expr]:
        if self.dc_gain is None or isinstance(self.dc_gain, float | Real):
            return []
        radius = self._radius()
        if radius is None or radius > 1:
            raise ModelError("a range of dc_gain needs A(1) > 0: add stable=True")
        lower, upper = self.dc_gain
        below = [sum(b) - number(lower) * sum(a)] if math.isfinite(lower) else []
        return below + ([number(upper) * sum(a) - sum(b)] if math.isfinite(upper) else [])


def _tightened(model: Model, name: str, box: Range) -> Model:
    old = model.parameter(name)
    lower, upper = max(old.lower, end(box[0], -1)), min(old.upper, end(box[1], 1))
    if lower > upper:
        raise ModelError(f"the priors leave no value for {name!r}: its box would be [{lower:g}, {upper:g}]; relax one")
    parameters = tuple(replace(item, lower=lower, upper=upper) if item is old else item for item in model.parameters)
    return replace(model, parameters=parameters)


def _real_roots(
    coefficients: Sequence[sympy.Expr], span: Range, positive_leading: bool, option: str
) -> list[sympy.Expr]:
    """Return conditions for one or two real roots in an interval; an unknown leading sign multiplies them."""
    degree = len(coefficients) - 1
    if degree not in (1, 2):
        raise ModelError(f"{option} is available for one or two roots, not {degree}: use a radius or bounds instead")
    sided = [(number(value), side) for value, side in zip(span, (-1, 1), strict=True) if math.isfinite(value)]
    leading = sympy.Integer(1) if positive_leading else coefficients[0]
    c0, c1 = coefficients[:2]
    if degree == 1:
        return [sympy.expand(leading * side * (c1 + value * c0)) for value, side in sided]
    c2 = coefficients[2]
    ends = [c0 * value**2 + c1 * value + c2 for value, _ in sided]
    middle = [side * (2 * value * c0 + c1) for value, side in sided]
    return [sympy.expand(c1**2 - 4 * c0 * c2), *(sympy.expand(leading * item) for item in (*ends, *middle))]


def _with_new_constraints(model: Model, constraints: Sequence[sympy.Expr]) -> Model:
    """Add constraints that the boxes do not imply."""
    fresh = []
    for item in constraints:
        if item.is_number:
            if item.is_negative:
                raise ModelError("the priors contradict each other: relax one of them")
            continue
        symbols = sorted(item.free_symbols, key=str)
        if len(symbols) == 1 and sympy.Poly(item, *symbols).degree() == 1:
            slope, offset = sympy.Poly(item, *symbols).all_coeffs()
            root = -offset / slope
            model = _tightened(model, symbols[0].name, (root, math.inf) if slope > 0 else (-math.inf, root))
        elif item not in model.constraints and item not in fresh:
            fresh.append(item)
    return model.with_constraint(*fresh)
