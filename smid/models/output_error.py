"""The output-error model: linear transfer functions, exact inputs, outputs measured with bounded noise."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import chain
from typing import Any

from smid.models.model import Line, Measurement, Model, Parameter
from smid.models.paths import Orders, outputs_of, with_channels
from smid.models.priors import Priors
from smid.models.symbols import signal, t
from smid.models.transfer import linear_expression, names

__all__ = ["OutputError"]


def OutputError(
    na: int | Sequence[int] = 1,
    nb: Orders = 0,
    delay: Orders = 1,
    *,
    input: str | Sequence[str] = "u",
    output: str | Sequence[str] = "y",
    offset: bool = False,
    **priors: Any,
) -> Model:
    r"""Return an output-error model, equations (2.3)-(2.5), (2.7).

    ``w[t] = -a1 w[t-1] - ... + b0 u[t-delay] + ... + b_nb u[t-delay-nb]``, ``y[t] = w[t] + eta[t]``.

    Parameters
    ----------
    na
        Number of poles; one number for each output where they differ.
    nb
        Degree of the numerator, as in (2.4): nb + 1 coefficients. Of all paths, or, as for `delay`, of each.
    delay
        Samples from input to output; where they differ, for each output a list with a number for each input.
    input, output
        Channels of the data, one or a list. Each output has one denominator, and a numerator for each input.
    offset
        Add a constant to the line of w, the parameter ``offset`` in the output's unit: measured records are rarely
        centred. The priors, ``dc_gain`` included, speak of the transfer function alone.
    **priors
        Fields of `smid.models.Priors`: ``stable``, ``pole_radius``, ``minimum_phase``, ``dc_gain``,
        ``pole_range``, ``zero_range``, ``integrator``, ``bounds``, ``fixed``. They hold for each path.

    Returns
    -------
    Model
        Signals ``u`` (the input channel) and ``w``; parameters ``a1..``, ``b0..``, ``offset`` where asked for; noise
        ``eta``. Names end in the output and the input where there are several: ``a1_level``, ``b0_level_pump``.

    Raises
    ------
    ModelError
        If an order is negative or does not fit the channels, a channel is named twice, or a prior does not fit.

    Examples
    --------
    >>> print(OutputError(1, 0, stable=True))
    output error
      w[t] = -a1*w[t - 1] + b0*u[t - 1]
      y[t] = w[t] + eta[t]
      a1 in [-1, 1]
      b0 free
    >>> print(OutputError(1, 0, offset=True).lines[0].expression)
    -a1*w[t - 1] + b0*u[t - 1] + offset
    >>> print(OutputError(1, 0, delay=[1, 3], input=["pump", "heater"]).lines[0])
    w[t] = -a1*w[t - 1] + b0_heater*heater[t - 3] + b0_pump*pump[t - 1]
    """
    parameters: list[Parameter] = []
    lines, measurements, functions = [], [], []
    for one in outputs_of(input, output, ("na", na), ("nb", nb), delay):
        a, w = names("a", one.poles, 1, one.suffix), f"w{one.suffix}"
        b = [names("b", path.degree + 1, 0, path.suffix) for path in one.paths]
        constant = [Parameter(f"offset{one.suffix}", null=0.0)] if offset else []
        parameters += [*map(Parameter, (*a, *chain(*b))), *constant]
        driven = [(path.input, own, path.delay) for path, own in zip(one.paths, b, strict=True)]
        expression = sum((item.symbol for item in constant), linear_expression(w, a, driven))
        lines.append(Line(signal(w)[t], expression))
        measurements.append(Measurement(one.channel, w, f"eta{one.suffix}"))
        functions += [(a, own) for own in b]
    model = Model("output error", tuple(parameters), tuple(lines), tuple(measurements))
    return with_channels(Priors.of(priors).apply(model, *functions), input, output)
