"""The Wiener model: linear dynamics followed by an invertible static output curve, given by its inverse."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import chain
from typing import Any

import sympy

from smid.models.errors import ModelError
from smid.models.model import VALUE, Line, Measurement, Model, Parameter
from smid.models.paths import Orders, outputs_of, with_channels, with_noisy_inputs
from smid.models.priors import Priors
from smid.models.symbols import number, signal, t
from smid.models.transfer import check_count, linear_expression, numbered

__all__ = ["Wiener"]

MONOTONE_POINTS = 11


def Wiener(
    poles: int | Sequence[int] = 1,
    inverse_powers: Sequence[int] = (2, 3),
    zeros: Orders = 0,
    delay: Orders = 1,
    *,
    input: str | Sequence[str] = "u",
    output: str | Sequence[str] = "y",
    output_range: tuple[float, float] | None = None,
    input_noise: bool = False,
    **priors: Any,
) -> Model:
    """Return a Wiener model whose output curve is parametrised by its inverse.

    ``x[t] = -alpha x[t-1] + beta u[t-1]``, ``x[t] = z + s2 z^2 + s3 z^3`` with ``z = y[t] - eta[t]``.  The
    output curve exists where this inverse rises; simulation solves it per sample and refuses where it does
    not.  The inverse has slope one at zero, which makes the gain unique.

    Parameters
    ----------
    poles
        Number of poles; one number for each output where they differ.
    inverse_powers
        Powers of the inverse besides the first, each at least 2; 0 is an offset.
    zeros
        Degree of the numerator. Of all paths, or, as for `delay`, of each.
    delay
        Samples from u to x; where they differ, for each output a list with a number for each input.
    input, output
        Channels of the data, one or a list. Each output has one denominator, a numerator for each input, and a curve.
    output_range
        Range of the noise-free outputs, in their unit, over which the inverse is known to rise.  It adds that
        its slope is not negative at points of the range: implied by monotonicity, and linear.
    input_noise
        Whether the inputs are measured with noise.
    **priors
        Fields of `smid.models.Priors`, on the linear part.

    Returns
    -------
    Model
        Signal ``x``; parameters ``alpha`` (or ``alpha1..``), ``beta`` (or ``beta0..``), ``s2``, ``s3``;
        noise ``eta``. Names end in the output and the input where there are several: ``alpha_level``,
        ``beta_level_pump``.

    Raises
    ------
    ModelError
        If orders or powers make no sense, a channel is named twice, or a prior does not fit.

    Examples
    --------
    >>> print(Wiener(inverse_powers=(3,)).measurements[0])
    x[t] = s3*(y[t] - eta[t])**3 + (y[t] - eta[t])
    """
    for power in inverse_powers:
        check_count("an inverse power", power, 0)
    if 1 in inverse_powers or len(set(inverse_powers)) < len(inverse_powers):
        raise ModelError(f"inverse_powers = {tuple(inverse_powers)}: list each once, without 1, whose factor is 1")
    outputs = outputs_of(input, output, ("poles", poles), ("zeros", zeros), delay)
    parameters, constraints = list[Parameter](), list[sympy.Expr]()
    lines, measurements, functions = [], [], []
    for one in outputs:
        a, x = numbered("alpha", one.poles, 1, one.suffix), f"x{one.suffix}"
        b = [numbered("beta", path.degree + 1, 0, path.suffix) for path in one.paths]
        curve = [Parameter(f"s{power}{one.suffix}", null=0.0) for power in inverse_powers]
        inverse = sum((item.symbol * VALUE**power for item, power in zip(curve, inverse_powers, strict=True)), VALUE)
        parameters += [*map(Parameter, (*a, *chain(*b))), *curve]
        driven = [(path.input, own, path.delay) for path, own in zip(one.paths, b, strict=True)]
        lines.append(Line(signal(x)[t], linear_expression(x, a, driven)))
        measurements.append(Measurement(one.channel, x, f"eta{one.suffix}", inverse))
        functions += [(a, own) for own in b]
        constraints += _rises(inverse, output_range) if output_range is not None else []
    model = Model(
        "Wiener",
        tuple(parameters),
        tuple(lines),
        tuple(measurements),
        tuple(constraints),
        description="the inverse of the output curve must rise over the data",
    )
    model = with_channels(Priors.of(priors).apply(model, *functions), input, output)
    return with_noisy_inputs(model, input) if input_noise else model


def _rises(inverse: sympy.Expr, output_range: tuple[float, float]) -> list[sympy.Expr]:
    """Return conditions that an inverse curve rises at points of a range."""
    low, high = output_range
    if not low < high:
        raise ModelError(f"output_range = {output_range} is empty: give (lower, upper) with lower < upper")
    slope = sympy.diff(inverse, VALUE)
    first, step = number(low), (number(high) - number(low)) / (MONOTONE_POINTS - 1)
    points = [first + step * index for index in range(MONOTONE_POINTS)]
    conditions = (sympy.expand(slope.xreplace({VALUE: point})) for point in points)
    return [item for item in conditions if not item.is_number]
