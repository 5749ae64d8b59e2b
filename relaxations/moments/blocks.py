"""What a clique of variables gives to a relaxation, and the part of it that a reduction keeps.

A reduction never changes a constraint: it keeps some multiples of the equalities, and of every matrix ``g b b'`` the
parts whose basis is a part of b, which are principal submatrices. Whatever it keeps holds at every feasible point.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from relaxations.algebra.ball_arithmetic import Index
from relaxations.algebra.polynomial import Factors, Polynomials
from relaxations.moments.moment import monomials_up_to


@dataclass(frozen=True)
class Clique:
    """The constraints of a relaxation in the variables of one clique.

    Parameters
    ----------
    order
        Of the relaxation.
    multiples
        All ``h m`` of the equalities up to degree ``2 * order``.
    inequalities
        The g, the constant 1 first.
    """

    variables: tuple[int, ...]
    order: int
    equalities: Polynomials
    multiples: Polynomials
    inequalities: Polynomials

    def halves(self) -> Index:
        """Return the degree of the basis that belongs to each inequality, shape (n_inequalities,)."""
        return self.order + (-self.inequalities.row_degrees()) // 2

    def bases(self) -> dict[int, Factors]:
        """Return all monomials up to each degree that some basis has."""
        return {half: monomials_up_to(self.variables, half) for half in np.unique(self.halves()).tolist()}


@dataclass(frozen=True)
class Split:
    """What is kept of a clique.

    Parameters
    ----------
    multiples
        Numbers of the multiples of equalities.
    blocks
        For every inequality the parts of its basis, as numbers of monomials, each sorted.
    """

    multiples: Index
    blocks: tuple[tuple[Index, ...], ...]

    @property
    def widths(self) -> list[int]:
        """Return the width of every block."""
        return [len(block) for own in self.blocks for block in own]


def whole(clique: Clique) -> Split:
    """Keep everything.

    Examples
    --------
    >>> one, nothing = Polynomials.from_terms([{(): 1.0}]), Polynomials.empty()
    >>> whole(Clique((0, 2), 2, nothing, nothing, one)).widths  # monomials in two variables up to degree 2
    [6]
    """
    own = {half: (np.arange(len(basis)),) for half, basis in clique.bases().items()}
    return Split(np.arange(clique.multiples.n_rows), tuple(own[half] for half in clique.halves().tolist()))
