"""Relaxations as cones over scaled moments, and the assembly that all of them share.

A relaxation replaces each monomial ``m`` of a scaled point (all variables in [-1, 1]) by a variable ``y_m`` in
[-1, 1], ``y_1 = 1``, and asks

    L(h m) = 0                    for equalities h and multipliers m,
    L(g b b') positive semidefinite   for inequalities g and bases b of monomials,

where ``L`` puts the moment in place of its monomial. Which m and b: that is what tells the lift from Lasserre's
dense and sparse hierarchies.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations_with_replacement, pairwise

import numpy as np

from relaxations.algebra.ball_arithmetic import Array, Balls, Index, concatenate
from relaxations.algebra.polynomial import Factors, Polynomials, multiply, pad, unique
from relaxations.errors import ProblemError


@dataclass(frozen=True)
class Localiser:
    """``count`` symbolic blocks ``g b b'`` of one size, before moments are numbered.

    Parameters
    ----------
    size
        Length of the basis b.
    count
        Number of polynomials g.
    entries
        One row per (block, i, j) with i <= j, ordered by block.
    congruence
        Shape (count, size, reduced).
        The V of a facial reduction: ``V' M V`` is asked to be semidefinite instead of M. None where nothing
        was reduced.
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
    block, i, j, moment
        Shape (n_terms,). Where each term stands, and the number of its moment.
    coefficient
        Shape (n_terms,).
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
    """A convex outer description of a scaled polynomial set; objectives are added at solve time.

    Parameters
    ----------
    method
        ``"lift"``, ``"rlt"``, ``"sparse"``, ``"dense"``, ``"terms"``, ``"chordal"`` or ``"textbook"``.
    n_variables
        Variables of the scaled problem.
    complicating
        The lift's complicating variables; empty for Lasserre's relaxations.
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
        """Return the moment's number for each monomial; ProblemError where one has none."""
        found = self.find(factors)
        if (found < 0).any():
            raise ProblemError(
                "the objective has a monomial beyond this relaxation: name the objective when it is built, raise the "
                "order, or choose method='sparse'"
            )
        return found

    def find(self, factors: Factors) -> Index:
        """Return the moment's number for each monomial; -1 where one has none."""
        degree = max(self.monomials.shape[1], factors.shape[1])
        stacked = np.concatenate([pad(self.monomials, degree), pad(factors, degree)])
        _, which = unique(stacked)
        place = np.full(int(which.max(initial=0)) + 1, -1, dtype=np.int64)
        place[which[: self.n_moments]] = np.arange(self.n_moments)
        return place[which[self.n_moments :]]

    def first_order(self, moments: Array) -> Array:
        """Return the point of first-order moments, shape (n_variables,); NaN where a variable has none.

        Where only its square has one, the relaxation does not change with the variable's sign: the moment is zero.
        """
        variables = np.arange(self.n_variables)[:, None]
        square, single = self.find(np.repeat(variables, 2, axis=1)), self.find(variables)
        return np.where(single >= 0, moments[single], np.where(square >= 0, 0.0, np.nan))


def monomials_up_to(variables: Sequence[int] | Index, degree: int) -> Factors:
    """Return all monomials in some variables up to a degree, by degree, the constant first.

    Returns
    -------
    ndarray of int64, shape (n_monomials, degree)
        Sorted variable numbers, padded in front with -1.

    Examples
    --------
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
    """Return the blocks ``g b b'`` for every member g of a family.

    Parameters
    ----------
    polynomials
        The g.
    basis
        Shape (size, degree). The monomials b.
    congruence
        Shape (n_rows, size, reduced). The V of a facial reduction; see :class:`Localiser`.

    Examples
    --------
    >>> box = Polynomials.from_terms([{(): 1.0, (0, 0): -1.0}])  # 1 - x0^2
    >>> blocks = localise(box, monomials_up_to([0], 1))
    >>> blocks.size, blocks.entries.evaluate(np.array([0.5]))  # (1 - x0^2) times 1, x0 and x0^2
    (2, array([0.75  , 0.375 , 0.1875]))
    """
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
    """Give every moment its number and collect the coefficients, in one pass of NumPy over all terms.

    Parameters
    ----------
    method
        The relaxation's name.
    n_variables
        Variables of the scaled problem.
    complicating
        The lift's complicating variables; empty for others.
    equalities
        Every member ``h m`` gives ``L(h m) = 0``.
    localisers
        Every block is asked to be semidefinite.
    monomials
        Each of shape (n, degree). Kept as moments even where no constraint mentions them.

    Examples
    --------
    >>> one = Polynomials.from_terms([{(): 1.0}])
    >>> half = Polynomials.from_terms([{(0,): 1.0, (): -0.5}])
    >>> none = np.zeros(0, dtype=np.int64)
    >>> relaxation = assemble("mine", 1, 1, none, [half], [localise(one, monomials_up_to([0], 1))])
    >>> relaxation.monomials  # 1, x0, x0^2
    array([[-1, -1],
           [-1,  0],
           [ 0,  0]])
    >>> relaxation.n_equalities, relaxation.largest_block
    (1, 2)
    """
    equality = Polynomials.join(list(equalities)) if equalities else Polynomials.empty()
    parts = [equality.factors, *(loc.entries.factors for loc in localisers), *monomials]
    degree = max((p.shape[1] for p in parts), default=0)
    everything = np.concatenate([np.full((1, degree), -1, dtype=np.int64), *(pad(p, degree) for p in parts)])
    numbered, which = unique(everything)
    # The packed words sort -1 first, so the constant is moment 0.
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
    key, place = np.unique(polynomials.rows * n_moments + moments, return_inverse=True)
    total = polynomials.coefficients.segment_sum(place.reshape(-1), len(key))
    return key // n_moments, key % n_moments, total


def _blocks(localiser: Localiser, moments: Index, n_moments: int) -> Blocks:
    row, moment, coefficient = _collect(localiser.entries, moments, n_moments)
    i, j = np.triu_indices(localiser.size)
    block, entry = np.divmod(row, len(i))
    return Blocks(localiser.size, localiser.count, block, i[entry], j[entry], moment, coefficient, localiser.congruence)


def merge(blocks: Sequence[Blocks]) -> tuple[Blocks, ...]:
    """Join blocks of equal size, so that a solver and a certificate meet each size once.

    Returns
    -------
    tuple of Blocks
        Of each size, and size after a facial reduction, one.

    Examples
    --------
    >>> place = np.zeros(1, dtype=np.int64)
    >>> constant = Blocks(1, 1, place, place, place, place, Balls.exact([1.0]), None)  # 1 >= 0
    >>> (both,) = merge([constant, constant])
    >>> both.count, both.block
    (2, array([0, 1]))
    """
    groups: dict[tuple[int, int], list[Blocks]] = {}
    for b in blocks:
        if b.count:
            reduced = b.size if b.congruence is None else b.congruence.shape[2]
            groups.setdefault((b.size, reduced), []).append(b)
    merged = []
    for (size, reduced), members in groups.items():
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
