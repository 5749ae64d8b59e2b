"""Polynomial problems: a box, equalities, inequalities, and their statement in plain lists."""
