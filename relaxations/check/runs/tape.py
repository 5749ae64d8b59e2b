"""The lines of a model as a list of operations on forms; each distinct part of an expression is one operation.

What parameters and numbers alone decide is fixed, and computed once for each box.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from fractions import Fraction
from functools import cached_property, reduce
from typing import Any

from relaxations.check.arithmetic import Unreadable
from relaxations.check.forms import excerpt
from relaxations.check.runs.functions import FUNCTIONS
from relaxations.check.runs.text import Node, parsed

_READ = {
    "number": 0,
    "parameter": 0,
    "stage": 0,
    "solution": 0,
    "past": 0,
    "channel": 0,
    "shown": 0,
    "+": 2,
    "*": 2,
    "larger": 2,
    "raise": 2,
    "geometric": 2,
    "choose": 3,
}
"""So many forms are read by an operation; by all others one."""

LARGEST_POWER = 1 << 10
_MOST_BITS = 1 << 12  # of a number that an expression holds

Entry = tuple[Any, ...]
"""``(kind, places of forms or other arguments...)``, see :func:`.run.operate`."""


@dataclass
class Tape:
    """Operations, each on the results of earlier ones.

    Parameters
    ----------
    parameters
        Place of each.
    channels
        Signals that are a channel's samples, which are exact.
    now
        Operation that gives a signal at the present sample.
    """

    parameters: Mapping[str, int]
    channels: frozenset[str]
    entries: list[Entry] = field(default_factory=list)
    fixed: list[bool] = field(default_factory=list)
    moved: list[frozenset[int]] = field(default_factory=list)
    now: dict[str, int] = field(default_factory=dict)
    rates: list[int] = field(default_factory=list)
    begins: list[int] = field(default_factory=list)
    slopes: dict[int, int] = field(default_factory=dict)
    _stages: dict[str, int] = field(default_factory=dict)
    lags: dict[str, int] = field(default_factory=dict)
    _longest: int = 0
    _value_shown: int | None = None
    _known: dict[Entry, int] = field(default_factory=dict)

    @cached_property
    def shared(self) -> dict[int, int]:
        """The fixed operations that others read, numbered; but for parameters and numbers, which leave nothing over."""
        varying = (place for place, fixed in enumerate(self.fixed) if not fixed)
        read = {k for place in varying for k in self.read_by(place)}
        used = [k for k in sorted(read) if self.fixed[k] and self.entries[k][0] not in ("parameter", "number")]
        return {k: n for n, k in enumerate(used)}

    def read_by(self, place: int) -> tuple[int, ...]:
        """Return the places of the forms that an operation reads."""
        kind, *read = self.entries[place]
        return tuple(read[: _READ.get(kind, 1)])

    def put(self, kind: str, *places: int, more: tuple[Any, ...] = (), fixed: bool | None = None) -> int:
        """Return the place of an operation on the forms at some places, with further arguments."""
        entry = (kind, *places, *more)
        if entry not in self._known:
            self._known[entry] = len(self.entries)
            self.entries.append(entry)
            self.fixed.append(all(self.fixed[k] for k in places) if fixed is None else fixed)
            self.moved.append(frozenset[int]().union(*(self.moved[k] for k in places)))
        return self._known[entry]

    def line(self, signal: str, text: str) -> int:
        """Put the line of a signal, and return how many samples back it reads."""
        self._longest = 0
        self.define(signal, self.write(parsed(text)))
        return self._longest

    def integrated(self, rates: Mapping[str, str]) -> int:
        """Put the rates of states, of each its solution at the next sample, and return how many samples back they read.

        In a rate, a state at ``t`` is what it is at any time during the interval; all else is held.
        """
        self._longest = 1
        self.stage(rates)
        self.begins = [self.read(name, 1) for name in rates]
        self.rates = [self.write(parsed(text)) for text in rates.values()]
        self._stages = {}
        # The derivatives of functions, of which some have derivatives again.
        k = 0
        while k < len(self.entries):
            kind, *read = self.entries[k]
            # An exponent that moves itself has no derivative here.
            if self.moved[k] and kind in _MOVED and not (kind == "raise" and self.moved[read[1]]):
                self.slopes[k] = self._slope(k, *self.entries[k])
            k += 1
        for k, name in enumerate(rates):
            self.define(name, self.put("solution", more=(k,), fixed=False))
        return self._longest

    def stage(self, names: Iterable[str]) -> None:
        """Put states at any time of an interval, which expressions that are written from now on read at ``t``."""
        for k, name in enumerate(names):
            self._stages[name] = self.put("stage", more=(k,), fixed=False)
            self.moved[self._stages[name]] = frozenset([k])

    def _slope(self, place: int, kind: str, a: int, *more: Any) -> int:
        """Return the place of the derivative of a function in its argument.

        That of a power is the power times the exponent, divided by the base: so it has one more derivative in the same
        terms. Where the part above zero bends, it is any slope between both.
        """
        one = self.number(Fraction(1))
        match kind:
            case "exp":
                return place
            case "log":
                return self._inverse(a)
            case "sin":
                return self.put("cos", a)
            case "cos":
                return self._scaled(self.put("sin", a), Fraction(-1))
            case "tanh":
                return self.less(one, self.put("square", place))
            case "atan":
                return self._inverse(self._sum([one, self.put("square", a)]))
            case "sqrt":
                return self._inverse(self._scaled(place, Fraction(2)))
            case "square":
                return self._scaled(a, Fraction(2))
            case "reciprocal":
                return self._scaled(self.put("square", place), Fraction(-1))
            case "power":
                return self._product([self.number(more[0]), place, self._inverse(a)])
            case "raise":
                return self._product([more[0], place, self._inverse(a)])
            case "positive":
                return self._scaled(self._sum([one, self.put("sign", a)]), Fraction(1, 2))
        return one  # of a size that is known not to be negative

    def define(self, signal: str, place: int) -> None:
        """Put the definition of a signal; one for each, so that its initial samples can take its place."""
        self.now[signal] = self.put("define", place, more=(signal,), fixed=False)

    def constraint(self, text: str) -> int:
        """Put a constraint, which parameters alone decide."""
        place = self.write(parsed(text))
        if not self.fixed[place]:
            raise Unreadable(f"the constraint {excerpt(text)} reads a signal")
        return place

    def shown(self, measurement: int, inverse: str | None) -> int:
        """Put the signal as a measurement shows it, without its noise."""
        self._value_shown = self.put("shown", more=(measurement,), fixed=False)
        place = self._value_shown if inverse is None else self.write(parsed(inverse))
        self._value_shown = None
        return place

    def write(self, node: Node) -> int:
        """Return the place of an expression."""
        match node:
            case ("number", value):
                return self.number(value)
            case ("name", name) if name in self.parameters:
                return self.put("parameter", more=(self.parameters[name],), fixed=True)
            case ("name", "value") if self._value_shown is not None:
                return self._value_shown
            case ("name", "pi"):
                return self._scaled(self.put("atan", self.number(Fraction(1))), Fraction(4))
            case ("name", "E"):
                return self.put("exp", self.number(Fraction(1)))
            case ("signal", name, lag):
                return self.read(name, lag)
            case ("+", *parts):
                return self._sum([self.write(part) for part in parts])
            case ("*", *factors):
                return self._factored([own for factor in factors for own in _factors(factor)])
            case ("**", base, exponent):
                return self._power(base, exponent)
            case ("call", name, *arguments):
                return self._call(name, arguments)
            case ("choose", over, strict, value, other):
                places = self.write(over), self.write(value), self.write(other)
                return self.put("choose", *places, more=(strict,))
        raise Unreadable(f"{excerpt(node[1])} is no parameter of the model")

    def read(self, name: str, lag: int) -> int:
        """Return the place of a signal some samples before."""
        if not lag and name in self._stages:
            return self._stages[name]
        if not lag and self._stages:
            raise Unreadable(f"a rate reads {excerpt(name)} at t, where it is held at a sample before")
        self._longest = max(self._longest, lag)
        if name in self.channels:
            return self.put("channel", more=(name, lag), fixed=False)
        if not lag:
            if name not in self.now:
                raise Unreadable(f"a line reads the signal {excerpt(name)}, which no line before it defines")
            return self.now[name]
        self.lags[name] = max(lag, self.lags.get(name, 0))
        return self.put("past", more=(name, lag), fixed=False)

    def number(self, value: Fraction) -> int:
        """Return the place of a number."""
        return self.put("number", more=(_limited(value),), fixed=True)

    def _value(self, place: int) -> Fraction | None:
        entry = self.entries[place]
        return entry[1] if entry[0] == "number" else None

    def _made(self, place: int) -> tuple[bool, bool]:
        """Return when an operation is made: once, at each sample, or at each time of an interval."""
        return bool(self.moved[place]), not self.fixed[place]

    def _sum(self, places: list[int]) -> int:
        values = [self._value(k) for k in places]
        total = Fraction(0)
        for value in values:
            total = _limited(total + (value or 0))
        rest = sorted((k for k, v in zip(places, values, strict=True) if v is None), key=self._made)
        if total or not rest:
            rest.insert(0, self.number(total))
        return reduce(lambda a, b: self.put("+", a, b), rest)

    def _scaled(self, place: int, factor: Fraction) -> int:
        return place if factor == 1 else self._product([self.number(factor), place])

    def _product(self, places: list[int]) -> int:
        factor = Fraction(1)
        for value in map(self._value, places):
            factor = _limited(factor if value is None else factor * value)
        rest = sorted((k for k in places if self._value(k) is None), key=self._made)
        if not rest:
            return self.number(factor)
        product = reduce(lambda a, b: self.put("*", a, b), rest)
        return product if factor == 1 else self.put("*", product, self.number(factor))

    def _factored(self, factors: list[Node]) -> int:
        """Return the place of a product, of which two factors may be ``(1 - base**count) / (1 - base)``."""
        found = None if self._stages else _geometric(factors)  # it has no derivative here
        if found is None:
            return self._product([self.write(factor) for factor in factors])
        base, count, rest = found
        summed = self.put("geometric", self.write(base), self.write(count))
        return self._product([summed, *(self.write(factor) for factor in rest)])

    def _power(self, base: Node, exponent: Node) -> int:
        place = self.write(exponent)
        size = self._value(place)
        if size is None:
            return self.put("raise", self.write(base), place)
        if size < 0:
            return self._inverse(self._power(base, ("number", -size)))
        if size.denominator == 1:
            if size > LARGEST_POWER:
                raise Unreadable(f"an exponent is beyond {LARGEST_POWER}")
            return self._whole_power(self.write(base), int(size))
        if size == Fraction(1, 2):
            return self.put("sqrt", self.write(base))
        if size > LARGEST_POWER:
            raise Unreadable(f"an exponent is beyond {LARGEST_POWER}")
        return self.put("power", self.write(base), more=(size,))

    def _whole_power(self, place: int, size: int) -> int:
        if size < 2:
            return place if size else self.number(Fraction(1))
        half = self._whole_power(place, size // 2)
        value = self._value(half)
        squared = self.put("square", half) if value is None else self.number(value * value)
        return self._product([squared, place]) if size % 2 else squared

    def _inverse(self, place: int) -> int:
        value = self._value(place)
        return self.put("reciprocal", place) if not value else self.number(1 / value)

    def _call(self, name: str, nodes: Any) -> int:
        places = [self.write(node) for node in nodes]
        if name == "Max" or name == "Min":
            return reduce(self._larger if name == "Max" else self._smaller, places)
        if len(places) == 1:
            (a,) = places
            if name == "Abs":
                size = self._sum([self._scaled(self.put("positive", a), Fraction(2)), self._scaled(a, Fraction(-1))])
                return self.put("size", size)
            if name == "ceiling":
                return self._scaled(self.put("floor", self._scaled(a, Fraction(-1))), Fraction(-1))
            if name == "tan":
                # As sympy does: 2 sin(a)^2 / sin(2 a).
                double = self.put("sin", self._scaled(a, Fraction(2)))
                return self._product(
                    [self.number(Fraction(2)), self.put("square", self.put("sin", a)), self._inverse(double)]
                )
            if name in ("sinh", "cosh"):
                rising, falling = self.put("exp", a), self.put("exp", self._scaled(a, Fraction(-1)))
                signed = self._scaled(falling, Fraction(1 if name == "cosh" else -1))
                return self._scaled(self._sum([rising, signed]), Fraction(1, 2))
            if name in _CALLED:
                return self.put(name, a)
        raise Unreadable(f"the function {excerpt(name)} with {len(places)} arguments has no enclosure here")

    def _larger(self, a: int, b: int) -> int:
        return self.put("larger", a, b)

    def _smaller(self, a: int, b: int) -> int:
        """Return ``min(a, b) = -max(-a, -b)``."""
        return self._scaled(self._larger(*(self._scaled(k, Fraction(-1)) for k in (a, b))), Fraction(-1))

    def less(self, a: int, b: int) -> int:
        """Return ``a - b``."""
        return self._sum([a, self._scaled(b, Fraction(-1))])


_MOVED = frozenset(FUNCTIONS) - {"sign", "floor"} | {"power", "raise"}
"""What has a derivative."""
_CALLED = frozenset(FUNCTIONS) - {"positive", "size", "square", "reciprocal"}


def _limited(value: Fraction) -> Fraction:
    if max(value.numerator.bit_length(), value.denominator.bit_length()) > _MOST_BITS:
        raise Unreadable(f"an expression holds a number of more than {_MOST_BITS} bits")
    return value


def _geometric(factors: list[Node]) -> tuple[Node, Node, list[Node]] | None:
    """Return base, count and the other factors of a product with ``(1 - base**count) / (1 - base)``."""
    for i, divisor in enumerate(factors):
        base = _less_from_one(divisor[1]) if divisor[0] == "**" and divisor[2] == ("number", -1) else None
        for j, factor in enumerate(factors):
            match _less_from_one(factor):
                case ("**", other, count) if base is not None and other == base:
                    return base, count, [own for k, own in enumerate(factors) if k not in (i, j)]
    return None


def _less_from_one(node: Node) -> Node | None:
    """Return what is subtracted from one; None for another expression."""
    match node:
        case ("+", ("number", 1), ("*", ("number", -1), subtracted)):
            return subtracted  # type: ignore[no-any-return]
    return None


def _factors(node: Node) -> list[Node]:
    """Return the factors of a factor: a whole power of a product is the product of the powers."""
    match node:
        case ("**", ("*", *inside), ("number", size)) if size.denominator == 1:
            return [("**", own, ("number", size)) for own in inside]
        case ("*", *inside):
            return inside
    return [node]
