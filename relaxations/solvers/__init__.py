"""Conic solvers behind one call; Clarabel straight, every other one through cvxpy."""

from relaxations.solvers.interface import ConicSolution, available_solvers, solve
from relaxations.solvers.stop import Stop

__all__ = ["ConicSolution", "Stop", "available_solvers", "solve"]
