"""A model's equations in MathML, which browsers show without a script."""

from __future__ import annotations

import math
import re
from collections.abc import Collection
from html import escape
from typing import Any
from xml.dom.minidom import Element

import sympy
from sympy.printing.mathml import MathMLPresentationPrinter
from sympy.printing.pretty.pretty_symbology import greek_letters

from smid.models import Model, Parameter
from smid.models.expressions import decimals, shown
from smid.models.parts import Line, Measurement
from smid.models.symbols import VALUE, signal, t

_DIGITS = 6
_LINE = 60  # characters of a formula that fit on one line of a page


class _Printer(MathMLPresentationPrinter):  # type: ignore[misc]
    """A printer that marks new parameters with a class, and shortens numbers to six digits."""

    def __init__(self, new: Collection[str]) -> None:
        super().__init__()
        self._new = new

    def _print_Symbol(self, symbol: sympy.Symbol, style: str = "plain") -> Element:
        element: Element = super()._print_Symbol(symbol, style)
        # Only letters take an index: a name of words stays as charts and text write it.
        if re.match(r"[A-Za-z]{2,}_", symbol.name) and element.tagName != "mi" and not _is_greek(symbol.name):
            element = self.dom.createElement("mi")
            element.appendChild(self.dom.createTextNode(symbol.name))
        if symbol.name in self._new:
            element.setAttribute("class", "new")
        return element

    def _print_Float(self, value: sympy.Float) -> Any:
        return super()._print_Float(sympy.Float(value, _DIGITS))


def _is_greek(name: str) -> bool:
    return name.partition("_")[0].rstrip("0123456789").lower() in greek_letters


def equations(model: Model, new: Collection[str] = ()) -> list[str]:
    """Return the lines and measurements of a model as rows of MathML, with the parameters ``new`` highlighted.

    Examples
    --------
    >>> from smid.models import OutputError
    >>> equations(OutputError(), ["b0"])[0].count('class="new"')
    1
    """
    return [_line(line, new) for line in model.lines] + [_measurement(m, new) for m in model.measurements]


def priors(model: Model) -> list[str]:
    """Return the constraints and the boxes of the parameters as rows of MathML."""
    return [_relation(c, "≥", sympy.Integer(0)) for c in model.constraints] + [_box(p) for p in model.parameters]


def symbol(name: str, new: Collection[str] = ()) -> str:
    """Return a parameter's name as MathML, with Greek letters and indices.

    Examples
    --------
    >>> symbol("gamma1")
    '<math><msub><mi>&#947;</mi><mi>1</mi></msub></math>'
    """
    return f"<math>{_content(sympy.Symbol(name), new)}</math>"


def _content(expression: sympy.Expr, new: Collection[str] = ()) -> str:
    # Without a space a number and a name of several letters run into each other.
    return str(_Printer(new).doprint(decimals(expression))).replace(
        "<mo>&InvisibleTimes;</mo>", "<mspace width='0.17em'/>"
    )


def _relation(left: sympy.Expr, sign: str, right: sympy.Expr, new: Collection[str] = ()) -> str:
    return _sum(f"{_content(left)}<mo>{sign}</mo>", right, new)


def _sum(head: str, expression: sympy.Expr, new: Collection[str]) -> str:
    """Return each term as a formula of its own, because a browser breaks lines only between formulas."""
    first, *others = expression.as_ordered_terms() if len(shown(expression)) > _LINE else [expression]
    rows = [f"<math>{head}{_content(first, new)}</math>"]
    for term in others:
        negative = term.could_extract_minus_sign()
        sign = f'<mo form="infix">{"−" if negative else "+"}</mo>'
        rows.append(f"<math>{sign}{_content(-term if negative else term, new)}</math>")
    return " ".join(rows)


def _line(line: Line, new: Collection[str]) -> str:
    if line.rate:
        name = _content(sympy.Symbol(line.signal))
        derivative = f"<mfrac><mrow><mi>d</mi>{name}</mrow><mrow><mi>d</mi><mi>t</mi></mrow></mfrac>"
        return _sum(f"{derivative}<mo>=</mo>", line.expression, new)
    return _relation(line.target, "=", line.expression, new)


def _measurement(m: Measurement, new: Collection[str]) -> str:
    channel, shown = signal(m.channel)[t], signal(m.signal)[t]
    noise = signal(m.noise)[t] if m.noise else sympy.Integer(0)
    if m.inverse is not None:
        return _relation(shown, "=", m.inverse.xreplace({VALUE: channel - noise}), new)
    end = f"<mo>+</mo>{_content(noise)}" if m.noise else ""
    return f"<math>{_content(channel)}<mo>=</mo>{_content(shown)}{end}</math>"


def _box(p: Parameter) -> str:
    unit = f"<mspace width='0.3em'/><mtext>{escape(p.unit)}</mtext>" if p.unit else ""
    if math.isinf(p.lower) and math.isinf(p.upper):
        return f"<math>{_content(p.symbol)}<mo>∈</mo><mi>ℝ</mi>{unit}</math>"
    opening, closing = ("(" if math.isinf(p.lower) else "["), (")" if math.isinf(p.upper) else "]")
    ends = f"{_number(p.lower)}<mo>,</mo>{_number(p.upper)}"
    return f"<math>{_content(p.symbol)}<mo>∈</mo><mo>{opening}</mo>{ends}<mo>{closing}</mo>{unit}</math>"


def _number(value: float) -> str:
    sign = "<mo>−</mo>" if value < 0 else ""
    return f"{sign}<mn>{'∞' if math.isinf(value) else f'{abs(value):g}'}</mn>"
