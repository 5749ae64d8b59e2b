"""Arithmetic for proofs: sparse polynomials, and two interval arithmetics that round outwards.

:mod:`~relaxations.algebra.ball_arithmetic` bounds rounding errors in NumPy arrays of float64, as certificates need it:
fast, with 53 bits. :mod:`~relaxations.algebra.fixed_point` computes single intervals of Python integers with any number
of bits, as the verification of feasible points needs it.
"""

from relaxations.algebra.ball_arithmetic import Balls
from relaxations.algebra.polynomial import Polynomials

__all__ = ["Balls", "Polynomials"]
