"""Rates as sums of products: a coefficient of parameters alone, times a function of the states and of what is held.

A rate is linear in its coefficients, however wide the box of the parameters is. The functions are evaluated over boxes
of the states during an interval between two samples. A parameter whose ends are equal counts as a number.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass

from relaxations.check.arithmetic import Work
from relaxations.check.runs.affine import UNKNOWN, Form, Range, add, between, multiply
from relaxations.check.runs.motion import at_once
from relaxations.check.runs.operations import cost_of, operate
from relaxations.check.runs.tape import Tape
from relaxations.check.runs.text import Node, parsed

__all__ = ["Coefficient", "Terms", "Values", "rate_of"]


@dataclass(frozen=True)
class Coefficient:
    """Place of the operation, and the parameters whose product it is; none where it is another expression."""

    place: int
    factors: tuple[int, ...]


@dataclass(frozen=True)
class Terms:
    """The rates of a model.

    Parameters
    ----------
    rate
        For each state, the state that is its rate, if one is.
    integral
        For each state, one whose rate it is.
    alone
        Whether the rate of each state reads no other state.
    products
        For each state, place of each coefficient, and of the function that it multiplies; none where a state is the
        rate.
    """

    tape: Tape
    rate: tuple[int | None, ...]
    integral: tuple[int | None, ...]
    alone: tuple[bool, ...]
    products: tuple[tuple[tuple[int, int], ...], ...]
    coefficients: tuple[Coefficient, ...]

    @staticmethod
    def of(
        rates: Mapping[str, str], parameters: Mapping[str, int], box: Sequence[Range], channels: frozenset[str]
    ) -> Terms:
        """Write the rates of states as sums of products."""
        tape = Tape(parameters, channels)
        tape.stage(rates)
        free = {name for name, k in parameters.items() if box[k][0] != box[k][1]}
        names, nodes = list(rates), [parsed(text) for text in rates.values()]
        rate = [names.index(node[1]) if _is_state(node, rates) else None for node in nodes]
        places: dict[tuple[Node, ...], int] = {}
        coefficients, products, alone = list[Coefficient](), [], []
        for k, node in enumerate(nodes):
            found: dict[int, list[Node]] = {}
            for own, function in _products(node, free) if rate[k] is None else ():
                if own not in places:
                    places[own] = len(coefficients)
                    known = [parameters[factor[1]] for factor in own if factor[0] == "name"]
                    simple = len(set(known)) == len(own)
                    coefficients.append(Coefficient(tape.write(("*", *own)), tuple(known) if simple else ()))
                found.setdefault(places[own], []).append(function)
            products.append(tuple((own, tape.write(("+", *parts))) for own, parts in found.items()))
            alone.append(tape.moved[tape.write(node)] <= {k})
        integral = [rate.index(k) if k in rate else None for k in range(len(names))]
        return Terms(tape, tuple(rate), tuple(integral), tuple(alone), tuple(products), tuple(coefficients))


def _is_state(node: Node, rates: Mapping[str, str]) -> bool:
    return node[0] == "signal" and node[1] in rates and node[2] == 0


def _products(rate: Node, free: set[str]) -> Iterator[tuple[tuple[Node, ...], Node]]:
    """Yield the factors of the coefficient and the function of each product in a rate."""
    for product in rate[1:] if rate[0] == "+" else (rate,):
        own, rest = list[Node](), list[Node]()
        for factor in product[1:] if product[0] == "*" else (product,):
            names = set(_leaves(factor))
            (own if names & free and None not in names else rest).append(factor)
        yield tuple(sorted(own, key=repr)), ("*", *rest)


def _leaves(node: Node) -> Iterator[str | None]:
    """Yield the names that an expression reads; None for a signal."""
    if node[0] == "name":
        yield node[1]
    elif node[0] == "signal":
        yield None
    else:
        for part in node[1:]:
            if isinstance(part, tuple):
                yield from _leaves(part)


class Values:
    """The functions of terms over boxes, for a box of the parameters."""

    def __init__(self, terms: Terms, box: Sequence[Range], work: Work) -> None:
        tape = terms.tape
        self._tape, self._work = tape, work
        self._starts = [between(*ends) for ends in box]
        self._forms: list[Form] = []
        for entry, fixed in zip(tape.entries, tape.fixed, strict=True):
            self._forms.append(operate(entry, self._forms, self._starts) if fixed else UNKNOWN)
        read = {place for own in terms.products for _, place in own}
        for k in range(len(tape.entries) - 1, -1, -1):
            if k in read:
                read |= set(tape.read_by(k))
        varying = [k for k in sorted(read) if not tape.fixed[k]]
        self._held = [k for k in varying if not tape.moved[k]]
        self._moving = [k for k in varying if tape.moved[k]]
        self._cost = sum(cost_of(tape.entries[k]) for k in self._moving)

    def coefficient(self, coefficient: Coefficient) -> Range:
        """Return the ends of a coefficient."""
        form = self._forms[coefficient.place]
        return form.low, form.high

    def held(self, exact: Mapping[str, Sequence[Form | None]], now: int) -> list[Form]:
        """Return the forms of what does not move in the interval that ends at a sample of some channels."""
        forms = list(self._forms)
        for k in self._held:
            kind, *read = self._tape.entries[k]
            if kind == "channel":
                name, lag = read
                forms[k] = (exact[name][now - lag] if now >= lag else None) or UNKNOWN
            else:
                forms[k] = UNKNOWN if kind == "past" else operate(self._tape.entries[k], forms, self._starts)
        return forms

    def over(self, held: Sequence[Form], states: Sequence[Form]) -> list[Form]:
        """Return the forms over a box of the states; where an operation jumps, of any number between both sides."""
        forms = list(held)
        for k in self._moving:
            entry = self._tape.entries[k]
            forms[k] = states[entry[1]] if entry[0] == "stage" else at_once(entry, forms, self._tape)
        self._work.spend(self._cost)
        return forms


def rate_of(products: Iterable[tuple[int, int]], forms: Sequence[Form], known: Sequence[Range]) -> Form:
    """Return the ends of a rate, from the forms of its functions and what is known of its coefficients."""
    total = between(0, 0)
    for own, place in products:
        total = add(total, multiply(between(*known[own]), between(forms[place].low, forms[place].high)))
    return total
