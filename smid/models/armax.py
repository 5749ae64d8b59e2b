"""The ARMAX model: a linear difference equation whose error is a moving average of bounded noise."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import chain
from typing import Any

from smid.models.model import Line, Measurement, Model, Parameter
from smid.models.paths import Orders, channels_of, outputs_of, per_output, with_channels
from smid.models.priors import Priors
from smid.models.symbols import signal, t
from smid.models.transfer import linear_expression, names, symbols

__all__ = ["Armax"]


def Armax(
    na: int | Sequence[int] = 1,
    nb: Orders = 0,
    nc: int | Sequence[int] = 1,
    delay: Orders = 1,
    *,
    input: str | Sequence[str] = "u",
    output: str | Sequence[str] = "y",
    offset: bool = False,
    **priors: Any,
) -> Model:
    r"""Return an ARMAX model, ``A(q) y = B(q) u + C(q) e`` with ``|e| <= noise_bound``.

    ``y[t] + a1 y[t-1] + ... = b0 u[t-delay] + ... + e[t] + c1 e[t-1] + ...``. With w[t], the prediction of y[t] from
    the past, ``e[t] = y[t] - w[t]``: the lines give w from measured outputs, and the noise of the output is e. So what
    is simulated is the prediction one step ahead. Intervals hold for every e within the bound, whatever its
    distribution. ``nc=0`` is an ARX model.

    Parameters
    ----------
    na
        Number of poles; one number for each output where they differ.
    nb
        Degree of the numerator: nb + 1 coefficients. Of all paths, or, as for `delay`, of each.
    nc
        Number of coefficients ``c1, c2, ...`` of the noise; one number for each output where they differ.
    delay
        Samples from input to output; where they differ, for each output a list with a number for each input.
    input, output
        Channels of the data, one or a list. Each output has an equation of its own, with its own past and all inputs.
    offset
        Add a constant to the equation, the parameter ``offset`` in the output's unit.
    **priors
        Fields of `smid.models.Priors`, on each ``B/A``.

    Returns
    -------
    Model
        Signals ``u`` (the input channel), ``y_measured`` (the measured output) and ``w``; parameters ``a1..``,
        ``b0..``, ``c1..``; noise ``e``. Names end in the output and the input where there are several:
        ``a1_level``, ``b0_level_pump``. The zeros of C are assumed to lie in the closed unit disc: then the
        prediction forgets the noise before the record.

    Raises
    ------
    ModelError
        If an order is negative or does not fit the channels, a channel is named twice, or a prior does not fit.

    References
    ----------
    L. Ljung, System Identification: Theory for the User, 2nd ed. (1999), section 4.2.

    Examples
    --------
    >>> print(Armax(1, 0, 1))
    ARMAX
      w[t] = -a1*y_measured[t - 1] + b0*u[t - 1] + c1*(-w[t - 1] + y_measured[t - 1])
      y[t] = w[t] + e[t]
      y[t] = y_measured[t]
      a1 free
      b0 free
      c1 in [-1, 1]
    """
    outputs = outputs_of(input, output, ("na", na), ("nb", nb), delay)
    counts = per_output("nc", nc, channels_of("output", output))
    parameters: list[Parameter] = []
    lines, measurements, functions, noises = [], [], [], []
    for one, count in zip(outputs, counts, strict=True):
        a, c = names("a", one.poles, 1, one.suffix), names("c", count, 1, one.suffix)
        b = [names("b", path.degree + 1, 0, path.suffix) for path in one.paths]
        constant = [Parameter(f"offset{one.suffix}", null=0.0)] if offset else []
        parameters += [*map(Parameter, (*a, *chain(*b), *c)), *constant]
        w, measured = f"w{one.suffix}", f"y_measured{one.suffix}"
        driven = [(path.input, own, path.delay) for path, own in zip(one.paths, b, strict=True)]
        errors = (own * (signal(measured)[t - k] - signal(w)[t - k]) for k, own in enumerate(symbols(c), start=1))
        expression = linear_expression(measured, a, driven) + sum((*errors, *(item.symbol for item in constant)))
        lines.append(Line(signal(w)[t], expression))
        measurements.append(Measurement(one.channel, w, f"e{one.suffix}"))
        measurements += [Measurement(one.channel, measured, None)] if a or c else []
        functions += [(a, own) for own in b]
        noises.append((c, ()))
    model = Model("ARMAX", tuple(parameters), tuple(lines), tuple(measurements))
    model = Priors(stable=True).apply(model, *noises)
    return with_channels(Priors.of(priors).apply(model, *functions), input, output)
