"""The equations of a model for display: plain text, LaTeX and HTML."""

from __future__ import annotations

import html
import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import sympy

from smid.models.expressions import decimals, shown
from smid.models.parts import Measurement, Parameter
from smid.models.symbols import VALUE, signal, t

if TYPE_CHECKING:
    from smid.models.model import Model

__all__ = ["Equations"]


@dataclass(frozen=True)
class Equations:
    """Printable equations of a model.

    Attributes
    ----------
    title
        Name and description of the model.
    text
        One plain-text entry per equation, measurement, prior and parameter.
    rows
        The same in LaTeX, without delimiters.

    Examples
    --------
    >>> from smid.models import OutputError
    >>> print(OutputError(1, 0).equations())
    output error
      w[t] = -a1*w[t - 1] + b0*u[t - 1]
      y[t] = w[t] + eta[t]
      a1 free
      b0 free
    """

    title: str
    text: tuple[str, ...]
    rows: tuple[str, ...]

    @staticmethod
    def of(model: Model) -> Equations:
        """Collect the equations of a model.

        Parameters
        ----------
        model
            The model to show.
        """
        text = [str(line) for line in model.lines]
        rows = [
            ("\\frac{d}{dt} " if line.rate else "") + f"{_latex(line.target)} &= {_latex(line.expression)}"
            for line in model.lines
        ]
        text += [str(measurement) for measurement in model.measurements]
        rows += [_measurement_row(measurement) for measurement in model.measurements]
        text += [f"{shown(constraint)} >= 0" for constraint in model.constraints]
        rows += [f"{_latex(constraint)} &\\ge 0" for constraint in model.constraints]
        text += [_box(parameter) + _value(model, parameter) for parameter in model.parameters]
        rows += [_box_row(parameter) for parameter in model.parameters]
        text += [f"{name}[t] in [{low:g}, {high:g}]" for name, (low, high) in model.bounds.items()]
        rows += [f"{_latex(signal(n)[t])} &\\in [{low:g}, {high:g}]" for n, (low, high) in model.bounds.items()]
        if any(line.rate for line in model.lines):
            text.append(_integration(model))
            rows.append(f"&\\text{{{_integration(model)}}}")
        title = f"{model.name}: {model.description}" if model.description else model.name
        return Equations(title, tuple(text), tuple(rows))

    def __str__(self) -> str:
        return "\n  ".join((self.title, *self.text))

    def latex(self) -> str:
        r"""Return one ``aligned`` block, without math delimiters."""
        return "\\begin{aligned}\n" + " \\\\\n".join(self.rows) + "\n\\end{aligned}"

    def html(self) -> str:
        """Return an HTML fragment with the plain text, readable without a LaTeX renderer."""
        entries = "".join(f"<li><code>{html.escape(entry)}</code></li>" for entry in self.text)
        return f"<div><strong>{html.escape(self.title)}</strong><ul>{entries}</ul></div>"

    def _repr_latex_(self) -> str:
        return f"$\\displaystyle {self.latex()}$"


def _integration(model: Model) -> str:
    steps = "1 step" if model.substeps == 1 else f"{model.substeps} steps"
    interval = "" if model.sampling_time is None else f" of {model.sampling_time:g} s"
    how = "by rk4, the remainder enclosed" if model.enclosed else f"by {model.scheme}"
    return f"integrated {how}, {steps} per sample{interval}, inputs held"


def _latex(expression: sympy.Expr) -> str:
    return str(sympy.latex(decimals(expression)))


def _measurement_row(measurement: Measurement) -> str:
    channel = signal(measurement.channel)[t]
    noise = signal(measurement.noise)[t] if measurement.noise else sympy.Integer(0)
    shown = signal(measurement.signal)[t]
    if measurement.inverse is not None:
        return f"{_latex(shown)} &= {_latex(measurement.inverse.xreplace({VALUE: channel - noise}))}"
    return f"{_latex(channel)} &= {_latex(shown)}" + (f" + {_latex(noise)}" if measurement.noise else "")


def _box(parameter: Parameter) -> str:
    unit = f" {parameter.unit}" if parameter.unit else ""
    if math.isinf(parameter.lower) and math.isinf(parameter.upper):
        return f"{parameter.name} free" + (f", in{unit}" if unit else "")
    if math.isinf(parameter.upper):
        return f"{parameter.name} >= {parameter.lower:g}{unit}"
    if math.isinf(parameter.lower):
        return f"{parameter.name} <= {parameter.upper:g}{unit}"
    return f"{parameter.name} in [{parameter.lower:g}, {parameter.upper:g}]{unit}"


def _value(model: Model, parameter: Parameter) -> str:
    return f", = {model.values[parameter.name]:.8g}" if parameter.name in model.values else ""


def _box_row(parameter: Parameter) -> str:
    lower = "-\\infty" if math.isinf(parameter.lower) else f"{parameter.lower:g}"
    upper = "\\infty" if math.isinf(parameter.upper) else f"{parameter.upper:g}"
    unit = f"\\ \\text{{{parameter.unit}}}" if parameter.unit else ""
    brackets = ("(" if math.isinf(parameter.lower) else "[", ")" if math.isinf(parameter.upper) else "]")
    return f"{_latex(parameter.symbol)} &\\in {brackets[0]}{lower}, {upper}{brackets[1]}{unit}"
