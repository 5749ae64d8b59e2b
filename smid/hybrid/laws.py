"""Laws that a learned curve is compared with: those that the diagnosis names, as functions of one argument x.

    offset                c
    proportional          c x                                    (viscous friction, a linear outflow)
    square_root_outflow   c sqrt|x|, with the sign of x
    quadratic_drag        c x|x|
    power_law             c (|x|/S)^p, with the sign of x        S a round number near the largest |x|
    exponential           c exp(r x)
    coulomb_friction      c sign(x)
    stribeck_friction     (c + d exp(-|x|/f)) sign(x)
    direction_dependence  c x + d|x|                             (another drag in each direction)

The sign of an argument that changes sign is regularised as in the effects on rates: ``max(-1, min(1, x/s))``. For an
argument of one sign it is left out, and the last three laws do not apply. Each law is linear in c and d.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import numpy as np
import sympy

from relaxations.algebra.arrays import Array
from smid.diagnosis.effects.parts.extremes import larger, smaller
from smid.models.symbols import number

__all__ = ["GUARD", "LAWS", "Argument", "Law", "Shape"]

GUARD = 1e-6
"""Keeps slopes at zero finite, as a share of the reach."""


@dataclass(frozen=True)
class Argument:
    """The argument of a law.

    Parameters
    ----------
    x
        Expression over signals, or a symbol.
    lower, upper
        Range that was visited.

    Examples
    --------
    >>> speed = Argument(sympy.Symbol("v"), -2.96, 2.0)
    >>> speed.turns, speed.reach
    (True, 3.0)
    """

    x: sympy.Expr
    lower: float
    upper: float

    @property
    def turns(self) -> bool:
        """Return whether the argument changes its sign."""
        return self.lower < 0 < self.upper

    @property
    def symbol(self) -> sympy.Symbol:
        """Return the symbol x that stands for the argument in a formula."""
        return sympy.Symbol("x", real=True) if self.turns or self.lower < 0 else sympy.Symbol("x", positive=True)

    @property
    def reach(self) -> float:
        """Return a round number near the largest magnitude."""
        return float(f"{max(abs(self.lower), abs(self.upper)):.1g}")


@dataclass(frozen=True)
class Shape:
    """A parameter that shapes a law: its box and its starts, as multiples of a power of the reach.

    Examples
    --------
    >>> Shape((-10.0, 10.0), (1.0,), -1).box(5.0)
    (-2.0, 2.0)
    """

    ends: tuple[float, float]
    tried: tuple[float, ...]
    power: int = 0

    def box(self, reach: float) -> tuple[float, float]:
        """Return the box."""
        low, high = self.ends
        return low * reach**self.power, high * reach**self.power

    def starts(self, reach: float) -> Array:
        """Return the starts, shape (n,)."""
        return np.array(self.tried) * reach**self.power


Symbols = Mapping[str, sympy.Symbol]


@dataclass(frozen=True)
class Law:
    """A law, linear in its coefficients.

    Parameters
    ----------
    name
        As that of the effect.
    parts
        Functions that the coefficients multiply, by the coefficient's name.
    shapes
        Parameters within these functions, by name. Laws share those of the same name.
    turning
        Whether the law needs an argument that changes sign.

    Examples
    --------
    >>> cubic = Law("stiffness", {"cubic": lambda argument, symbols: argument.x**3})
    >>> cubic.parts["cubic"](Argument(sympy.Symbol("x"), -1.0, 1.0), {}), cubic.size
    (x**3, 1)
    """

    name: str
    parts: Mapping[str, Callable[[Argument, Symbols], sympy.Expr]]
    shapes: Mapping[str, Shape] = field(default_factory=dict)
    turning: bool = False

    @property
    def size(self) -> int:
        """Return the number of parameters."""
        return len(self.parts) + len(self.shapes)


def _decimal(value: float) -> sympy.Rational:
    """Return a number of few digits as the fraction that it is written as."""
    return sympy.Rational(str(value))


def _way(a: Argument, s: Symbols) -> sympy.Expr:
    return larger(-1, smaller(1, a.x / s["sticking"]))


def _root(a: Argument, s: Symbols) -> sympy.Expr:  # noqa: ARG001
    size = sympy.Abs(a.x)
    return a.x / sympy.sqrt(size + number(GUARD) * _decimal(a.reach)) if a.turns else sympy.sqrt(size)


def _square(a: Argument, s: Symbols) -> sympy.Expr:  # noqa: ARG001
    return a.x * sympy.Abs(a.x) if a.turns else a.x**2


def _power(a: Argument, s: Symbols) -> sympy.Expr:
    scaled = sympy.Abs(a.x) / _decimal(a.reach)
    odd = a.x / _decimal(a.reach) * (scaled + number(GUARD)) ** (s["power"] - 1)
    return odd if a.turns else scaled ** s["power"]


def _stribeck(a: Argument, s: Symbols) -> sympy.Expr:
    return _way(a, s) * sympy.exp(-sympy.Abs(a.x) / s["fading"])


_STICKING = {"sticking": Shape((1e-3, 0.2), (0.05, 0.005), 1)}

LAWS: tuple[Law, ...] = (
    Law("offset", {"offset": lambda a, s: sympy.Integer(1)}),  # noqa: ARG005
    Law("proportional", {"linear": lambda a, s: a.x}),  # noqa: ARG005
    Law("square_root_outflow", {"root": _root}),
    Law("quadratic_drag", {"square": _square}),
    Law("power_law", {"factor": _power}, {"power": Shape((0.2, 4.0), (0.6, 1.3, 1.7, 2.5))}),
    Law(
        "exponential",
        {"amplitude": lambda a, s: sympy.exp(s["rate"] * a.x)},
        {"rate": Shape((-10.0, 10.0), (-5.0, -1.5, -0.3, 0.3, 1.5, 5.0), -1)},
    ),
    Law("coulomb_friction", {"dry": _way}, _STICKING, turning=True),
    Law(
        "stribeck_friction",
        {"sliding": _way, "extra": _stribeck},
        {**_STICKING, "fading": Shape((1e-2, 1.0), (0.05, 0.2), 1)},
        turning=True,
    ),
    Law("direction_dependence", {"drag": lambda a, s: a.x, "onward": lambda a, s: sympy.Abs(a.x)}, turning=True),  # noqa: ARG005
)
"""All laws; a new one is one line here."""
