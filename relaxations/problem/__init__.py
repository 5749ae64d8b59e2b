"""Polynomial problems: variables with bounds, equalities and inequalities."""

from relaxations.problem.problem import PolynomialProblem, from_sympy

__all__ = ["PolynomialProblem", "from_sympy"]
