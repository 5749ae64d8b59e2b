"""Units of a model: whether both sides of each equation, and all terms of each sum, have one unit.

A unit is a sympy expression in base units with an exact factor: ``cm/min`` is ``m/(6000 s)``. What is not known is not
checked: a parameter or signal without a unit, a unit that the table lacks, and a number that multiplies, because it may
stand for a conversion. The rate of a signal is its unit per second.
"""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Iterable, Mapping
from functools import lru_cache
from typing import TYPE_CHECKING

import sympy

from smid.models.errors import ModelError
from smid.models.expressions import from_text, shown
from smid.models.parts import Line, Measurement
from smid.models.symbols import VALUE

if TYPE_CHECKING:
    from smid.models.model import Model

__all__ = ["check_channel_units", "check_units", "conversion", "unit_of"]

_KG, _M, _S, _A, _K, _MOL = sympy.symbols("kg m s A K mol", positive=True)
_NEWTON = _KG * _M / _S**2
_PASCAL = _NEWTON / _M**2
_JOULE = _NEWTON * _M
_ONE = sympy.Integer(1)
_DEGREE = sympy.pi / 180

_SCALED: dict[str, sympy.Expr] = {
    **{"g": _KG / 1000, "m": _M, "s": _S, "A": _A, "K": _K, "mol": _MOL, "rad": _ONE},
    **{"N": _NEWTON, "Nm": _JOULE, "Pa": _PASCAL, "bar": 10**5 * _PASCAL, "J": _JOULE, "W": _JOULE / _S},
    **{"Wh": 3600 * _JOULE, "V": _JOULE / _S / _A, "Ohm": _JOULE / _S / _A**2, "Ω": _JOULE / _S / _A**2},
    **{"Hz": 1 / _S, "l": _M**3 / 1000, "L": _M**3 / 1000},
}
"""Units that take a prefix."""

_PREFIXES = {"n": -9, "μ": -6, "u": -6, "m": -3, "c": -2, "d": -1, "k": 3, "M": 6, "G": 9}

_UNITS: dict[str, sympy.Expr] = {
    **{
        prefix + name: sympy.Integer(10) ** power * unit
        for prefix, power in _PREFIXES.items()
        for name, unit in _SCALED.items()
    },
    **_SCALED,
    **{"min": 60 * _S, "h": 3600 * _S, "d": 86400 * _S, "t": 1000 * _KG, "rpm": 6 * _DEGREE / _S, "rev": 360 * _DEGREE},
    **{"degC": _K, "deg": _DEGREE, "percent": _ONE / 100, "ppm": _ONE / 10**6, "sample": _ONE, "samples": _ONE},
}

_CELSIUS = ("degC", "°C", "℃")
_RESULT_IS_NUMBER = (sympy.sign, sympy.exp, sympy.log, sympy.sin, sympy.cos, sympy.tan, sympy.sinh, sympy.cosh)
_SAME = (sympy.Add, sympy.Max, sympy.Min)


@lru_cache
def unit_of(text: str) -> sympy.Expr | None:
    """Return the unit that a text such as ``m3/s/V`` names; None where it is empty or not known.

    Examples
    --------
    >>> unit_of("cm/min"), unit_of("N m") == unit_of("kg·m²/s²"), unit_of("furlong")
    (m/(6000*s), True, None)
    """
    plain = unicodedata.normalize("NFKC", text.strip()).replace("\N{MINUS SIGN}", "-")
    for sign, name in (("°C", "degC"), ("°", "deg"), ("%", "percent"), ("·", "*"), ("⋅", "*"), ("^", ""), ("**", "")):
        plain = plain.replace(sign, name)
    plain = re.sub(r"(?<=[^\W\d_])-?\d+(\.\d+)?", lambda power: f"**({power[0]})", plain)
    plain = re.sub(r"\s+", "*", re.sub(r"\s*([*/])\s*", r"\1", plain))
    try:
        expression = from_text("1" if plain == "-" else plain)
    except ModelError:
        return None
    names = {symbol: _UNITS.get(symbol.name) for symbol in expression.free_symbols}
    if None in names.values() or expression.atoms(sympy.Indexed) or expression.is_Add:
        return None
    return expression.xreplace(names)


def conversion(given: str, wanted: str) -> float | None:
    """Return the factor that converts numbers from one unit to another; None where there is none.

    Degrees Celsius and kelvin differ by an offset, so there is no factor.

    Examples
    --------
    >>> conversion("bar", "kPa"), conversion("bar", "mm"), conversion("degC", "K")
    (100.0, None, None)
    """
    if given.strip() == wanted.strip():
        return 1.0
    known = unit_of(given), unit_of(wanted)
    if known[0] is None or known[1] is None:
        return None
    ratio = sympy.simplify(known[0] / known[1])
    celsius = [text.strip() in _CELSIUS for text in (given, wanted)]
    return float(ratio) if ratio.is_number and celsius[0] == celsius[1] else None


def check_channel_units(model: Model, units: Mapping[str, str]) -> None:
    """Refuse data whose channels are in other units than the model states.

    Parameters
    ----------
    units
        By channel of the data; an empty text is not known.

    Raises
    ------
    ModelError
        For the first channel whose unit differs.
    """
    for channel in model.channels:
        own, given = model.units.get(channel, ""), units.get(channel, "")
        if not own or not given or own == given:
            continue
        known = unit_of(own), unit_of(given)
        # Equal differences are not equal temperatures.
        if None in known or known[0] != known[1] or ("K" in (own, given)):
            raise ModelError(
                f"the channel {channel!r} is in {given} in the data, and in {own} in the model: convert the column, or "
                "change the units of the model, with its parameters"
            )


def check_units(model: Model, units: Mapping[str, str] | None = None) -> None:
    """Refuse a model with an equation whose terms or sides have different units.

    Parameters
    ----------
    units
        By channel of the data, beside those that the model states.

    Raises
    ------
    ModelError
        For the first equation that cannot be right; the message has the units.

    Examples
    --------
    >>> from smid.models import OwnModel
    >>> tank = OwnModel(["d/dt h = q/A - c*h"], {"y": "h"}, ["q"], {"A": {"range": 2, "unit": "m2"}, "c": [0, 1]})
    >>> check_units(tank, {"q": "m3/s", "y": "m"})
    >>> check_units(tank, {"q": "m3/min", "y": "m"})
    Traceback (most recent call last):
        ...
    smid.models.errors.ModelError: units: d/dt h[t] = -c*h[t] + q[t]/A has m/s on the left and m/(60*s) on the right...
    """
    shown_in = _known({**(units or {}), **model.units})
    # What an effect added is in the units of the effect.
    checked = _Units(shown_in | _known({p.name: p.unit for p in model.parameters if p.name not in model.origins}))
    for measurement in model.measurements:
        checked.measure(measurement, shown_in.get(measurement.channel))
    for line in model.lines:
        checked.line(line)
    for bound in model.constraints:
        checked.of(bound, f"{shown(bound)} >= 0")


def _known(units: Mapping[str, str]) -> dict[str, sympy.Expr]:
    found = {name: unit_of(text) for name, text in units.items()}
    return {name: unit for name, unit in found.items() if unit is not None}


class _Units:
    """The known units of parameters, channels and signals; a line adds that of its signal."""

    def __init__(self, known: dict[str, sympy.Expr]) -> None:
        self.known = known

    def measure(self, item: Measurement, unit: sympy.Expr | None) -> None:
        if item.inverse is not None:
            inside = _Units(self.known | ({} if unit is None else {VALUE.name: unit}))
            unit = inside.of(item.inverse, str(item))
        self._take(item.signal, unit, str(item))

    def line(self, line: Line) -> None:
        unit = self.of(line.expression, str(line))
        self._take(line.signal, unit, str(line), _S if line.rate else _ONE)

    def _take(self, name: str, unit: sympy.Expr | None, place: str, per: sympy.Expr = _ONE) -> None:
        """Take the unit for a signal, or compare it with the one that the signal has."""
        if unit is None:
            return
        left = self.known.setdefault(name, unit * per) / per
        if left != unit:
            raise _mismatch(place, f"has {left} on the left and {unit} on the right")

    def of(self, node: sympy.Expr, place: str) -> sympy.Expr | None:
        """Return the unit of an expression, None if it is not known."""
        if node.is_number:
            return _ONE if node in (1, -1) else None
        if isinstance(node, sympy.Indexed):
            return self.known.get(str(node.base.label))
        if isinstance(node, sympy.Symbol):
            return self.known.get(node.name)
        if isinstance(node, _SAME):
            return self._common(node.args, place)
        if isinstance(node, sympy.Piecewise):
            for pair in node.args:
                for relation in pair.cond.atoms(sympy.core.relational.Relational):
                    self._common(relation.args, place)
            return self._common([pair.expr for pair in node.args], place)
        if isinstance(node, sympy.Pow) and node.exp.is_Rational:
            base = self.of(node.base, place)
            return None if base is None else base**node.exp
        units = [self.of(argument, place) for argument in node.args]
        if isinstance(node, sympy.Mul):
            return None if None in units else sympy.Mul(*units)
        if isinstance(node, sympy.Abs):
            return units[0]
        if isinstance(node, _RESULT_IS_NUMBER):
            if not isinstance(node, sympy.sign) and units[0] not in (None, _ONE):
                raise _mismatch(place, f"has {shown(node)} of a quantity in {units[0]}")
            return _ONE
        return None

    def _common(self, terms: Iterable[sympy.Expr], place: str) -> sympy.Expr | None:
        """Return the unit of terms that are added or compared; a number has the unit of the others."""
        units = {term: self.of(term, place) for term in terms if not term.is_number}
        known = [(term, unit) for term, unit in units.items() if unit is not None]
        for term, unit in known[1:]:
            if unit != known[0][1]:
                first = f"{shown(known[0][0])} in {known[0][1]}"
                raise _mismatch(place, f"adds or compares {first} and {shown(term)} in {unit}")
        return known[0][1] if known else None


def _mismatch(place: str, what: str) -> ModelError:
    return ModelError(
        f"units: {place} {what}: correct a unit, or multiply by a parameter that converts, such as "
        'k = { range = 100, unit = "cm/m" }'
    )
