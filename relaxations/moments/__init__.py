"""Relaxations: moment matrices (Lasserre), the parametric lift, and their conic programs."""

from relaxations.moments.conic import Cones, ConicProgram, conic_program, multipliers
from relaxations.moments.lasserre_hierarchy import lasserre
from relaxations.moments.moment import Relaxation
from relaxations.moments.parametric_lift import complicating_variables, lift

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
