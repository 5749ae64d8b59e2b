"""Arithmetic that proofs rest on: sparse polynomials, and interval arithmetic that rounds outwards."""

from relaxations.algebra.ball_arithmetic import Balls
from relaxations.algebra.polynomial import Polynomials

__all__ = ["Balls", "Polynomials"]
