"""Relaxations as cones over scaled moments, and their assembly.

A relaxation replaces each monomial ``m`` of a scaled point (all variables in [-1, 1]) by a variable ``y_m`` in
[-1, 1] with ``y_1 = 1``. Its constraints are

    L(h m) = 0                    for equalities h and multipliers m,
    L(g b b') positive semidefinite   for inequalities g and bases b of monomials,

where ``L`` replaces each monomial by its moment. The lift and Lasserre's hierarchies differ in the choice of m and b.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations_with_replacement, pairwise

import numpy as np

from relaxations.algebra.arrays import Array, Index
from relaxations.algebra.ball_arithmetic import Balls, concatenate
from relaxations.algebra.polynomial import Factors, Polynomials, multiply, pad, unique
from relaxations.errors import ProblemError


@dataclass(frozen=True)
class Localiser:
    """``count`` blocks ``g b b'`` of one size as polynomials, before moments are numbered.

    Parameters
    ----------
    size
        Length of the basis b.
    count
        Number of polynomials g.
    entries
        One row per (block, i, j) with i <= j, ordered by block.
    congruence
        Shape (count, size, reduced). V of a facial reduction, where ``V' M V`` is semidefinite instead of M; or None.
    """

    size: int
    count: int
    entries: Polynomials
    congruence: Array | None = None


@dataclass(frozen=True)
class Blocks:
    """``count`` semidefinite blocks of one size; entry (block, i, j), i <= j, is a sum of coefficient * moment.

    Parameters
    ----------
    block, i, j, moment, coefficient
        Shape (n_terms,). Position, moment number and coefficient of each term.
    congruence
        Shape (count, size, reduced). As in :class:`Localiser`.
    """

    size: int
    count: int
    block: Index
    i: Index
    j: Index
    moment: Index
    coefficient: Balls
    congruence: Array | None


@dataclass(frozen=True)
class Relaxation:
    """A convex outer approximation of a scaled polynomial set; objectives are given to each solve.

    Parameters
    ----------
    method
        ``"lift"``, ``"rlt"``, ``"sparse"``, ``"dense"``, ``"terms"``, ``"chordal"`` or ``"textbook"``.
    n_variables
        Number of variables of the scaled problem.
    complicating
        Complicating variables of a lift; empty for Lasserre's relaxations.
    monomials
        Shape (n_moments, degree). Monomial of each moment; row 0 is the constant 1.
    equality_row, equality_moment, equality_coefficient
        Triplets of the linear equalities ``L(h m) = 0``.
    """

    method: str
    order: int
    n_variables: int
    complicating: Index
    monomials: Factors
    n_equalities: int
    equality_row: Index
    equality_moment: Index
    equality_coefficient: Balls
    blocks: tuple[Blocks, ...]

    @property
    def n_moments(self) -> int:
        """Return the number of moments, the constant included."""
        return len(self.monomials)

    @property
    def degrees(self) -> Index:
        """Return the degree of each moment."""
        return np.asarray((self.monomials >= 0).sum(axis=1), dtype=np.int64)

    @property
    def largest_block(self) -> int:
        """Return the width of the widest block."""
        return max((b.size for b in self.blocks), default=0)

    def moments_of(self, factors: Factors) -> Index:
        """Return the moment number of each monomial; ProblemError if a monomial has no moment."""
        found = self.find(factors)
        if (found < 0).any():
            raise ProblemError(
                "the objective has a monomial beyond this relaxation: name the objective when it is built, raise the "
                "order, or choose method='sparse'"
            )
        return found

    def find(self, factors: Factors) -> Index:
        """Return the moment number of each monomial; -1 if it has none."""
        degree = max(self.monomials.shape[1], factors.shape[1])
        stacked = np.concatenate([pad(self.monomials, degree), pad(factors, degree)])
        _, which = unique(stacked)
        place = np.full(int(which.max(initial=0)) + 1, -1, dtype=np.int64)
        place[which[: self.n_moments]] = np.arange(self.n_moments)
        return place[which[self.n_moments :]]

    def first_order(self, moments: Array) -> Array:
        """Return the point of first-order moments, shape (n_variables,); NaN if a variable has none.

        If only the square of a variable has a moment, the relaxation is symmetric in its sign, and its moment is zero.
        """
        variables = np.arange(self.n_variables)[:, None]
        square, single = self.find(np.repeat(variables, 2, axis=1)), self.find(variables)
        return np.where(single >= 0, moments[single], np.where(square >= 0, 0.0, np.nan))


def monomials_up_to(variables: Sequence[int] | Index, degree: int) -> Factors:
    """Return all monomials in some variables up to a degree, sorted by degree; the constant is the first.

    >>> monomials_up_to([0, 3], 2)  # 1, x0, x3, x0^2, x0 x3, x3^2
    array([[-1, -1],
           [-1,  0],
           [-1,  3],
           [ 0,  0],
           [ 0,  3],
           [ 3,  3]])
    """
    rows = [
        [-1] * (degree - k) + list(choice)
        for k in range(degree + 1)
        for choice in combinations_with_replacement([int(v) for v in variables], k)
    ]
    return np.array(rows, dtype=np.int64).reshape(len(rows), degree)


def localise(polynomials: Polynomials, basis: Factors, congruence: Array | None = None) -> Localiser:
    """Return the blocks ``g b b'`` for each polynomial g and the basis b; ``congruence`` as in :class:`Localiser`."""
    size = len(basis)
    i, j = np.triu_indices(size)
    products = polynomials.times_monomials(multiply(basis[i], basis[j]))
    return Localiser(size, polynomials.n_rows, products, congruence)


def assemble(
    method: str,
    order: int,
    n_variables: int,
    complicating: Index,
    equalities: Sequence[Polynomials],
    localisers: Sequence[Localiser],
    monomials: Sequence[Factors] = (),
) -> Relaxation:
    """Return the relaxation: number every moment and add up the coefficients, without a Python loop over terms.

    Parameters
    ----------
    equalities
        Every row ``h m`` gives ``L(h m) = 0``.
    localisers
        Every block is semidefinite.
    monomials
        Monomials that get a moment even if no constraint contains them.
    """
    equality = Polynomials.join(list(equalities)) if equalities else Polynomials.empty()
    parts = [equality.factors, *(loc.entries.factors for loc in localisers), *monomials]
    degree = max((p.shape[1] for p in parts), default=0)
    everything = np.concatenate([np.full((1, degree), -1, dtype=np.int64), *(pad(p, degree) for p in parts)])
    numbered, which = unique(everything)
    # The constant, -1 in every column, sorts first: it is moment 0.
    cuts = np.cumsum([1, *(len(p) for p in parts)])
    moments = [which[a:b] for a, b in pairwise(cuts)]

    row, moment, coefficient = _collect(equality, moments[0], len(numbered))
    blocks = tuple(
        _blocks(loc, m, len(numbered)) for loc, m in zip(localisers, moments[1 : 1 + len(localisers)], strict=True)
    )
    return Relaxation(
        method, order, n_variables, complicating, numbered, equality.n_rows, row, moment, coefficient, merge(blocks)
    )


def _collect(polynomials: Polynomials, moments: Index, n_moments: int) -> tuple[Index, Index, Balls]:
    """Return the triplets (row, moment, coefficient) with equal positions added up."""
    key, place = np.unique(polynomials.rows * n_moments + moments, return_inverse=True)
    total = polynomials.coefficients.segment_sum(place.reshape(-1), len(key))
    return key // n_moments, key % n_moments, total


def _blocks(localiser: Localiser, moments: Index, n_moments: int) -> Blocks:
    """Return a localiser with its monomials replaced by the numbers of moments."""
    row, moment, coefficient = _collect(localiser.entries, moments, n_moments)
    i, j = np.triu_indices(localiser.size)
    block, entry = np.divmod(row, len(i))
    return Blocks(localiser.size, localiser.count, block, i[entry], j[entry], moment, coefficient, localiser.congruence)


def merge(blocks: Sequence[Blocks]) -> tuple[Blocks, ...]:
    """Return the blocks with all of one size, before and after facial reduction, in one group."""
    # Group by width before and after facial reduction.
    groups: dict[tuple[int, int], list[Blocks]] = {}
    for b in blocks:
        if b.count:
            reduced = b.size if b.congruence is None else b.congruence.shape[2]
            groups.setdefault((b.size, reduced), []).append(b)
    merged = []
    for (size, reduced), members in groups.items():
        # Number the blocks of a group consecutively; a block without facial reduction gets V = I.
        offsets = np.cumsum([0, *(b.count for b in members)])
        whole = np.eye(size)
        merged.append(
            Blocks(
                size,
                int(offsets[-1]),
                np.concatenate([b.block + o for b, o in zip(members, offsets[:-1], strict=True)]),
                np.concatenate([b.i for b in members]),
                np.concatenate([b.j for b in members]),
                np.concatenate([b.moment for b in members]),
                concatenate([b.coefficient for b in members]),
                None
                if reduced == size and all(b.congruence is None for b in members)
                else np.concatenate(
                    [
                        np.broadcast_to(whole, (b.count, size, size)) if b.congruence is None else b.congruence
                        for b in members
                    ]
                ),
            )
        )
    return tuple(merged)
