"""The output-error model: a linear transfer function, exact input, output measured with bounded noise."""

from __future__ import annotations

from typing import Any

from smid.models.model import Line, Measurement, Model, Parameter
from smid.models.priors import Priors
from smid.models.symbols import signal, t
from smid.models.transfer import check_count, linear_expression, names

__all__ = ["OutputError"]


def OutputError(
    na: int = 1, nb: int = 0, delay: int = 1, *, input: str = "u", output: str = "y", **priors: Any
) -> Model:
    r"""Give an output-error model, equations (2.3)-(2.5), (2.7).

    ``w[t] = -a1 w[t-1] - ... + b0 u[t-delay] + ... + b_nb u[t-delay-nb]``, ``y[t] = w[t] + eta[t]``.

    Parameters
    ----------
    na : int
        Number of poles.
    nb : int
        Degree of the numerator, as in (2.4): nb + 1 coefficients.
    delay : int
        Samples from input to output.
    input, output : str
        Channels of the data.
    **priors
        Fields of `smid.models.Priors`: ``stable``, ``pole_radius``, ``minimum_phase``, ``dc_gain``,
        ``pole_range``, ``zero_range``, ``integrator``, ``bounds``, ``fixed``.

    Returns
    -------
    Model
        Signals ``u`` (the input channel) and ``w``; parameters ``a1..``, ``b0..``; noise ``eta``.

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
    """
    check_count("na", na, 0)
    check_count("nb", nb, 0)
    check_count("delay", delay, 0)
    denominator, numerator = names("a", na, 1), names("b", nb + 1, 0)
    parameters = tuple(Parameter(name) for name in (*denominator, *numerator))
    a, b = [item.symbol for item in parameters[:na]], [item.symbol for item in parameters[na:]]
    line = Line(signal("w")[t], linear_expression("w", input, a, b, delay))
    model = Model("output error", parameters, (line,), (Measurement(output, "w", "eta"),))
    return Priors.of(priors).apply(model, denominator, numerator)
