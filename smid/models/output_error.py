"""The output-error model: a linear transfer function, exact input, output measured with bounded noise."""

from __future__ import annotations

from typing import Any

from smid.models.edit_lines import rename_channels
from smid.models.model import Line, Measurement, Model, Parameter
from smid.models.priors import Priors
from smid.models.symbols import signal, t
from smid.models.transfer import check_count, linear_expression, names

__all__ = ["OutputError"]


def OutputError(
    na: int = 1,
    nb: int = 0,
    delay: int = 1,
    *,
    input: str = "u",
    output: str = "y",
    offset: bool = False,
    **priors: Any,
) -> Model:
    r"""Return an output-error model, equations (2.3)-(2.5), (2.7).

    ``w[t] = -a1 w[t-1] - ... + b0 u[t-delay] + ... + b_nb u[t-delay-nb]``, ``y[t] = w[t] + eta[t]``.

    Parameters
    ----------
    na
        Number of poles.
    nb
        Degree of the numerator, as in (2.4): nb + 1 coefficients.
    delay
        Samples from input to output.
    input, output
        Channels of the data.
    offset
        Add a constant to the line of w, the parameter ``offset`` in the output's unit: measured records are rarely
        centred. The priors, ``dc_gain`` included, speak of the transfer function alone.
    **priors
        Fields of `smid.models.Priors`: ``stable``, ``pole_radius``, ``minimum_phase``, ``dc_gain``,
        ``pole_range``, ``zero_range``, ``integrator``, ``bounds``, ``fixed``.

    Returns
    -------
    Model
        Signals ``u`` (the input channel) and ``w``; parameters ``a1..``, ``b0..``, ``offset`` where asked for; noise
        ``eta``.

    Raises
    ------
    ModelError
        If an order is negative or a prior does not fit.

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
    """
    check_count("na", na, 0)
    check_count("nb", nb, 0)
    check_count("delay", delay, 0)
    denominator, numerator = names("a", na, 1), names("b", nb + 1, 0)
    parameters = tuple(Parameter(name) for name in (*denominator, *numerator))
    constant = (Parameter("offset", null=0.0),) if offset else ()
    a, b = [item.symbol for item in parameters[:na]], [item.symbol for item in parameters[na:]]
    expression = sum((item.symbol for item in constant), linear_expression("w", "u", a, b, delay))
    line = Line(signal("w")[t], expression)
    model = Model("output error", (*parameters, *constant), (line,), (Measurement("y", "w", "eta"),))
    model = Priors.of(priors).apply(model, denominator, numerator)
    return rename_channels(model, {"u": input, "y": output})
