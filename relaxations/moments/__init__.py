"""Relaxations: moment matrices (Lasserre), the parametric lift, and their conic programs."""

from relaxations.moments.conic import Cones, ConicProgram, conic_program, multipliers
from relaxations.moments.lasserre import lasserre
from relaxations.moments.lift import complicating_variables, lift
from relaxations.moments.moment import Relaxation

__all__ = [
    "Cones",
    "ConicProgram",
    "Relaxation",
    "complicating_variables",
    "conic_program",
    "lasserre",
    "lift",
    "multipliers",
]
