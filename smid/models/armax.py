"""The ARMAX model: a linear difference equation whose error is a moving average of bounded noise."""

from __future__ import annotations

from typing import Any

import sympy

from smid.models.edit_lines import rename_channels
from smid.models.model import Line, Measurement, Model, Parameter
from smid.models.priors import Priors
from smid.models.symbols import signal, t
from smid.models.transfer import check_count, names

__all__ = ["Armax"]


def Armax(
    na: int = 1,
    nb: int = 0,
    nc: int = 1,
    delay: int = 1,
    *,
    input: str = "u",
    output: str = "y",
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
        Number of poles.
    nb
        Degree of the numerator: nb + 1 coefficients.
    nc
        Number of coefficients ``c1, c2, ...`` of the noise.
    delay
        Samples from input to output.
    input, output
        Channels of the data.
    offset
        Add a constant to the equation, the parameter ``offset`` in the output's unit.
    **priors
        Fields of `smid.models.Priors`, on ``B/A``.

    Returns
    -------
    Model
        Signals ``u`` (the input channel), ``y_measured`` (the measured output) and ``w``; parameters ``a1..``,
        ``b0..``, ``c1..``; noise ``e``. The zeros of C are assumed to lie in the closed unit disc: then the
        prediction forgets the noise before the record.

    Raises
    ------
    ModelError
        If an order is negative or a prior does not fit.

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
    for option, value in (("na", na), ("nb", nb), ("nc", nc), ("delay", delay)):
        check_count(option, value, 0)
    denominator, numerator, noise = names("a", na, 1), names("b", nb + 1, 0), names("c", nc, 1)
    parameters = tuple(Parameter(name) for name in (*denominator, *numerator, *noise))
    constant = (Parameter("offset", null=0.0),) if offset else ()
    a, b, c = ([sympy.Symbol(name, real=True) for name in group] for group in (denominator, numerator, noise))
    measured, w, u = signal("y_measured"), signal("w"), signal("u")
    expression = sum(
        [
            *(-own * measured[t - k] for k, own in enumerate(a, start=1)),
            *(own * u[t - delay - k] for k, own in enumerate(b)),
            *(own * (measured[t - k] - w[t - k]) for k, own in enumerate(c, start=1)),
            *(item.symbol for item in constant),
        ],
        sympy.Integer(0),
    )
    readings = (Measurement("y", "w", "e"), Measurement("y", "y_measured", None))
    model = Model("ARMAX", (*parameters, *constant), (Line(w[t], expression),), readings)
    model = Priors(stable=True).apply(model, noise, ())
    model = Priors.of(priors).apply(model, denominator, numerator)
    return rename_channels(model, {"u": input, "y": output})
