"""The Hammerstein model: static polynomials followed by linear dynamics."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import chain
from typing import Any

import sympy

from smid.models.errors import ModelError
from smid.models.model import Line, Measurement, Model, Parameter
from smid.models.paths import Orders, channels_of, outputs_of, with_channels, with_noisy_inputs
from smid.models.priors import Priors
from smid.models.symbols import number, signal, t
from smid.models.transfer import check_count, linear_expression, names, numbered, symbols

__all__ = ["Hammerstein"]


def Hammerstein(
    poles: int | Sequence[int] = 1,
    powers: Sequence[int] = (5, 4, 3),
    zeros: Orders = 0,
    delay: Orders = 1,
    *,
    input: str | Sequence[str] = "u",
    output: str | Sequence[str] = "y",
    input_scale: float | Sequence[float] = 1.0,
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
        Number of poles; one number for each output where they differ.
    powers
        Powers of the static polynomial; 0 is an offset.
    zeros
        Degree of the numerator. Of all paths, or, as for `delay`, of each.
    delay
        Samples from x to w; where they differ, for each output a list with a number for each input.
    input, output
        Channels of the data, one or a list. Each output has one denominator, and for each input a polynomial and a
        numerator.
    input_scale
        Factor K of (3.4) on the input before it is raised to powers, in one per input unit; one number for each input
        where they differ. It keeps the coefficients of ordinary size.
    unit_dc_gain
        Linear part of unit DC gain (3.12): its last numerator coefficient is eliminated.  Otherwise the gain
        may move between the two blocks, so a ``beta`` or ``gamma`` of each path must be among ``fixed``.
    input_noise
        Whether the inputs are measured with noise.
    **priors
        Fields of `smid.models.Priors`, on the linear part of each path; ``dc_gain`` only without `unit_dc_gain`.

    Returns
    -------
    Model
        Signals ``v``, ``x``, ``w``; parameters ``alpha`` (``alpha1..`` with several poles), ``gamma1..`` in
        the order of `powers`, ``beta`` or ``beta0..`` where free; noise ``eta``. Names end in the output and the input
        where there are several: ``alpha_level``, ``gamma1_level_pump``.

    Raises
    ------
    ModelError
        If orders or powers make no sense, a channel is named twice, or the gain is not unique.

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
    for power in powers:
        check_count("a power", power, 0)
    if not powers or len(set(powers)) < len(powers):
        raise ModelError(f"powers = {tuple(powers)} must be distinct and at least one: list each power once")
    if unit_dc_gain and (priors.get("integrator") or priors.get("dc_gain") is not None):
        raise ModelError("unit_dc_gain excludes integrator and dc_gain: set unit_dc_gain=False and fix a beta")
    outputs = outputs_of(input, output, ("poles", poles), ("zeros", zeros), delay)
    scales = _of_each("input_scale", input_scale, channels_of("input", input))
    scaled = [(path, number(scale)) for path, scale in zip(outputs[0].paths, scales, strict=True)]
    lines = [Line(signal(f"v{path.of_input}")[t], scale * signal(path.input)[t]) for path, scale in scaled]
    parameters, measurements, functions = list[Parameter](), [], []
    for one in outputs:
        a, w = numbered("alpha", one.poles, 1, one.suffix), f"w{one.suffix}"
        gammas = [names("gamma", len(powers), 1, path.suffix) for path in one.paths]
        b = [numbered("beta", path.degree + 1, 0, path.suffix) for path in one.paths]
        for own, curve in zip(b, gammas, strict=True):
            if not unit_dc_gain and not any(priors.get("fixed", {}).get(name) for name in (*own, *curve)):
                raise ModelError(f"the gain is not unique: set unit_dc_gain=True, or fixed={{'{own[0]}': 1.0}}")
        parameters += map(Parameter, (*a, *chain(*gammas), *chain(*b)))
        for path, curve in zip(one.paths, gammas, strict=True):
            v = signal(f"v{path.of_input}")[t]
            static = sum((g * v**power for g, power in zip(symbols(curve), powers, strict=True)), sympy.Integer(0))
            lines.append(Line(signal(f"x{path.suffix}")[t], static))
        driven = [(f"x{path.suffix}", own, path.delay) for path, own in zip(one.paths, b, strict=True)]
        lines.append(Line(signal(w)[t], linear_expression(w, a, driven)))
        measurements.append(Measurement(one.channel, w, f"eta{one.suffix}"))
        functions += [(a, own) for own in b]
    model = Model("Hammerstein", tuple(parameters), tuple(lines), tuple(measurements))
    known = Priors.of(priors)
    if unit_dc_gain:
        known = replace(known, dc_gain=1)
    model = with_channels(known.apply(model, *functions), input, output)
    return with_noisy_inputs(model, input) if input_noise else model


def _of_each(option: str, given: float | Sequence[float], channels: Sequence[str]) -> tuple[float, ...]:
    """Return a number for each channel; ModelError if there are more or fewer."""
    values = tuple(given) if isinstance(given, Sequence) else (given,) * len(channels)
    if len(values) != len(channels):
        raise ModelError(
            f"{option} = {given} does not fit the inputs {', '.join(channels)}: give one number for all, or a list "
            "with one for each"
        )
    return values
