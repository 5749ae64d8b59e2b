"""The linear line shared by all linear-dynamics models, and the checks of its orders."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import sympy

from smid.models.errors import ModelError
from smid.models.symbols import signal, t

__all__ = ["check_count", "linear_expression", "names", "numbered", "symbols"]


def check_count(option: str, value: int, least: int) -> None:
    """Refuse an order that is not a whole number of at least `least`, with a `ModelError`."""
    if isinstance(value, bool) or not isinstance(value, int) or value < least:
        raise ModelError(f"{option} = {value!r} is not a valid order: give a whole number of at least {least}")


def names(stem: str, count: int, first: int, suffix: str = "") -> tuple[str, ...]:
    """Return numbered parameter names, as in ``b0, b1`` or ``b0_pump, b1_pump``; shape (count,)."""
    return tuple(f"{stem}{index}{suffix}" for index in range(first, first + count))


def numbered(stem: str, count: int, first: int, suffix: str = "") -> tuple[str, ...]:
    """Return `names`, but the only name without a number, as in ``alpha``."""
    return (stem + suffix,) if count == 1 else names(stem, count, first, suffix)


def symbols(names: Iterable[str]) -> list[sympy.Symbol]:
    """Return the symbols of parameters."""
    return [sympy.Symbol(name, real=True) for name in names]


def linear_expression(
    output: str, denominator: Sequence[str], driven: Iterable[tuple[str, Sequence[str], int]]
) -> sympy.Expr:
    """Write ``w[t] = -sum a_i w[t-i] + sum b_j u[t-delay-j]``, equation (2.5) solved for its output.

    Parameters
    ----------
    denominator
        Names of a_1, a_2, ...
    driven
        For each input its signal, the names of b_0, b_1, ..., and its delay.

    Examples
    --------
    >>> linear_expression("w", ["a1"], [("u", ["b0"], 1), ("v", ["c0", "c1"], 2)])
    -a1*w[t - 1] + b0*u[t - 1] + c0*v[t - 2] + c1*v[t - 3]
    """
    terms = [-item * signal(output)[t - lag] for lag, item in enumerate(symbols(denominator), start=1)]
    for name, numerator, delay in driven:
        terms += [item * signal(name)[t - delay - lag] for lag, item in enumerate(symbols(numerator))]
    return sum(terms, sympy.Integer(0))
