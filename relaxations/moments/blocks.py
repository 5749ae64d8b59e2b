"""The constraints of a relaxation in one clique of variables, and the part of them that a sparse relaxation keeps.

A sparse relaxation keeps some multiples of the equalities. Of each matrix ``g b b'`` it keeps principal submatrices. So
every kept constraint is satisfied at every feasible point.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from relaxations.algebra.arrays import Index
from relaxations.algebra.polynomial import Factors, Polynomials
from relaxations.moments.moment import monomials_up_to


@dataclass(frozen=True)
class Clique:
    """The constraints of a relaxation in the variables of one clique.

    Parameters
    ----------
    order
        Order of the relaxation.
    multiples
        All ``h m`` of equalities h and monomials m, up to degree ``2 * order``.
    inequalities
        The polynomials g; the constant 1 is the first.
    """

    variables: tuple[int, ...]
    order: int
    equalities: Polynomials
    multiples: Polynomials
    inequalities: Polynomials

    def basis_degrees(self) -> Index:
        """Return the degree of the basis b of each inequality, shape (n_inequalities,)."""
        return self.order + (-self.inequalities.row_degrees()) // 2

    def bases(self) -> dict[int, Factors]:
        """Return all monomials up to degree k, for each degree k of a basis."""
        return {half: monomials_up_to(self.variables, half) for half in np.unique(self.basis_degrees()).tolist()}


@dataclass(frozen=True)
class Split:
    """The part of a clique's constraints that a relaxation keeps.

    Parameters
    ----------
    multiples
        Row numbers of the kept multiples of equalities.
    blocks
        For each inequality, the parts of its basis as sorted numbers of monomials.
    """

    multiples: Index
    blocks: tuple[tuple[Index, ...], ...]

    @property
    def widths(self) -> list[int]:
        """Return the width of every block."""
        return [len(block) for own in self.blocks for block in own]


def unsplit(clique: Clique) -> Split:
    """Return the split that keeps every constraint."""
    own = {half: (np.arange(len(basis)),) for half, basis in clique.bases().items()}
    return Split(np.arange(clique.multiples.n_rows), tuple(own[half] for half in clique.basis_degrees().tolist()))
