"""A model's equations in MathML, which browsers show without any script."""

from __future__ import annotations

import math
from html import escape

import sympy
from sympy.printing.mathml import mathml

from smid.models import Model, Parameter
from smid.models.parts import Measurement
from smid.models.symbols import VALUE, signal, t


def equations(model: Model) -> list[str]:
    """Return the lines and measurements of a model as rows of MathML.

    Examples
    --------
    >>> from smid.models import OutputError
    >>> rows = equations(OutputError())
    >>> len(rows), rows[0][:6]
    (2, '<math>')
    """
    rows = [_relation(line.target, "=", line.expression) for line in model.lines]
    return rows + [_measurement(m) for m in model.measurements]


def priors(model: Model) -> list[str]:
    """Return the boxes of the parameters and the constraints as rows of MathML.

    Examples
    --------
    >>> from smid.models import OutputError
    >>> len(priors(OutputError(na=2, stable=True)))
    5
    """
    return [_box(p) for p in model.parameters] + [_relation(c, "≥", sympy.Integer(0)) for c in model.constraints]


def symbol(name: str) -> str:
    """Return a parameter's name as MathML: Greek letters and indices are shown as such.

    Examples
    --------
    >>> symbol("gamma1")
    '<math><msub><mi>&#947;</mi><mi>1</mi></msub></math>'
    """
    return f"<math>{_content(sympy.Symbol(name))}</math>"


def _content(expression: sympy.Expr) -> str:
    # Without a space a number and a name of several letters run into each other.
    return str(mathml(expression, printer="presentation")).replace(
        "<mo>&InvisibleTimes;</mo>", "<mspace width='0.17em'/>"
    )


def _relation(left: sympy.Expr, sign: str, right: sympy.Expr) -> str:
    return f"<math>{_content(left)}<mo>{sign}</mo>{_content(right)}</math>"


def _measurement(m: Measurement) -> str:
    channel, shown = signal(m.channel)[t], signal(m.signal)[t]
    noise = signal(m.noise)[t] if m.noise else sympy.Integer(0)
    if m.inverse is not None:
        return _relation(shown, "=", m.inverse.xreplace({VALUE: channel - noise}))
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
