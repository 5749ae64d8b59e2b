"""The Wiener model: linear dynamics followed by an invertible static output curve, given by its inverse."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import sympy

from smid.models.edit_lines import rename_channels
from smid.models.errors import ModelError
from smid.models.model import VALUE, Line, Measurement, Model, Parameter
from smid.models.priors import Priors
from smid.models.symbols import number, signal, t
from smid.models.transfer import check_count, linear_expression, names

__all__ = ["Wiener"]

MONOTONE_POINTS = 11


def Wiener(
    poles: int = 1,
    inverse_powers: Sequence[int] = (2, 3),
    zeros: int = 0,
    delay: int = 1,
    *,
    input: str = "u",
    output: str = "y",
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
        Number of poles.
    inverse_powers
        Powers of the inverse besides the first, each at least 2; 0 is an offset.
    zeros
        Degree of the numerator.
    delay
        Samples from u to x.
    input, output
        Channels of the data.
    output_range
        Range of the noise-free output, in its unit, over which the inverse is known to rise.  It adds that
        its slope is not negative at points of the range: implied by monotonicity, and linear.
    input_noise
        Whether the input is measured with noise.
    **priors
        Fields of `smid.models.Priors`, on the linear part.

    Returns
    -------
    Model
        Signal ``x``; parameters ``alpha`` (or ``alpha1..``), ``beta`` (or ``beta0..``), ``s2``, ``s3``;
        noise ``eta``.

    Raises
    ------
    ModelError
        If orders or powers make no sense, or a prior does not fit.

    Examples
    --------
    >>> print(Wiener(inverse_powers=(3,)).measurements[0])
    x[t] = s3*(y[t] - eta[t])**3 + (y[t] - eta[t])
    """
    check_count("poles", poles, 0)
    check_count("zeros", zeros, 0)
    check_count("delay", delay, 0)
    for power in inverse_powers:
        check_count("an inverse power", power, 0)
    if 1 in inverse_powers or len(set(inverse_powers)) < len(inverse_powers):
        raise ModelError(f"inverse_powers = {tuple(inverse_powers)}: list each once, without 1, whose factor is 1")
    denominator = ("alpha",) if poles == 1 else names("alpha", poles, 1)
    numerator = ("beta",) if zeros == 0 else names("beta", zeros + 1, 0)
    linear = tuple(Parameter(name) for name in (*denominator, *numerator))
    curve = tuple(Parameter(f"s{power}", null=0.0) for power in inverse_powers)
    a, b = [item.symbol for item in linear[:poles]], [item.symbol for item in linear[poles:]]
    inverse = VALUE + sum(
        (item.symbol * VALUE**power for item, power in zip(curve, inverse_powers, strict=True)),
        sympy.Integer(0),
    )
    model = Model(
        "Wiener",
        (*linear, *curve),
        (Line(signal("x")[t], linear_expression("x", "u", a, b, delay)),),
        (Measurement("y", "x", "eta", inverse),),
        description="the inverse of the output curve must rise over the data",
    )
    if output_range is not None:
        low, high = output_range
        if not low < high:
            raise ModelError(f"output_range = {output_range} is empty: give (lower, upper) with lower < upper")
        slope = sympy.diff(inverse, VALUE)
        first, step = number(low), (number(high) - number(low)) / (MONOTONE_POINTS - 1)
        points = [first + step * index for index in range(MONOTONE_POINTS)]
        conditions = (sympy.expand(slope.xreplace({VALUE: point})) for point in points)
        model = model.with_constraint(*(item for item in conditions if not item.is_number))
    model = Priors.of(priors).apply(model, denominator, numerator)
    model = rename_channels(model, {"u": input, "y": output})
    return model.with_input_noise(input) if input_noise else model
