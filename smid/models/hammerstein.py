"""The Hammerstein model: a static polynomial followed by linear dynamics."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import sympy

from smid.models.edit_lines import rename_channels
from smid.models.errors import ModelError
from smid.models.model import Line, Measurement, Model, Parameter
from smid.models.priors import Priors
from smid.models.symbols import number, signal, t
from smid.models.transfer import check_count, linear_expression, names

__all__ = ["Hammerstein"]


def Hammerstein(
    poles: int = 1,
    powers: Sequence[int] = (5, 4, 3),
    zeros: int = 0,
    delay: int = 1,
    *,
    input: str = "u",
    output: str = "y",
    input_scale: float = 1.0,
    unit_dc_gain: bool = True,
    input_noise: bool = False,
    **priors: Any,
) -> Model:
    """Return a Hammerstein model, equations (3.1)-(3.14).

    ``v[t] = K u[t]``, ``x[t] = sum_k gamma_k v[t]^p_k``, ``w[t] = -alpha w[t-1] + (1 + alpha) x[t-1]``,
    ``y[t] = w[t] + eta[t]``.

    Parameters
    ----------
    poles
        Number of poles.
    powers
        Powers of the static polynomial; 0 is an offset.
    zeros
        Degree of the numerator.
    delay
        Samples from x to w.
    input, output
        Channels of the data.
    input_scale
        Factor K of (3.4) on the input before it is raised to powers, in one per input unit. It keeps the coefficients
        of ordinary size.
    unit_dc_gain
        Linear part of unit DC gain (3.12): its last numerator coefficient is eliminated.  Otherwise the gain
        may move between the two blocks, so a ``beta`` or ``gamma`` must be among ``fixed``.
    input_noise
        Whether the input is measured with noise.
    **priors
        Fields of `smid.models.Priors`, on the linear part; ``dc_gain`` only without `unit_dc_gain`.

    Returns
    -------
    Model
        Signals ``v``, ``x``, ``w``; parameters ``alpha`` (``alpha1..`` with several poles), ``gamma1..`` in
        the order of `powers`, ``beta`` or ``beta0..`` where free; noise ``eta``.

    Raises
    ------
    ModelError
        If orders or powers make no sense, or the gain is not unique.

    Examples
    --------
    >>> print(Hammerstein(powers=(3,), input_scale=0.01, stable=True))
    Hammerstein
      v[t] = 0.01*u[t]
      x[t] = gamma1*v[t]**3
      w[t] = -alpha*w[t - 1] + (alpha + 1)*x[t - 1]
      y[t] = w[t] + eta[t]
      alpha in [-1, 1]
      gamma1 free
    """
    check_count("poles", poles, 0)
    check_count("zeros", zeros, 0)
    check_count("delay", delay, 0)
    for power in powers:
        check_count("a power", power, 0)
    if not powers or len(set(powers)) < len(powers):
        raise ModelError(f"powers = {tuple(powers)} must be distinct and at least one: list each power once")
    if unit_dc_gain and (priors.get("integrator") or priors.get("dc_gain") is not None):
        raise ModelError("unit_dc_gain excludes integrator and dc_gain: set unit_dc_gain=False and fix a beta")
    denominator = ("alpha",) if poles == 1 else names("alpha", poles, 1)
    numerator = ("beta",) if zeros == 0 else names("beta", zeros + 1, 0)
    gammas = names("gamma", len(powers), 1)
    fixed = priors.get("fixed", {})
    if not unit_dc_gain and not any(fixed.get(name) for name in (*numerator, *gammas)):
        raise ModelError(f"the gain is not unique: set unit_dc_gain=True, or fixed={{'{numerator[0]}': 1.0}}")
    parameters = tuple(Parameter(name) for name in (*denominator, *gammas, *numerator))
    symbols = {item.name: item.symbol for item in parameters}
    v = signal("v")[t]
    static = sum((symbols[name] * v**power for name, power in zip(gammas, powers, strict=True)), sympy.Integer(0))
    a, b = [symbols[name] for name in denominator], [symbols[name] for name in numerator]
    lines = (
        Line(v, number(input_scale) * signal("u")[t]),
        Line(signal("x")[t], static),
        Line(signal("w")[t], linear_expression("w", "x", a, b, delay)),
    )
    model = Model("Hammerstein", parameters, lines, (Measurement("y", "w", "eta"),))
    known = Priors.of(priors)
    if unit_dc_gain:
        known = replace(known, dc_gain=1)
    model = rename_channels(known.apply(model, denominator, numerator), {"u": input, "y": output})
    return model.with_input_noise(input) if input_noise else model
