"""The linear line shared by all linear-dynamics models, and the checks of its orders."""

from __future__ import annotations

from collections.abc import Sequence

import sympy

from smid.models.errors import ModelError
from smid.models.symbols import signal, t

__all__ = ["check_count", "linear_expression", "names"]


def check_count(option: str, value: int, least: int) -> None:
    """Refuse an order that is not a whole number of at least `least`, with a `ModelError`."""
    if isinstance(value, bool) or not isinstance(value, int) or value < least:
        raise ModelError(f"{option} = {value!r} is not a valid order: give a whole number of at least {least}")


def names(stem: str, count: int, first: int) -> tuple[str, ...]:
    """Return numbered parameter names, as in ``b0, b1``; shape (count,)."""
    return tuple(f"{stem}{index}" for index in range(first, first + count))


def linear_expression(
    output: str, input_: str, denominator: Sequence[sympy.Expr], numerator: Sequence[sympy.Expr], delay: int
) -> sympy.Expr:
    """Write ``w[t] = -sum a_i w[t-i] + sum b_j u[t-delay-j]``, equation (2.5) solved for its output.

    Examples
    --------
    >>> linear_expression("w", "u", sympy.symbols("a1,"), sympy.symbols("b0,"), 1)
    -a1*w[t - 1] + b0*u[t - 1]
    """
    w, u = signal(output), signal(input_)
    past = (-item * w[t - lag] for lag, item in enumerate(denominator, start=1))
    driven = (item * u[t - delay - lag] for lag, item in enumerate(numerator))
    return sum((*past, *driven), sympy.Integer(0))
