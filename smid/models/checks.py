"""Checks of a model: one meaning per name, no unknown symbol, a known scheme."""

from __future__ import annotations

import math
from collections import Counter
from typing import TYPE_CHECKING

import sympy

from smid.models.discretise import SCHEMES
from smid.models.errors import ModelError, refuse_unknown
from smid.models.expressions import shown
from smid.models.structure import exogenous
from smid.models.symbols import VALUE, plain_symbols

if TYPE_CHECKING:
    from smid.models.model import Model

__all__ = ["check_integration", "check_names", "check_symbols"]


def check_names(model: Model) -> None:
    """Refuse a name that stands for two things, apart from a channel with the name of a parameter.

    Without noise, several signals may be readings of one channel, also of one that shows another signal with noise: a
    predictor reads the measured output.
    """
    parameters = {parameter.name for parameter in model.parameters}
    noisy = [item.channel for item in model.measurements if item.noise]
    exact = [c for c in dict.fromkeys(m.channel for m in model.measurements if not m.noise) if c not in noisy]
    names = (
        [("parameter", parameter.name) for parameter in model.parameters]
        + [("signal", name) for name in dict.fromkeys((*exogenous(model.lines), *(s.signal for s in model.lines)))]
        + [("channel", channel) for channel in (*noisy, *exact) if channel not in parameters]
        + [("noise", measurement.noise) for measurement in model.measurements if measurement.noise]
    )
    for signal_name, count in Counter(line.signal for line in model.lines).items():
        if count > 1:
            raise ModelError(f"signal {signal_name!r} is defined by {count} lines: keep one, or use replace_line")
    for name, count in Counter(name for _, name in names).items():
        if count > 1:
            kinds = " and ".join(kind for kind, other in names if other == name)
            raise ModelError(f"the name {name!r} stands for {kinds}: rename one of them")


def check_integration(model: Model) -> None:
    """Refuse an unknown scheme, and an invalid number of steps or sampling time."""
    refuse_unknown("scheme", [model.scheme], SCHEMES)
    if isinstance(model.substeps, bool) or not isinstance(model.substeps, int) or model.substeps < 1:
        raise ModelError(f"substeps = {model.substeps!r} is not a number of steps: give a whole number of at least 1")
    step = model.sampling_time
    if step is not None and not (math.isfinite(step) and step > 0):
        raise ModelError(f"sampling_time = {step} is refused: give a positive number of seconds")


def check_symbols(model: Model) -> None:
    """Refuse a symbol that is not a parameter, and a measured signal or a value that the model does not have."""
    known = {parameter.name for parameter in model.parameters}
    expressions = [(f"the line of {line.signal!r}", line.expression) for line in model.lines]
    expressions += [(f"the constraint '{shown(constraint)} >= 0'", constraint) for constraint in model.constraints]
    for measurement in model.measurements:
        inverse = measurement.inverse if measurement.inverse is not None else VALUE
        expressions.append(
            (f"the sensor curve of {measurement.channel!r}", inverse.xreplace({VALUE: sympy.Integer(1)}))
        )
    for place, expression in expressions:
        unknown = sorted(plain_symbols(expression) - known)
        if unknown:
            raise ModelError(f"{place} uses {', '.join(unknown)}, no parameter: add it by with_parameter")
    for constraint in model.constraints:
        if constraint.atoms(sympy.Indexed):
            raise ModelError(
                f"the constraint '{shown(constraint)} >= 0' reads a signal: state it in the parameters only"
            )
    signals = {*exogenous(model.lines), *(line.signal for line in model.lines)}
    for measurement in model.measurements:
        # A channel with the name of a parameter is read under another name, which a later edit will use.
        waits = measurement.noise is None and measurement.channel in known
        if measurement.signal not in signals and not waits:
            raise ModelError(
                f"channel {measurement.channel!r} measures {measurement.signal!r}, which no line "
                f"defines or reads: name one of {', '.join(sorted(signals))}"
            )
    for name, value in model.values.items():
        if name not in known or not math.isfinite(value):
            raise ModelError(f"the value {name} = {value} is refused: give finite values of {', '.join(sorted(known))}")
