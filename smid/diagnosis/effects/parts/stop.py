"""The stop operator, the input minus its play: ``s = x - play(x)``.

As a state it suits a fit better than the play: it starts at zero, in the middle of its range, while a play starts at
one end. Reference: Brokate and Sprekels, Hysteresis and Phase Transitions (1996), section 2.3.
"""

from __future__ import annotations

import sympy

from smid.diagnosis.effects.parts.extremes import larger, smaller
from smid.models import t

__all__ = ["stop"]


def stop(x: sympy.IndexedBase, state: sympy.IndexedBase, half: sympy.Expr) -> sympy.Expr:
    """Return the stop of ``x`` at ``t``, kept in ``state``, where the play's gap is twice ``half``.

    Examples
    --------
    >>> import sympy
    >>> u, s = sympy.IndexedBase("u"), sympy.IndexedBase("s")
    >>> stop(u, s, sympy.Integer(1)) == sympy.Max(-1, sympy.Min(1, s[t - 1] + u[t] - u[t - 1]))
    True
    """
    return larger(-half, smaller(half, state[t - 1] + x[t] - x[t - 1]))
