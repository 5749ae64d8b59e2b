"""Sign symmetry: if the problem is unchanged by sign changes of variables, every moment matrix splits into blocks.

Let ``x_i -> -x_i`` for all i in S leave every inequality and the objective unchanged, and each equality up to its sign.

- Such sets S form a group, a linear space over GF(2). S belongs to it if and only if it contains an even number of the
  factors of each monomial (for an equality: of each quotient of two monomials).
- The mean of a feasible moment vector over the group is feasible and has the same objective. Its moments are zero for
  all monomials whose sign some S changes.
- Two monomials belong to one class if the same sets S change their signs. Entries ``b_i b_j`` of a moment matrix are
  zero if b_i and b_j belong to different classes. Multiples of equalities are needed in the class of 1 only.

So the split does not change the bound. It needs the objective: without it there is no split.

References
----------
K. Gatermann and P. A. Parrilo, "Symmetry groups, semidefinite programs, and sums of squares", Journal of Pure and
Applied Algebra 192 (2004) 95-128. J. Lofberg, "Pre- and post-processing sum-of-squares programs in practice", IEEE
Transactions on Automatic Control 54 (2009) 1007-1011.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from relaxations.algebra.arrays import Index
from relaxations.algebra.polynomial import Factors, Polynomials
from relaxations.moments.blocks import Clique, Split
from relaxations.problem.problem import PolynomialProblem

Signs = NDArray[np.bool_]


def sign_symmetries(problem: PolynomialProblem, objective: Polynomials) -> Signs:
    """Return generators of the group of sign changes, shape (n_generators, n_variables): True where the sign changes.

    The problem is scaled to [-1, 1], and every row of the objective is unchanged.

    >>> import sympy; from relaxations.problem.problem import from_sympy
    >>> x, y, z = v = sympy.symbols("x y z")
    >>> problem, objective = from_sympy(x**4 + y * z, [], [x * y - z], v, dict.fromkeys(v, (-1, 1)))
    >>> sign_symmetries(problem, objective).astype(int)  # y and z: x y - z becomes -(x y - z)
    array([[0, 1, 1]])
    """
    h = problem.equalities
    first = np.full(h.n_rows, -1)
    first[h.rows[::-1]] = np.arange(len(h.rows))[::-1]
    # Each relation is a set of variables, of which S contains an even number.
    relations = {
        *_parities(problem.inequalities.factors),
        *_parities(objective.factors),
        *(a ^ b for a, b in zip(_parities(h.factors), _parities(h.factors[first[h.rows]]), strict=True)),
    }
    # Gauss-Jordan elimination over GF(2); the bits of an integer are a row.
    pivots: dict[int, int] = {}
    for row in sorted(relations):
        for bit, other in pivots.items():
            if row >> bit & 1:
                row ^= other
        if row:
            leading = row.bit_length() - 1
            pivots = {bit: other ^ row if other >> leading & 1 else other for bit, other in pivots.items()}
            pivots[leading] = row
    # One generator for each free variable of the linear system.
    free = [v for v in range(problem.n_variables) if v not in pivots]
    signs = np.zeros((len(free), problem.n_variables), dtype=np.bool_)
    for k, v in enumerate(free):
        signs[k, [v, *(bit for bit, row in pivots.items() if row >> v & 1)]] = True
    return signs


def _parities(factors: Factors) -> list[int]:
    """Return, for each monomial, the bits of the variables that have an odd exponent."""
    parities = []
    for row in factors.tolist():
        bits = 0
        for v in row:
            bits ^= 1 << v if v >= 0 else 0
        parities.append(bits)
    return parities


def classes(factors: Factors, signs: Signs) -> Index:
    """Return the class number of each monomial; class 0 holds the monomials whose sign never changes."""
    padded = np.pad(signs, ((0, 0), (0, 1)))  # padding, -1, is a variable that keeps its sign
    flipped = np.bitwise_xor.reduce(padded[:, factors], axis=2)
    constant = np.zeros((1, len(signs)), dtype=np.bool_)
    _, number = np.unique(np.concatenate([constant, flipped.T]), axis=0, return_inverse=True)
    return np.asarray(number.reshape(-1)[1:], dtype=np.int64)


def split(clique: Clique, signs: Signs) -> Split:
    """Return the blocks of each class, and the multiples of equalities in the class of 1."""
    signs = signs[signs[:, list(clique.variables)].any(axis=1)]
    own = {half: _parts(classes(basis, signs)) for half, basis in clique.bases().items()}
    multiples = clique.multiples
    odd = np.zeros(multiples.n_rows, dtype=np.bool_)
    odd[multiples.rows[classes(multiples.factors, signs) != 0]] = True
    return Split(np.flatnonzero(~odd), tuple(own[half] for half in clique.basis_degrees().tolist()))


def _parts(number: Index) -> tuple[Index, ...]:
    """Return the indices of each class."""
    return tuple(np.flatnonzero(number == k) for k in np.unique(number))
