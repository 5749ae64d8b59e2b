"""Polynomial problems: a box, equalities, inequalities, and their statement in plain lists."""

from relaxations.problem.problem import PolynomialProblem, from_sympy

__all__ = ["PolynomialProblem", "from_sympy"]
