"""Searches on top of relaxations: contraction, cuts and branching for intervals and for minima."""
