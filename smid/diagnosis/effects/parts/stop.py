"""The stop operator: what a play keeps back of its input, ``s = x - play(x)``.

It is the better state of the two for a fit: where nothing is known of the past it begins at zero, in the middle of
its range, and can be moved both ways, while a play begins at one end of its own.
Reference: Brokate and Sprekels, Hysteresis and Phase Transitions (1996), section 2.3.
"""

from __future__ import annotations

import sympy

from smid.models import t

__all__ = ["stop"]


def stop(x: sympy.IndexedBase, state: sympy.IndexedBase, half: sympy.Expr) -> sympy.Expr:
    """Give the stop of ``x`` at ``t``, kept in ``state``, where the play's gap is twice ``half``.

    Examples
    --------
    >>> import sympy
    >>> u, s = sympy.IndexedBase("u"), sympy.IndexedBase("s")
    >>> stop(u, s, sympy.Integer(1)) == sympy.Max(-1, sympy.Min(1, s[t - 1] + u[t] - u[t - 1]))
    True
    """
    return sympy.Max(-half, sympy.Min(half, state[t - 1] + x[t] - x[t - 1]))
