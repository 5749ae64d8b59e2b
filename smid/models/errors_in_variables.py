"""The errors-in-variables model: linear transfer functions, inputs and outputs measured with bounded noise."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

from smid.models.model import Model
from smid.models.output_error import OutputError
from smid.models.paths import Orders, with_noisy_inputs

__all__ = ["ErrorsInVariables"]


def ErrorsInVariables(
    na: int | Sequence[int] = 1,
    nb: Orders = 0,
    delay: Orders = 0,
    *,
    input: str | Sequence[str] = "u",
    output: str | Sequence[str] = "y",
    offset: bool = False,
    **priors: Any,
) -> Model:
    """Return an errors-in-variables model, equations (2.5)-(2.7), (2.12).

    As `OutputError`, but of the true input, of which the data show ``u[t] = u_true[t] + zeta[t]``.

    Parameters
    ----------
    na
        Number of poles; one number for each output where they differ.
    nb
        Degree of the numerator, as in (2.4): nb + 1 coefficients. Of all paths, or, as for `delay`, of each.
    delay
        Samples from input to output, none in (2.12); where they differ, for each output a list with a number for each
        input.
    input, output
        Channels of the data, one or a list. Each output has one denominator, and a numerator for each input.
    offset
        Add a constant to the line of w, the parameter ``offset`` in the output's unit.
    **priors
        Fields of `smid.models.Priors`.

    Raises
    ------
    ModelError
        If an order is negative or does not fit the channels, a channel is named twice, or a prior does not fit.

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
    return replace(with_noisy_inputs(model, input), name="errors in variables")
