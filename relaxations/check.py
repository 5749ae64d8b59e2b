"""Check a certificate file: ``python -m relaxations.check FILE``.

The file states a problem in its own variables x, and for every step an affine map ``x = centre + scale t`` and
multipliers. With exact rational numbers this program recomputes

    r = objective - sum_k p_k h_k - sum_j weight_j sigma_j g_j,     sigma_j = sum over columns of (b' F_j)^2,

as a polynomial in t: ``h_k`` are the equalities, ``p_k`` any polynomials, ``g_j`` products of inequalities and of the
box's ``1 - t_i``, ``1 + t_i`` and ``1 - t_i^2``. On the feasible set the first sum is zero, the second is nonnegative,
and every monomial of t lies in [-1, 1]. So ``objective >= r_0 - sum_{i > 0} |r_i|`` there, and the claimed bound must
not lie above. A coefficient that is given as a ball stands for each number in it.

A step that bounds one variable tightens the box for the steps after it. A positive bound of the objective zero proves
that no point is feasible. There are six more kinds of steps.

A step with ``parts`` branches: their boxes cover the box, in one variable, or all factors of an ``equality`` that is a
single monomial, one of which vanishes; and the steps of each part prove the same bound there, or that it is empty.

A step with ``reach`` proves a box for variables that have none. Let ``tau >= 1`` be the least number with
``|x_k| <= m_k tau`` for each of them, s = 1 / tau and ``y_k = s x_k / m_k``. Every row that is affine in them together,
times s, is a row in y; a bounded variable z may ride along as ``y = s z``. Where tau > 1, some y_k is 1 or -1. So if on
each of these faces the steps prove s >= s_min > 0, or that it is empty, then ``|x_k| <= m_k / s_min`` for the least
s_min (or 1, if less).

A step with ``weights`` sums ``cuts`` in the ``outer`` variables p. The multipliers of a cut, which the file gives once
for all steps, make ``c_0(p) + sum_i c_i(p) z_i >= 0`` of the constraints, with all other variables z in their box,
``|z_i - m_i| <= q_i``. There ``c_i z_i <= c_i m_i + q_i |c_i|``, and where c_i is between -l and h on the box of
p, ``|c_i| <= share c_i + max((1 - share) h, (1 + share) l)`` for any share from -1 to 1. What is left is a polynomial
in p, bounded as above.

A step with ``quotient`` divides: where an equality is ``A + B x_k = 0``, its A is bounded by the box, and B is a number
or a step before it proved ``B >= b > 0`` or ``-B >= b > 0``, ``|x_k| <= max |A| / b``.

The file may state ``kinks``: a variable s is the positive part max(0, x) of its argument x, a polynomial in variables
and in the kinks before it, or its sign. A step with ``sides`` holds steps of its own, on rows of their own: where the
box keeps an argument on one side of zero, the kink's value is put into all rows, and of others ``rows`` adds what holds
for L <= x <= U, where L <= 0 <= U are ends that the box has:

    positive part:    s >= x  ("above"),    U (x - L) >= (U - L) s  ("chord")
    sign:    2 x >= L (1 - s)  ("low"),    2 x <= U (1 + s)  ("high")

A step with ``hull`` has parts as well: ranges of one variable, or both sides of a positive part, on which "side" is a
row, ``side x >= 0``. The variables named lie in the hull of what the steps of the parts leave of their boxes.

Nothing is rounded: every number in the file is a rational one, and so are all results. For that reason this file needs
no ball arithmetic library, and nothing but Python's own. It imports nothing of the rest of the package, which it has
to judge. :mod:`relaxations.certificate_file` writes such files.
"""

from __future__ import annotations

import json
import re
import sys
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from decimal import ROUND_FLOOR, Context, Decimal
from fractions import Fraction
from functools import cached_property
from math import inf, lcm, prod
from pathlib import Path
from typing import Any

FORMAT = "relaxations certificate"
VERSION = 1
EXIT_ACCEPTED, EXIT_REFUSED, EXIT_UNREADABLE = 0, 1, 2

Monomial = tuple[int, ...]  # the variables' numbers with repetition, sorted

_HEXADECIMAL = re.compile(r"(-?)0x([01])(?:\.([0-9a-f]{1,64}))?p([+-]?[0-9]{1,4})")
_FRACTION = re.compile(r"(-?[0-9]{1,4000})(?:/([0-9]{1,4000}))?")
_HIGHEST_DEGREE = 64  # a substitution in a monomial of degree d makes up to 2**d terms, so absurd ones are refused


class Refused(Exception):
    """The file does not prove what it claims.

    Examples
    --------
    >>> try:
    ...     check({"format": "a shopping list"})
    ... except Refused as refusal:
    ...     print(refusal)
    the format is 'a shopping list', this program checks 'relaxations certificate'
    """


class Unreadable(Exception):
    """There is no file, or it is no JSON.

    Examples
    --------
    >>> try:
    ...     read("nowhere.json")
    ... except Unreadable as error:
    ...     print(error)
    nowhere.json: No such file or directory
    """


@dataclass(frozen=True)
class Polynomial:
    """Coefficients ``mid +- rad`` of monomials; a monomial that is missing has zero for both.

    Parameters
    ----------
    mid, rad : dict of monomial to Fraction
        A monomial is the tuple of its variables' numbers, sorted, with repetition: ``(0, 0, 1)`` is ``x0^2 x1``.

    Examples
    --------
    >>> p = Polynomial({(0, 0): Fraction(1), (): Fraction(-1, 3)}, {(): Fraction(1, 100)})  # x0^2 - 1/3, about
    >>> sorted(p.monomials)
    [(), (0, 0)]
    """

    mid: dict[Monomial, Fraction]
    rad: dict[Monomial, Fraction]

    @property
    def monomials(self) -> set[Monomial]:
        """Return the monomials with a coefficient that may differ from zero."""
        return {m for part in (self.mid, self.rad) for m, value in part.items() if value}


@dataclass(frozen=True)
class Proven:
    """One theorem: ``objective >= bound`` on the feasible set.

    Parameters
    ----------
    step : str
        Which one proves it.
    objective : Polynomial
        In the problem's own variables.
    bound : Fraction
        As claimed, and found true.
    recomputed : Fraction
        ``r_0 - sum |r_i|``, at least the claimed bound.
    """

    step: str
    objective: Polynomial
    bound: Fraction
    recomputed: Fraction

    @property
    def empty(self) -> bool:
        """Return whether this proves that no point is feasible."""
        return not self.objective.monomials and self.bound > 0


Extended = Fraction | float  # a float is infinite
Box = list[list[Fraction | None]]  # both ends of each variable; None: no bound


@dataclass(frozen=True)
class Kink:
    """A variable that is the positive part of a polynomial, ``max(0, x)``, or else its sign.

    Parameters
    ----------
    variable : int
    sign : bool
    argument : Polynomial
        x, in variables and in kinks that stand before this one.

    Examples
    --------
    >>> Kink(1, False, Polynomial({(0,): Fraction(2)}, {})).sign  # x1 = max(0, 2 x0)
    False
    """

    variable: int
    sign: bool
    argument: Polynomial


@dataclass(frozen=True)
class Stated:
    """Variables and constraints, the box apart; a constraint that is None may not be used.

    Parameters
    ----------
    names : list of str
    equalities, inequalities : list of Polynomial or None
    cuts : list
        Multipliers, as they are in the file.
    kinks : list of Kink
    chosen : dict of int to int
        The side of zero on which a part takes the argument of a kink, by the kink's number.

    Examples
    --------
    >>> product = Polynomial({(0, 1): Fraction(2)}, {})
    >>> Stated(["x", "y"], [product], [], [], [], {}).vanishing  # equality 0: x or y is zero
    {0: {0, 1}}
    """

    names: list[str]
    equalities: list[Polynomial | None]
    inequalities: list[Polynomial | None]
    cuts: list[Any]
    kinks: list[Kink]
    chosen: dict[int, int]

    def constraint(self, kind: str, number: Any, where: str) -> Polynomial:
        """Return a constraint by its number in the file."""
        members = self.equalities if kind == "equality" else self.inequalities
        found = members[_index(number, len(members), where)]
        if found is None:
            raise Refused(f"{where}: {kind} {number} is not affine in the variables without a box")
        return found

    @cached_property
    def _split(self) -> dict[tuple[int, frozenset[int]], _Split]:
        return {}

    def cut(self, number: Any, outer: frozenset[int], where: str) -> _Split:
        """Return what the multipliers of a cut make of the constraints, by inner variables."""
        known = _index(number, len(self.cuts), where), outer
        if known not in self._split:
            self._split[known] = _Split.of(self, self.cuts[known[0]], outer, f"cut {number}")
        return self._split[known]

    @cached_property
    def vanishing(self) -> dict[int, set[int]]:
        """Return the equalities that are a single monomial, with its variables, one of which is zero."""
        found = {}
        for number, polynomial in enumerate(self.equalities):
            monomials = [] if polynomial is None else list(polynomial.mid)
            if polynomial is not None and len(monomials) == len(polynomial.monomials) == 1:
                (monomial,) = monomials
                if abs(polynomial.mid[monomial]) > polynomial.rad.get(monomial, 0):
                    found[number] = set(monomial)
        return found


# ---------------------------------------------------------------- polynomials


def _product_of(left: dict[Monomial, Fraction], right: dict[Monomial, Fraction]) -> dict[Monomial, Fraction]:
    total: dict[Monomial, Fraction] = {}
    for m, a in left.items():
        for n, b in right.items():
            key = tuple(sorted(m + n)) if m and n else m or n
            total[key] = total[key] + a * b if key in total else a * b
    return total


def _add(total: dict[Monomial, Fraction], more: dict[Monomial, Fraction], sign: int = 1) -> None:
    for m, value in more.items():
        total[m] = total[m] + sign * value if m in total else sign * value


def _absolute(part: dict[Monomial, Fraction]) -> dict[Monomial, Fraction]:
    return {m: abs(value) for m, value in part.items()}


def _multiply(left: Polynomial, right: Polynomial) -> Polynomial:
    """Return an enclosure of the product."""
    rad: dict[Monomial, Fraction] = {}
    if left.rad or right.rad:
        _add(rad, _product_of(_absolute(left.mid), right.rad))
        _add(rad, _product_of(left.rad, _absolute(right.mid)))
        _add(rad, _product_of(left.rad, right.rad))
    return Polynomial(_product_of(left.mid, right.mid), rad)


def _substitute(polynomial: Polynomial, centre: list[Fraction], scale: list[Fraction]) -> Polynomial:
    """Return the polynomial in t, where ``x = centre + scale * t``."""
    mid: dict[Monomial, Fraction] = {}
    rad: dict[Monomial, Fraction] = {}
    for m in polynomial.monomials:
        expanded: dict[Monomial, Fraction] = {(): Fraction(1)}
        for v in m:
            both: list[tuple[Monomial, Fraction]] = [((), centre[v]), ((v,), scale[v])]
            affine = {key: value for key, value in both if value}
            expanded = _product_of(expanded, affine)
        _add(mid, {key: value * polynomial.mid.get(m, 0) for key, value in expanded.items()})
        if m in polynomial.rad:
            _add(rad, {key: abs(value) * polynomial.rad[m] for key, value in expanded.items()})
    return Polynomial(mid, rad)


def _sum_of_squares(basis: list[Monomial], factor: list[list[Fraction]]) -> dict[Monomial, Fraction]:
    """Return ``sum over columns f of (sum_i f_i b_i)^2``."""
    # Integers over one denominator multiply many times faster than fractions.
    denominator = lcm(*(value.denominator for row in factor for value in row))
    rows = [[value.numerator * (denominator // value.denominator) for value in row] for row in factor]
    total: dict[Monomial, int] = {}
    for i, left in enumerate(rows):
        for j in range(i, len(rows)):
            weight = sum(a * b for a, b in zip(left, rows[j], strict=True))
            key = tuple(sorted(basis[i] + basis[j]))
            total[key] = total.get(key, 0) + (weight if i == j else 2 * weight)
    return {m: Fraction(value, denominator * denominator) for m, value in total.items()}


# ---------------------------------------------------------------- reading, with every doubt refused


def _refuse_unless(condition: bool, message: str) -> None:
    if not condition:
        raise Refused(message)


def _number(value: Any, where: str) -> Fraction:
    if isinstance(value, int) and not isinstance(value, bool):
        return Fraction(value)
    if isinstance(value, str):
        found = _HEXADECIMAL.fullmatch(value)
        if found:
            sign, whole, digits, exponent = found.group(1), found.group(2), found.group(3) or "", int(found.group(4))
            size = Fraction(int(whole + digits, 16)) * Fraction(2) ** (exponent - 4 * len(digits))
            return -size if sign else size
        found = _FRACTION.fullmatch(value)
        if found and int(found.group(2) or 1):
            return Fraction(int(found.group(1)), int(found.group(2) or 1))
    raise Refused(f"{where}: {value!r} is no number; write 3, '1/3' or a float in hexadecimal, '0x1.8p+1'")


def _get(mapping: Any, key: str, where: str) -> Any:
    _refuse_unless(isinstance(mapping, dict), f"{where} is no object")
    _refuse_unless(key in mapping, f"{where} has no {key!r}")
    return mapping[key]


def _list(value: Any, where: str, length: int | None = None) -> list[Any]:
    _refuse_unless(isinstance(value, list), f"{where} is no list")
    _refuse_unless(length is None or len(value) == length, f"{where} has {len(value)} entries instead of {length}")
    result: list[Any] = value
    return result


def _index(value: Any, count: int, where: str) -> int:
    whole = isinstance(value, int) and not isinstance(value, bool)
    # A negative number would count from the end.
    _refuse_unless(whole and 0 <= value < count, f"{where}: {value!r} is no number from 0 to {count - 1}")
    return int(value)


def _monomial(value: Any, count: int, where: str) -> Monomial:
    _list(value, where)
    _refuse_unless(len(value) <= _HIGHEST_DEGREE, f"{where}: degree {len(value)}, the highest is {_HIGHEST_DEGREE}")
    return tuple(sorted(_index(v, count, where) for v in value))


def _polynomial(value: Any, count: int, where: str) -> Polynomial:
    """Read ``[[mid, rad, [variables]], ...]``."""
    mid: dict[Monomial, Fraction] = {}
    rad: dict[Monomial, Fraction] = {}
    for k, entry in enumerate(_list(value, where)):
        place = f"{where}, term {k}"
        centre, radius, variables = _list(entry, place, 3)
        size = _number(radius, place)
        _refuse_unless(size >= 0, f"{place}: radius >= 0 fails: {_shown(size)}")
        key = _monomial(variables, count, place)
        _add(mid, {key: _number(centre, place)})
        if size:
            _add(rad, {key: size})
    return Polynomial(mid, rad)


def _end(value: Any, where: str) -> Fraction | None:
    return None if value is None else _number(value, where)


# ---------------------------------------------------------------- the check


def check(document: Any) -> tuple[Proven, ...]:
    """Return the theorems of a certificate, step by step.

    Parameters
    ----------
    document : object
        The file's content, as :func:`read` returns it.

    Returns
    -------
    tuple of Proven

    Raises
    ------
    Refused
        With the inequality that fails, or what is missing.

    Examples
    --------
    x^2 - x >= -1/4 on [0, 2], where x = 1 + t: the square of x - 1/2 = 1/2 + t.

    >>> step = {"objective": [[1, 0, [0, 0]], [-1, 0, [0]]], "bound": "-1/4", "centre": [1], "scale": [1],
    ...         "equalities": [], "products": [{"of": [], "weight": 1, "basis": [[], [0]], "factor": [["1/2"], [1]]}]}
    >>> document = {"format": "relaxations certificate", "version": 1, "variables": ["x"], "box": [[0, 2]],
    ...             "equalities": [], "inequalities": [], "steps": [step]}
    >>> check(document)[0].recomputed
    Fraction(-1, 4)
    >>> step["bound"] = "-1/5"
    >>> check(document)
    Traceback (most recent call last):
    relaxations.check.Refused: step 1: bound <= r_0 - sum |r_i| fails: -0.2 > -0.25
    """
    name = _get(document, "format", "the file")
    _refuse_unless(name == FORMAT, f"the format is {name!r}, this program checks {FORMAT!r}")
    version = _get(document, "version", "the file")
    _refuse_unless(version == VERSION and version is not True, f"version {version!r}, this program checks {VERSION}")
    names = _list(_get(document, "variables", "the file"), "variables")
    _refuse_unless(all(isinstance(v, str) for v in names), "variables: a name is no text")
    count = len(names)
    box: Box = [
        [_end(end, f"box of {name}") for end in _list(pair, f"box of {name}", 2)]
        for name, pair in zip(names, _list(_get(document, "box", "the file"), "box", count), strict=True)
    ]
    equalities, inequalities = (
        [_polynomial(p, count, f"{kind} {k}") for k, p in enumerate(_list(_get(document, kind, "the file"), kind))]
        for kind in ("equalities", "inequalities")
    )
    steps = _list(_get(document, "steps", "the file"), "steps")
    _refuse_unless(len(steps) > 0, "there are no steps: nothing is claimed")
    try:
        cuts = _list(document.get("cuts", []), "cuts")
        kinks = _kinks(document.get("kinks", []), count)
        proven, empty = _check_steps(
            steps, "", Stated(names, list(equalities), list(inequalities), cuts, kinks, {}), box
        )
    except RecursionError:
        raise Refused("the branches are nested too deeply") from None
    if empty and not any(theorem.empty for theorem in proven):
        proven.append(_nothing("all steps"))
    return tuple(proven)


def _check_steps(steps: list[Any], inside: str, stated: Stated, box: Box) -> tuple[list[Proven], bool]:
    """Return what the steps prove of the points in a box, which they tighten, and whether there are none."""
    proven: list[Proven] = []
    empty = _settle(box, stated)
    for number, step in enumerate(steps, start=1):
        if empty:  # whatever else is claimed of no point
            break
        where = f"{inside}step {number}"
        if isinstance(step, dict) and "reach" in step:
            found = _check_reach(step["reach"], where, stated, box)
        elif isinstance(step, dict) and "quotient" in step:
            found = _check_quotient(step["quotient"], where, stated, box, proven)
        elif isinstance(step, dict) and "sides" in step:
            found = _check_sides(step, where, stated, box)
        elif isinstance(step, dict) and "hull" in step:
            found = _check_hull(step, where, stated, box)
        elif isinstance(step, dict) and "parts" in step:
            found = [_check_branches(step, where, stated, box)]
        elif isinstance(step, dict) and "weights" in step:
            found = [_check_cuts(step, where, stated, box)]
        else:
            found = [_check_bound(step, where, stated, box)]
        proven += found
        for theorem in found:
            _tighten(box, theorem)
            empty = empty or theorem.empty
        empty = _settle(box, stated) or empty
    return proven, empty


def _check_branches(step: Any, where: str, stated: Stated, box: Box) -> Proven:
    objective = _polynomial(_get(step, "objective", where), len(stated.names), f"{where}, objective")
    bound = _number(_get(step, "bound", where), f"{where}, bound")
    for inside, own, proven, empty in _check_parts(step, where, stated, box):
        reached = [p.bound for p in proven if p.objective == objective] + _box_says(objective, own)
        if not empty:
            _refuse_unless(len(reached) > 0, f"{inside}: nothing is proven of the objective")
            _refuse_unless(max(reached) >= bound, f"{inside}: bound >= {_shown(bound)} fails: {_shown(max(reached))}")
    return Proven(where, objective, bound, bound)


def _check_parts(step: Any, where: str, stated: Stated, box: Box) -> Iterator[tuple[str, Box, list[Proven], bool]]:
    """Check the steps of each part, give its box and what they prove, and check in the end that the parts cover."""
    count = len(stated.names)
    parts: list[tuple[int, Fraction, Fraction]] = []
    sides: list[tuple[int, int]] = []
    for k, part in enumerate(_list(step["parts"], f"{where}, parts"), start=1):
        inside = f"{where}, part {k}"
        own, view = [list(ends) for ends in box], stated
        if isinstance(part, dict) and "kink" in part:
            number, side = _index(part["kink"], len(stated.kinks), inside), _side(_get(part, "side", inside), inside)
            _refuse_unless(not stated.kinks[number].sign, f"{inside}: a sign that is zero belongs to neither side")
            sides.append((number, side))
            view = replace(stated, chosen={**stated.chosen, number: side})
        else:
            v = _index(_get(part, "variable", inside), count, inside)
            low, high = (_number(end, inside) for end in _list(_get(part, "box", inside), inside, 2))
            parts.append((v, low, high))
            _narrow(own, v, low, high)
        proven, empty = _check_steps(_list(_get(part, "steps", inside), inside), f"{inside}, ", view, own)
        yield inside, own, proven, empty
    if sides:
        covered = not parts and len({n for n, _ in sides}) == 1 and {side for _, side in sides} == {1, -1}
        _refuse_unless(covered, f"{where}: the parts are not both sides of one kink")
    elif "equality" in step:
        number = _index(step["equality"], len(stated.equalities), where)
        _refuse_unless(number in stated.vanishing, f"{where}: equality {number} is no single monomial")
        for v in sorted(stated.vanishing[number]):
            if _may_vanish(box[v]):
                found = any(v == w and low <= 0 <= high for w, low, high in parts)
                _refuse_unless(found, f"{where}: no part covers {stated.names[v]} = 0")
    else:
        _check_cover(parts, where, stated, box)


def _check_hull(step: Any, where: str, stated: Stated, box: Box) -> list[Proven]:
    variables = _monomial(step["hull"], len(stated.names), f"{where}, hull")
    left = [own for _, own, _, empty in _check_parts(step, where, stated, box) if not empty]
    if not left:
        return [_nothing(where)]
    found = []
    for v in variables:
        for side, end in ((1, 0), (-1, 1)):
            ends = [own[v][end] for own in left]
            reached = [side * value for value in ends if value is not None]
            if len(reached) == len(ends):
                found.append(Proven(where, Polynomial({(v,): Fraction(side)}, {}), min(reached), min(reached)))
    return found


def _nothing(where: str) -> Proven:
    """Return the theorem that there is no point."""
    return Proven(where, Polynomial({}, {}), Fraction(1), Fraction(1))


def _narrow(box: Box, v: int, low: Extended, high: Extended) -> None:
    lower, upper = box[v]
    if isinstance(low, Fraction):
        lower = low if lower is None else max(lower, low)
    if isinstance(high, Fraction):
        upper = high if upper is None else min(upper, high)
    box[v] = [lower, upper]


# ---------------------------------------------------------------- kinks


def _side(value: Any, where: str) -> int:
    _refuse_unless(value in (1, -1) and not isinstance(value, bool | float), f"{where}: {value!r} is no side, 1 or -1")
    return int(value)


def _kinks(value: Any, count: int) -> list[Kink]:
    kinks: list[Kink] = []
    places = {}
    for n, entry in enumerate(_list(value, "kinks")):
        where = f"kink {n}"
        variable, kind = _index(_get(entry, "variable", where), count, where), _get(entry, "kind", where)
        _refuse_unless(kind in ("positive part", "sign"), f"{where}: {kind!r} is neither 'positive part' nor 'sign'")
        _refuse_unless(variable not in places, f"{where}: its variable is one of another kink")
        places[variable] = n
        argument = _polynomial(_get(entry, "argument", where), count, f"{where}, argument")
        kinks.append(Kink(variable, kind == "sign", argument))
    for n, kink in enumerate(kinks):
        read = {v for m in kink.argument.monomials for v in m}
        _refuse_unless(all(places.get(v, -1) < n for v in read), f"kink {n}: it reads one that is not before it")
    return kinks


def _check_sides(step: Any, where: str, stated: Stated, box: Box) -> list[Proven]:
    sides: dict[int, int] = {}
    for pair in _list(step["sides"], f"{where}, sides"):
        number, side = _list(pair, f"{where}, sides", 2)
        sides[_index(number, len(stated.kinks), where)] = _side(side, where)
    values: dict[int, Polynomial] = {}
    arguments: list[tuple[Polynomial, Extended, Extended]] = []
    for n, kink in enumerate(stated.kinks):
        argument = _with_values(kink.argument, values)
        low, high = _range(argument, box)
        arguments.append((argument, low, high))
        if n not in sides:
            _narrow(box, kink.variable, *_reached(kink, low, high))
            continue
        side = sides[n]
        if stated.chosen.get(n) != side:
            least = low if side > 0 else -high
            name = stated.names[kink.variable]
            _refuse_unless(
                least > 0 or (least == 0 and not kink.sign), f"{where}: the box does not decide on {name}, side {side}"
            )
        constant = Polynomial({(): Fraction(side)} if kink.sign else {}, {})
        values[kink.variable] = argument if side > 0 and not kink.sign else constant
    rows = [
        _row(_list(row, f"{where}, row {k}"), f"{where}, row {k}", stated, sides, arguments)
        for k, row in enumerate(_list(_get(step, "rows", where), f"{where}, rows"))
    ]
    view = replace(
        stated,
        equalities=[None if row is None else _with_values(row, values) for row in stated.equalities],
        inequalities=[*(None if row is None else _with_values(row, values) for row in stated.inequalities), *rows],
    )
    for quotient in _list(_get(step, "defined", where), f"{where}, defined"):
        for theorem in _check_quotient(quotient, where, view, box, []):
            _tighten(box, theorem)
    proven, empty = _check_steps(_list(_get(step, "steps", where), where), f"{where}, ", view, box)
    return [*proven, _nothing(where)] if empty else proven


def _reached(kink: Kink, low: Extended, high: Extended) -> tuple[Extended, Extended]:
    """Return the range of a kink's value, given that of its argument."""
    zero, one = Fraction(0), Fraction(1)
    if kink.sign:
        return (zero if low >= 0 else -one), (zero if high <= 0 else one)
    return max(low, zero), max(high, zero)


def _row(
    row: list[Any],
    where: str,
    stated: Stated,
    sides: dict[int, int],
    arguments: list[tuple[Polynomial, Extended, Extended]],
) -> Polynomial:
    """Return an inequality between a kink's value s and its argument x."""
    _refuse_unless(len(row) >= 2 and isinstance(row[0], str), f"{where} has no kind and kink")
    kind, n = row[0], _index(row[1], len(stated.kinks), where)
    ends = [_number(end, where) for end in row[2:]]
    kink, (x, low, high) = stated.kinks[n], arguments[n]
    known = {(False, "above"): 0, (False, "chord"): 2, (True, "low"): 1, (True, "high"): 1, (False, "side"): 0}
    _refuse_unless(
        known.get((kink.sign, kind)) == len(ends), f"{where}: {kind!r} with {len(ends)} ends is no row of this kink"
    )
    if kind == "side":
        _refuse_unless(n in stated.chosen and stated.chosen[n] == sides.get(n), f"{where}: no part chooses this side")
        return _combined(x, sides[n], kink.variable, 0, 0)
    if kind == "above":
        return _combined(x, -1, kink.variable, 1, 0)
    if kind in ("chord", "low"):
        _refuse_unless(ends[0] <= min(low, 0), f"{where}: the box does not keep the argument from below it")
    if kind in ("chord", "high"):
        _refuse_unless(ends[-1] >= max(high, 0), f"{where}: the box does not keep the argument from above it")
    if kind == "chord":
        least, most = ends
        return _combined(x, most, kink.variable, least - most, -most * least)
    (end,) = ends
    return _combined(x, 2, kink.variable, end, -end) if kind == "low" else _combined(x, -2, kink.variable, end, end)


def _combined(x: Polynomial, a: Fraction | int, s: int, b: Fraction | int, c: Fraction | int) -> Polynomial:
    """Return ``a x + b s + c``."""
    total = {m: value * a for m, value in x.mid.items()}
    _add(total, {(s,): Fraction(b), (): Fraction(c)})
    return Polynomial(total, {m: value * abs(Fraction(a)) for m, value in x.rad.items()})


def _with_values(polynomial: Polynomial, values: dict[int, Polynomial]) -> Polynomial:
    """Put polynomials in the place of variables."""
    if not any(v in values for m in polynomial.monomials for v in m):
        return polynomial
    mid: dict[Monomial, Fraction] = {}
    rad: dict[Monomial, Fraction] = {}
    for m in polynomial.monomials:
        radius = polynomial.rad.get(m, Fraction(0))
        rest = tuple(v for v in m if v not in values)
        term = Polynomial({rest: polynomial.mid.get(m, Fraction(0))}, {rest: radius} if radius else {})
        for v in m:
            if v in values:
                term = _multiply(term, values[v])
        _add(mid, term.mid)
        _add(rad, term.rad)
    return Polynomial(mid, rad)


def _range(polynomial: Polynomial, box: Box) -> tuple[Extended, Extended]:
    """Return the ends of a polynomial over a box, monomial by monomial."""
    low: Extended = Fraction(0)
    high: Extended = Fraction(0)
    for m in polynomial.monomials:
        mid, rad = polynomial.mid.get(m, Fraction(0)), polynomial.rad.get(m, Fraction(0))
        ends: tuple[Extended, Extended] = (mid - rad, mid + rad)
        for v in m:
            lower, upper = box[v]
            own: tuple[Extended, Extended] = (-inf if lower is None else lower, inf if upper is None else upper)
            products = [_times(a, b) for a in ends for b in own]
            ends = min(products), max(products)
        low = -inf if -inf in (low, ends[0]) else low + ends[0]
        high = inf if inf in (high, ends[1]) else high + ends[1]
    return low, high


def _times(a: Extended, b: Extended) -> Extended:
    if not a or not b:
        return Fraction(0)  # an infinite end is none: all numbers up to there are finite
    if isinstance(a, Fraction) and isinstance(b, Fraction):
        return a * b
    return inf if (a > 0) == (b > 0) else -inf


def _alone(objective: Polynomial) -> tuple[int, Fraction] | None:
    """Return variable and slope of an objective that is a multiple of one variable."""
    monomials = objective.monomials
    if len(monomials) != 1 or objective.rad:
        return None
    (monomial,) = monomials
    return (monomial[0], objective.mid[monomial]) if len(monomial) == 1 else None


def _box_says(objective: Polynomial, box: Box) -> list[Fraction]:
    """Return the bound that the box itself has for an objective that is a multiple of one variable."""
    single = _alone(objective)
    if single is None:
        return []
    end = box[single[0]][0 if single[1] > 0 else 1]
    return [] if end is None else [single[1] * end]


def _check_cover(parts: list[tuple[int, Fraction, Fraction]], where: str, stated: Stated, box: Box) -> None:
    _refuse_unless(len({v for v, *_ in parts}) == 1, f"{where}: the parts are not in one variable")
    v = parts[0][0]
    reached, upper = box[v]
    if reached is None or upper is None:
        raise Refused(f"{where}: {stated.names[v]} has no finite box that parts could cover")
    for _, low, high in sorted(parts):
        _fails_unless(
            low, reached, f"{where}: the parts cover the box: lower end <= upper end before it", stated.names[v]
        )
        reached = max(reached, high)
    _fails_unless(upper, reached, f"{where}: the parts cover the box: upper <= last upper end", stated.names[v])


def _check_quotient(quotient: Any, where: str, stated: Stated, box: Box, proven: list[Proven]) -> list[Proven]:
    row = stated.constraint("equality", _get(quotient, "equality", where), where)
    x = _index(_get(quotient, "variable", where), len(stated.names), where)
    name = stated.names[x]
    divisor = Polynomial({}, {})
    largest = Fraction(0)
    for m in row.monomials:
        mid, rad = row.mid.get(m, Fraction(0)), row.rad.get(m, Fraction(0))
        if x in m:
            rest = tuple(v for v in m if v != x)
            _refuse_unless(len(rest) == len(m) - 1, f"{where}: the equality is not affine in {name}")
            _add(divisor.mid, {rest: mid})
            _add(divisor.rad, {rest: rad} if rad else {})
            continue
        largest += (abs(mid) + rad) * _size(m, {v: _ends(v, where, stated, box) for v in m})
    opposite = Polynomial({m: -value for m, value in divisor.mid.items()}, divisor.rad)
    if divisor.monomials <= {()}:
        away = abs(divisor.mid.get((), Fraction(0))) - divisor.rad.get((), Fraction(0))
    else:
        away = max((p.bound for p in proven if p.objective in (divisor, opposite)), default=Fraction(0))
    _refuse_unless(away > 0, f"{where}: no step before it keeps what {name} is multiplied by from zero")
    return [
        Proven(where, Polynomial({(x,): sign}, {}), -largest / away, -largest / away)
        for sign in (Fraction(1), Fraction(-1))
    ]


def _check_reach(reach: Any, where: str, stated: Stated, box: Box) -> list[Proven]:
    count = len(stated.names)
    sizes: dict[int, Fraction] = {}
    for entry in _list(_get(reach, "variables", where), f"{where}, variables"):
        k, size = _list(entry, f"{where}, variables", 2)
        sizes[_index(k, count, where)] = _number(size, where)
    for k, size in sizes.items():
        _refuse_unless(size > 0, f"{where}: size > 0 fails for {stated.names[k]}: {_shown(size)}")
    riding = [_index(v, count, where) for v in _list(_get(reach, "riding", where), f"{where}, riding")]
    cone, ends = _homogenised(stated, box, sizes, riding, where)
    faces = _list(_get(reach, "faces", where), f"{where}, faces")
    largest = Fraction(1)
    for k in sizes:
        for side in (1, -1):
            if ends[k][(1 + side) // 2] == 0:
                continue
            inside = f"{where}, face {stated.names[k]} = {side}"
            own = [f for f in faces if _get(f, "variable", where) == k and _get(f, "side", where) == side]
            _refuse_unless(len(own) == 1, f"{inside} occurs {len(own)} times, not once")
            face = [list(pair) for pair in ends]
            face[k] = [Fraction(side), Fraction(side)]
            steps = _list(_get(own[0], "steps", inside), inside)
            _, empty = _check_steps(steps, f"{inside}, ", cone, face)
            least = face[count][0] or Fraction(0)
            if not empty:
                _refuse_unless(least > 0, f"{inside}: s > 0 is not proven: {_shown(least)}")
                largest = max(largest, 1 / least)
    return [
        Proven(where, Polynomial({(k,): sign}, {}), -size * largest, -size * largest)
        for k, size in sizes.items()
        for sign in (Fraction(1), Fraction(-1))
    ]


def _homogenised(
    stated: Stated, box: Box, sizes: dict[int, Fraction], riding: list[int], where: str
) -> tuple[Stated, Box]:
    """Return the constraints times s, in y and s, and their box."""
    s = len(stated.names)
    ends = [list(pair) for pair in box]
    for k in sizes:
        lower, upper = box[k]
        ends[k] = [
            Fraction(0 if lower is not None and lower >= 0 else -1),
            Fraction(0 if upper is not None and upper <= 0 else 1),
        ]
    cone: list[list[Polynomial]] = [[], []]
    for v in riding:
        lower, upper = box[v]
        if v in sizes or lower is None or upper is None:
            raise Refused(f"{where}: {stated.names[v]} has no box to ride along with")
        ends[v] = [min(lower, Fraction(0)), max(upper, Fraction(0))]
        cone[0].append(Polynomial({(s,): upper, (v,): Fraction(-1)}, {}))
        cone[1].append(Polynomial({(s,): -lower, (v,): Fraction(1)}, {}))
    moved = {*sizes, *riding}

    def times_s(row: Polynomial | None) -> Polynomial | None:
        if row is None:
            return None
        most = max((sum(v in moved for v in m) for m in row.monomials), default=0)
        if most == 0:
            return row
        if most > 1:
            return None

        def part(terms: dict[Monomial, Fraction]) -> dict[Monomial, Fraction]:
            found = {}
            for m, value in terms.items():
                own = next((v for v in m if v in moved), None)
                found[(*m, s) if own is None else m] = value if own is None else value * sizes.get(own, Fraction(1))
            return found

        return Polynomial(part(row.mid), part(row.rad))

    return Stated(
        [*stated.names, "s"],
        [times_s(row) for row in stated.equalities],
        [*(times_s(row) for row in stated.inequalities), *cone[0], *cone[1]],
        stated.cuts,
        [],
        {},
    ), [*ends, [Fraction(0), Fraction(1)]]


def _check_bound(step: Any, where: str, stated: Stated, box: Box) -> Proven:
    names, count = stated.names, len(stated.names)
    objective = _polynomial(_get(step, "objective", where), count, f"{where}, objective")
    bound = _number(_get(step, "bound", where), f"{where}, bound")
    centre, scale = (
        [_number(v, f"{where}, {key}") for v in _list(_get(step, key, where), f"{where}, {key}", count)]
        for key in ("centre", "scale")
    )

    residual = _substitute(objective, centre, scale)
    scaled: dict[tuple[str, int], Polynomial] = {}

    def constraint(kind: str, k: Any, place: str) -> Polynomial:
        given = stated.constraint(kind, k, place)
        if (kind, k) not in scaled:
            scaled[kind, k] = _substitute(given, centre, scale)
        return scaled[kind, k]

    for j, entry in enumerate(_list(_get(step, "equalities", where), f"{where}, equalities")):
        place = f"{where}, multiplier {j}"
        k, terms = _list(entry, place, 2)
        multiplier: dict[Monomial, Fraction] = {}
        for term in _list(terms, place):
            value, variables = _list(term, place, 2)
            _add(multiplier, {_monomial(variables, count, place): _number(value, place)})
        _subtract(residual, _multiply(constraint("equality", k, place), Polynomial(multiplier, {})))

    bounded: set[int] = set()  # the variables whose box is made use of

    for j, entry in enumerate(_list(_get(step, "products", where), f"{where}, products")):
        place = f"{where}, product {j}"
        weight = _number(_get(entry, "weight", place), place)
        _refuse_unless(weight >= 0, f"{place}: weight >= 0 fails: {_shown(weight)}")
        basis = [_monomial(m, count, place) for m in _list(_get(entry, "basis", place), place)]
        factor = [
            [_number(value, place) for value in _list(row, place)]
            for row in _list(_get(entry, "factor", place), f"{place}, factor", len(basis))
        ]
        _refuse_unless(len({len(row) for row in factor}) <= 1, f"{place}: the factor's rows differ in length")
        square = _sum_of_squares(basis, factor)
        total = Polynomial({m: weight * value for m, value in square.items()}, {})
        for part in _list(_get(entry, "of", place), place):
            kind, k = _list(part, place, 2)
            if kind == "inequality":
                total = _multiply(constraint(kind, k, place), total)
            else:
                total = _multiply(_box_factor(kind, _index(k, count, place), place), total)
                bounded.add(k)
        _subtract(residual, total)

    monomials = residual.monomials - {()}
    for k in sorted(bounded.union(*monomials)):
        lower, upper = box[k]
        if lower is None or upper is None:
            raise Refused(f"{where}: {names[k]} has no finite box, so its powers are not bounded")
        _refuse_unless(scale[k] >= 0, f"{where}: scale >= 0 fails for {names[k]}: {_shown(scale[k])}")
        _fails_unless(centre[k] - scale[k], lower, f"{where}: centre - scale <= lower", names[k])
        _fails_unless(upper, centre[k] + scale[k], f"{where}: upper <= centre + scale", names[k])
    return _proven(where, objective, bound, residual)


def _proven(where: str, objective: Polynomial, bound: Fraction, residual: Polynomial) -> Proven:
    """Return a theorem whose objective exceeds a polynomial in t, with all of t in [-1, 1]."""
    recomputed = residual.mid.get((), Fraction(0)) - residual.rad.get((), Fraction(0))
    for m in residual.monomials - {()}:
        recomputed -= abs(residual.mid.get(m, Fraction(0))) + residual.rad.get(m, Fraction(0))
    if bound > recomputed:
        raise Refused(f"{where}: bound <= r_0 - sum |r_i| fails: {_shown(bound)} > {_shown(recomputed)}")
    return Proven(where, objective, bound, recomputed)


@dataclass(frozen=True)
class _Split:
    """A cut by inner variables, -1 for none: terms in the outer ones, whole numbers over one denominator.

    The radii of the coefficients stand apart, with the monomials in all variables.
    """

    parts: dict[int, list[tuple[Monomial, int]]]
    denominator: int
    rad: dict[Monomial, Fraction]

    @cached_property
    def variables(self) -> set[int]:
        """Return the inner variables, and all of the coefficients that are not exact."""
        return {v for v in self.parts if v >= 0}.union(*self.rad)

    @staticmethod
    def of(stated: Stated, multipliers: Any, outer: frozenset[int], where: str) -> _Split:
        mid: dict[Monomial, Fraction] = {}
        rad: dict[Monomial, Fraction] = {}
        for kind, plural in (("equality", "equalities"), ("inequality", "inequalities")):
            for pair in _list(_get(multipliers, plural, where), f"{where}, {plural}"):
                k, value = _list(pair, f"{where}, {plural}", 2)
                weight = _number(value, where)
                _refuse_unless(kind == "equality" or weight >= 0, f"{where}: multiplier >= 0 fails: {_shown(weight)}")
                row = stated.constraint(kind, k, where)
                _add(mid, {m: weight * coefficient for m, coefficient in row.mid.items()})
                _add(rad, {m: abs(weight) * radius for m, radius in row.rad.items()})
        denominator = lcm(*(value.denominator for value in mid.values()))
        parts: dict[int, list[tuple[Monomial, int]]] = {}
        for m, value in mid.items():
            inner = [v for v in m if v not in outer]
            _refuse_unless(len(inner) <= 1, f"{where} is not affine in the inner variables")
            own = tuple(v for v in m if v in outer)
            whole = value.numerator * (denominator // value.denominator)
            parts.setdefault(inner[0] if inner else -1, []).append((own, whole))
        return _Split(parts, denominator, rad)


def _ends(v: int, where: str, stated: Stated, box: Box) -> tuple[Fraction, Fraction]:
    lower, upper = box[v]
    if lower is None or upper is None:
        raise Refused(f"{where}: {stated.names[v]} has no finite box")
    return lower, upper


def _check_cuts(step: Any, where: str, stated: Stated, box: Box) -> Proven:
    count = len(stated.names)
    objective = _polynomial(_get(step, "objective", where), count, f"{where}, objective")
    bound = _number(_get(step, "bound", where), f"{where}, bound")
    outer = frozenset(_monomial(_get(step, "outer", where), count, f"{where}, outer"))
    _refuse_unless(
        outer.issuperset(v for m in objective.monomials for v in m), f"{where}: the objective holds an inner variable"
    )
    middle, radius = [Fraction(0)] * count, [Fraction(0)] * count
    for v in outer:
        low, high = _ends(v, where, stated, box)
        middle[v], radius[v] = (low + high) / 2, (high - low) / 2
    residual = _substitute(objective, middle, radius)
    for pair in _list(step["weights"], f"{where}, weights"):
        number, value = _list(pair, f"{where}, weights", 2)
        weight = _number(value, where)
        _refuse_unless(weight >= 0, f"{where}: weight >= 0 fails: {_shown(weight)}")
        split = stated.cut(number, outer, where)
        ends = {v: _ends(v, where, stated, box) for v in split.variables}
        _add(residual.mid, {m: weight * c for m, c in _chords(split, middle, radius, ends).items()}, -1)
        unknown = sum((rad * _size(m, ends) for m, rad in split.rad.items()), Fraction(0))
        _add(residual.rad, {(): weight * unknown})
    return _proven(where, objective, bound, residual)


def _chords(
    split: _Split, middle: list[Fraction], radius: list[Fraction], ends: dict[int, tuple[Fraction, Fraction]]
) -> dict[Monomial, Fraction]:
    """Return a polynomial in t, where the outer variables are ``middle + radius t``, that is no less than a cut."""
    # Whole numbers over one denominator, as there are many.
    used = {m for terms in split.parts.values() for m, _ in terms}
    expanded = {m: _substitute(Polynomial({m: Fraction(1)}, {}), middle, radius).mid for m in used}
    monomials = sorted({key for own in expanded.values() for key in own} | {()}, key=len)
    unit = lcm(*(value.denominator for own in expanded.values() for value in own.values()))
    rows = {m: [int(unit * own.get(key, 0)) for key in monomials] for m, own in expanded.items()}
    wide = lcm(*(end.denominator for t in split.parts if t >= 0 for end in ends[t]))
    total, one = [0] * len(monomials), 1 << 53
    for t, terms in split.parts.items():
        own = [sum([value * rows[m][i] for m, value in terms]) for i in range(len(monomials))]
        factor = 2 * wide * one
        if t >= 0:
            low, high = (end.numerator * (wide // end.denominator) for end in ends[t])
            reach = sum(map(abs, own[1:]))
            above, below = max(own[0] + reach, 0), max(reach - own[0], 0)
            share = one * (above - below) // (above + below) if above + below else 0
            factor = (high + low) * one + (high - low) * share
            total[0] += (high - low) * max((one - share) * above, (one + share) * below)
        for i, value in enumerate(own):
            total[i] += factor * value
    whole = 2 * split.denominator * unit * wide * one
    return {m: Fraction(n, whole) for m, n in zip(monomials, total, strict=True)}


def _size(monomial: Monomial, ends: dict[int, tuple[Fraction, Fraction]]) -> Fraction:
    return prod((max(abs(ends[v][0]), abs(ends[v][1])) for v in monomial), start=Fraction(1))


def _box_factor(kind: Any, v: int, where: str) -> Polynomial:
    one = Fraction(1)
    if kind == "above":
        return Polynomial({(): one, (v,): one}, {})
    if kind == "below":
        return Polynomial({(): one, (v,): -one}, {})
    if kind == "inside":
        return Polynomial({(): one, (v, v): -one}, {})
    raise Refused(f"{where}: {kind!r} is none of 'inequality', 'above', 'below', 'inside'")


def _subtract(residual: Polynomial, part: Polynomial) -> None:
    _add(residual.mid, part.mid, -1)
    _add(residual.rad, part.rad)


def _fails_unless(left: Fraction, right: Fraction, inequality: str, name: str) -> None:
    if left > right:
        raise Refused(f"{inequality} fails for {name}: {_shown(left)} > {_shown(right)}")


def _may_vanish(ends: list[Fraction | None]) -> bool:
    lower, upper = ends
    return (lower is None or lower <= 0) and (upper is None or upper >= 0)


def _settle(box: Box, stated: Stated) -> bool:
    """Fix at zero the only variable of a vanishing product that can be, and say whether the box is empty."""
    products = stated.vanishing.values()
    for _ in range(len(products) + 1):
        before = [list(ends) for ends in box]
        for product in products:
            able = [v for v in product if _may_vanish(box[v])]
            if not able:
                return True
            if len(able) == 1:
                box[able[0]] = [Fraction(0), Fraction(0)]
        if box == before:
            break
    return any(lower is not None and upper is not None and lower > upper for lower, upper in box)


def _tighten(box: Box, proven: Proven) -> None:
    """Let ``c x_k >= bound`` narrow the box of x_k."""
    single = _alone(proven.objective)
    if single is None:
        return
    k, slope = single
    value = proven.bound / slope
    _narrow(box, k, *((value, inf) if slope > 0 else (-inf, value)))


# ---------------------------------------------------------------- the program


def _unique_keys(pairs: Iterable[tuple[str, Any]]) -> dict[str, Any]:
    result: dict[str, Any] = {}
    for key, value in pairs:
        if key in result:
            raise Refused(f"the key {key!r} occurs twice in one object")
        result[key] = value
    return result


def _no_decimal(text: str) -> Any:
    raise Refused(f"{text} is a decimal: write a float in hexadecimal, a fraction or a whole number")


def read(path: str | Path) -> Any:
    """Return the content of a certificate file.

    Parameters
    ----------
    path : str or Path

    Returns
    -------
    object
        For :func:`check`, which judges it.

    Raises
    ------
    Unreadable
        When there is no such file, or it is no JSON.
    Refused
        When it holds decimals or a key twice: their meaning is in doubt.

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     file = Path(folder) / "claim.json"
    ...     written = file.write_text('{"bound": -0.25}', encoding="utf-8")
    ...     read(file)
    Traceback (most recent call last):
    relaxations.check.Refused: -0.25 is a decimal: write a float in hexadecimal, a fraction or a whole number
    """
    try:
        text = Path(path).read_text(encoding="utf-8")
        return json.loads(text, object_pairs_hook=_unique_keys, parse_float=_no_decimal, parse_constant=_no_decimal)
    except OSError as error:
        raise Unreadable(f"{path}: {error.strerror}") from None
    except (ValueError, RecursionError) as error:
        raise Unreadable(f"{path} is no JSON: {error}") from None


def _shown(value: Fraction, digits: int = 15) -> str:
    """Return a decimal that is rounded down: what is printed as a bound is one."""
    context = Context(prec=digits, rounding=ROUND_FLOOR)
    return format(context.divide(Decimal(value.numerator), Decimal(value.denominator)).normalize(context), "g")


def _written(polynomial: Polynomial, names: list[str]) -> str:
    monomials = sorted(polynomial.monomials, key=lambda m: (-len(m), m))
    if len(monomials) > 6:
        return f"the objective ({len(monomials)} terms)"
    terms = []
    for m in monomials:
        value = polynomial.mid.get(m, Fraction(0))
        factors = [names[v] for v in m]
        if abs(value) != 1 or not factors:
            factors.insert(0, _shown(abs(value), 6))
        terms.append(("- " if value < 0 else "+ ") + "*".join(factors))
    text = " ".join(terms).removeprefix("+ ")
    return text.replace("- ", "-", 1) if text.startswith("- ") else text or "0"


def main(arguments: list[str]) -> int:
    """Check one file and print what it proves.

    Parameters
    ----------
    arguments : list of str
        The file's path alone, or ``--help``.

    Returns
    -------
    int
        The exit code: 0 accepted, 1 refused, 2 unreadable or called wrongly.

    Examples
    --------
    >>> import tempfile
    >>> step = {"objective": [[1, 0, [0, 0]], [-1, 0, [0]]], "bound": "-1/4", "centre": [1], "scale": [1],
    ...         "equalities": [], "products": [{"of": [], "weight": 1, "basis": [[], [0]], "factor": [["1/2"], [1]]}]}
    >>> document = {"format": "relaxations certificate", "version": 1, "variables": ["x"], "box": [[0, 2]],
    ...             "equalities": [], "inequalities": [], "steps": [step]}
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     file = Path(folder) / "claim.json"
    ...     written = file.write_text(json.dumps(document), encoding="utf-8")
    ...     main([str(file)])
    accepted: 1 variables in their box, 0 equalities, 0 inequalities
    step 1: x*x - x >= -0.25 (recomputed: -0.25)
    0
    """
    if len(arguments) != 1 or arguments[0] in ("-h", "--help"):
        print("usage: python -m relaxations.check FILE\nexit codes: 0 accepted, 1 refused, 2 unreadable")
        return EXIT_ACCEPTED if arguments[:1] in (["-h"], ["--help"]) else EXIT_UNREADABLE
    try:
        document = read(arguments[0])
        proven = check(document)
    except Unreadable as error:
        print(f"unreadable: {error}", file=sys.stderr)
        return EXIT_UNREADABLE
    except Refused as error:
        print(f"refused: {error}", file=sys.stderr)
        return EXIT_REFUSED
    names = document["variables"]
    print(
        f"accepted: {len(names)} variables in their box, {len(document['equalities'])} equalities, "
        f"{len(document['inequalities'])} inequalities"
    )
    for theorem in proven:
        margin = f"(recomputed: {_shown(theorem.recomputed)})"
        if theorem.empty:
            print(f"{theorem.step}: no point satisfies all constraints: 0 >= {_shown(theorem.bound)} {margin}")
        else:
            print(f"{theorem.step}: {_written(theorem.objective, names)} >= {_shown(theorem.bound)} {margin}")
    return EXIT_ACCEPTED


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
