"""Conic solvers behind one call; Clarabel straight, every other one through cvxpy."""

from relaxations.solvers.interface import ConicSolution, Stop, available_solvers, solve

__all__ = ["ConicSolution", "Stop", "available_solvers", "solve"]
