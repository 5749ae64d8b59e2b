"""Conic solvers behind one function, a table of back ends, and the order in which they are tried."""

from relaxations.solvers.back_ends import BackEnd, back_ends
from relaxations.solvers.interface import (
    Attempt,
    ConicSolution,
    Solver,
    attempts,
    available_solvers,
    check_solver,
    solve,
)
from relaxations.solvers.stop import Stop

__all__ = [
    "Attempt",
    "BackEnd",
    "ConicSolution",
    "Solver",
    "Stop",
    "attempts",
    "available_solvers",
    "back_ends",
    "check_solver",
    "solve",
]
