"""Equivalent problems that are easier to relax or to solve: scaling, products of constraints, cliques of variables."""

from relaxations.reductions.products import with_products
from relaxations.reductions.scaling import Scaling
from relaxations.reductions.sparsity import cliques

__all__ = ["Scaling", "cliques", "with_products"]
