"""The errors-in-variables model: a linear transfer function, input and output measured with bounded noise."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from smid.models.model import Model
from smid.models.output_error import OutputError

__all__ = ["ErrorsInVariables"]


def ErrorsInVariables(
    na: int = 1,
    nb: int = 0,
    delay: int = 0,
    *,
    input: str = "u",
    output: str = "y",
    offset: bool = False,
    **priors: Any,
) -> Model:
    """Return an errors-in-variables model, equations (2.5)-(2.7), (2.12).

    As `OutputError`, but of the true input, of which the data show ``u[t] = u_true[t] + zeta[t]``.

    Parameters
    ----------
    na
        Number of poles.
    nb
        Degree of the numerator, as in (2.4): nb + 1 coefficients.
    delay
        Samples from input to output; none in (2.12).
    input, output
        Channels of the data.
    offset
        Add a constant to the line of w, the parameter ``offset`` in the output's unit.
    **priors
        Fields of `smid.models.Priors`.

    Raises
    ------
    ModelError
        If an order is negative or a prior does not fit.

    Examples
    --------
    >>> print(ErrorsInVariables(1, 0))
    errors in variables
      w[t] = -a1*w[t - 1] + b0*u_true[t]
      y[t] = w[t] + eta[t]
      u[t] = u_true[t] + zeta[t]
      a1 free
      b0 free
    """
    model = OutputError(na, nb, delay, input=input, output=output, offset=offset, **priors)
    return replace(model.with_input_noise(input), name="errors in variables")
