"""The parts of a model: a parameter with its box, a line that defines a signal, a measurement of a signal."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import sympy

from smid.models.errors import ModelError
from smid.models.expressions import shown
from smid.models.symbols import VALUE, canonical, end, packed, references, t, unpacked

__all__ = ["Edit", "Line", "Measurement", "Parameter", "check_name", "plain_name"]


def plain_name(name: str) -> str:
    """Return a name that an equation can hold; a column without header is named ``c0``, for example.

    Examples
    --------
    >>> plain_name("TI-103 Temp")
    'TI_103_Temp'
    """
    plain = re.sub(r"\W", "_", name)
    return plain if plain.isidentifier() else f"c{plain}"


def check_name(name: object, kind: str) -> None:
    """Refuse what is no name of a parameter, signal, channel or noise."""
    if not isinstance(name, str):
        raise ModelError(f"{kind} name {name!r} cannot be used: give one name, as text")
    if not name.isidentifier():
        raise ModelError(f"{kind} name {name!r} cannot be used: write {plain_name(name)!r} (letters, digits and _)")
    if name in {"t", VALUE.name}:
        raise ModelError(f"{kind} name {name!r} cannot be used: 't' and 'value' have a meaning in equations")


@dataclass(frozen=True)
class Edit:
    """Who edits a model, and where.

    Attributes
    ----------
    origin
        Of what is added.
    reserved
        Further names that new signals must not take.
    places
        Places in chains of effects, by channel (:mod:`smid.models.chains`): of an input the signal behind which, of an
        output the signal in front of which the edit is made.
    """

    origin: str
    reserved: frozenset[str] = frozenset()
    places: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True)
class Parameter:
    """An unknown constant with the box it is known to lie in.

    Attributes
    ----------
    name
        Name, also that of its symbol.
    lower, upper
        Closed box, in the parameter's unit; infinite when nothing is known.  An end that no float holds, as a third, is
        rounded outwards.
    unit
        Unit, for display.
    null
        The value at which the parameter's effect vanishes, if there is one.

    Raises
    ------
    ModelError
        If the name is not an identifier or the box is empty.

    Examples
    --------
    >>> Parameter("alpha", -1, 1).symbol
    alpha
    """

    name: str
    lower: float = -math.inf
    upper: float = math.inf
    unit: str = ""
    null: float | None = None

    def __post_init__(self) -> None:
        check_name(self.name, "parameter")
        for side, direction in (("lower", -1), ("upper", 1)):
            object.__setattr__(self, side, end(getattr(self, side), direction))
        if not self.lower <= self.upper:
            raise ModelError(f"parameter {self.name!r} has the box [{self.lower}, {self.upper}]: give lower <= upper")

    @property
    def symbol(self) -> sympy.Symbol:
        """The real sympy symbol of that name."""
        return sympy.Symbol(self.name, real=True)


@dataclass(frozen=True)
class Line:
    """One signal, defined explicitly: ``target = expression``, or ``d/dt target = expression``.

    Attributes
    ----------
    target
        The signal now, as in ``w[t]``.
    expression
        Its value, in parameters and in signals at ``t - k``, ``k >= 0``.
    rate
        Whether the expression is the signal's derivative in time, per second, and reads the signals now, its own
        included; see `smid.models.discretise` for what happens between the samples.

    Raises
    ------
    ModelError
        If the target is not a signal at time t, or the expression reads the future.

    Examples
    --------
    >>> from smid.models.symbols import signal
    >>> Line(signal("v")[t], 2 * signal("u")[t - 1]).signal
    'v'
    >>> print(Line(signal("x")[t], -signal("x")[t], rate=True))
    d/dt x[t] = -x[t]
    """

    target: sympy.Indexed
    expression: sympy.Expr
    rate: bool = False

    def __post_init__(self) -> None:
        target = canonical(self.target)
        if not isinstance(target, sympy.Indexed) or target.indices[0] != t:
            raise ModelError(f"a line cannot define '{self.target}': its target must be a signal now, as in w[t]")
        object.__setattr__(self, "target", target)
        object.__setattr__(self, "expression", canonical(self.expression))
        check_name(self.signal, "signal")
        for name, lag in self.reads:
            if lag < 0:
                raise ModelError(
                    f"the line of {self.signal!r} reads {name}[t + {-lag}], the future: shift the line by {-lag}"
                )

    def __getstate__(self) -> tuple[Any, ...]:
        return self.target, packed(self.expression), self.rate

    def __setstate__(self, state: tuple[Any, ...]) -> None:
        target, parts, rate = state
        for name, value in (("target", target), ("expression", unpacked(parts)), ("rate", rate)):
            object.__setattr__(self, name, value)

    @cached_property
    def signal(self) -> str:
        """Name of the signal that the line defines."""
        return str(self.target.base.label)

    @cached_property
    def reads(self) -> frozenset[tuple[str, int]]:
        """Signals that the expression reads, each with its lag."""
        return references(self.expression)

    def __str__(self) -> str:
        return f"{'d/dt ' if self.rate else ''}{self.target} = {shown(self.expression)}"


@dataclass(frozen=True)
class Measurement:
    """A channel of the data that shows a signal: ``channel[t] = signal[t] + noise[t]``.

    With ``inverse`` the sensor is a monotone static curve given by its inverse, and
    ``signal[t] = inverse(channel[t] - noise[t])``.

    Attributes
    ----------
    channel
        Name of the column of the data.
    signal
        Name of the signal it shows.
    noise
        Name of the noise, bounded by what the user gives for the channel; None: exact.
    inverse
        Expression in ``VALUE`` and parameters; None: the identity.

    Examples
    --------
    >>> print(Measurement("y", "w", "eta"))
    y[t] = w[t] + eta[t]
    """

    channel: str
    signal: str
    noise: str | None
    inverse: sympy.Expr | None = None

    def __post_init__(self) -> None:
        for name, kind in (
            (self.channel, "channel"),
            (self.signal, "signal"),
            (self.noise or "noise", "noise"),
        ):
            check_name(name, kind)
        if self.channel == self.signal:
            raise ModelError(f"channel and signal are both called {self.channel!r}: name the unseen signal differently")
        if self.inverse is not None:
            inverse = canonical(self.inverse)
            if VALUE not in inverse.free_symbols or inverse.atoms(sympy.Indexed):
                raise ModelError(
                    f"the inverse sensor curve '{shown(inverse)}' must depend on VALUE and on parameters only"
                )
            object.__setattr__(self, "inverse", inverse)

    def __str__(self) -> str:
        seen = f"{self.channel}[t]" + (f" - {self.noise}[t]" if self.noise else "")
        if self.inverse is not None:
            argument = f"({seen})" if self.noise else seen
            return f"{self.signal}[t] = " + re.sub(rf"\b{VALUE.name}\b", argument, shown(self.inverse))
        return f"{self.channel}[t] = {self.signal}[t]" + (f" + {self.noise}[t]" if self.noise else "")
