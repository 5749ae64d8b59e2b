"""Steps that give an equivalent problem: ``apply`` makes it, the result carries answers back."""

from relaxations.reductions.products import with_products
from relaxations.reductions.scaling import Scaling
from relaxations.reductions.sparsity import cliques

__all__ = ["Scaling", "cliques", "with_products"]
