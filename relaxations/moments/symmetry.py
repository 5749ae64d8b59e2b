"""Sign symmetry: changes of signs that leave a problem as it is split every moment matrix, and lose nothing.

Let ``x_i -> -x_i`` for all i in S leave every inequality and the objective unchanged, and every equality up to its
sign. Such S form a group, a linear space over GF(2): S belongs to it exactly when it meets an even number of the
factors of each monomial (for an equality: of each quotient of two). The mean of a feasible moment vector over the group
is feasible with the same objective, and its moments are zero where some S changes the monomial's sign. So monomials
fall into classes by the S that change their sign. Entries ``b_i b_j`` of a moment matrix are zero across classes, and a
multiple of an equality says nothing outside the class of 1.

This holds for an objective that the group leaves unchanged: where it is not known, nothing may be split.

References
----------
K. Gatermann and P. A. Parrilo, "Symmetry groups, semidefinite programs, and sums of squares", Journal of Pure and
Applied Algebra 192 (2004) 95-128. J. Lofberg, "Pre- and post-processing sum-of-squares programs in practice", IEEE
Transactions on Automatic Control 54 (2009) 1007-1011.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from relaxations.algebra.ball_arithmetic import Index
from relaxations.algebra.polynomial import Factors, Polynomials
from relaxations.moments.blocks import Clique, Split
from relaxations.problem.problem import PolynomialProblem

Signs = NDArray[np.bool_]


def sign_symmetries(problem: PolynomialProblem, objective: Polynomials) -> Signs:
    """Return generators of the group of sign changes that leave a problem in the box [-1, 1] as it is.

    Parameters
    ----------
    problem
        Scaled to [-1, 1]: there a change of sign keeps the box.
    objective
        Every row is left unchanged.

    Returns
    -------
    ndarray of bool, shape (n_generators, n_variables)
        The variables that change their sign.

    Examples
    --------
    >>> import sympy; from relaxations.problem.problem import from_sympy
    >>> x, y, z = v = sympy.symbols("x y z")
    >>> problem, objective = from_sympy(x**4 + y * z, [], [x * y - z], v, dict.fromkeys(v, (-1, 1)))
    >>> sign_symmetries(problem, objective).astype(int)  # y and z, for x y - z becomes its negative
    array([[0, 1, 1]])
    """
    h = problem.equalities
    first = np.full(h.n_rows, -1)
    first[h.rows[::-1]] = np.arange(len(h.rows))[::-1]
    relations = {
        *_parities(problem.inequalities.factors),
        *_parities(objective.factors),
        *(a ^ b for a, b in zip(_parities(h.factors), _parities(h.factors[first[h.rows]]), strict=True)),
    }
    # Gauss-Jordan over GF(2), a row being the bits of a number: no pivot's bit stands in another row.
    pivots: dict[int, int] = {}
    for row in sorted(relations):
        for bit, other in pivots.items():
            if row >> bit & 1:
                row ^= other
        if row:
            leading = row.bit_length() - 1
            pivots = {bit: other ^ row if other >> leading & 1 else other for bit, other in pivots.items()}
            pivots[leading] = row
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
    """Return the number of each monomial's class; 0 where no change of the group touches its sign.

    Parameters
    ----------
    factors
        Shape (n, degree).
    signs
        Shape (n_generators, n_variables).

    Returns
    -------
    ndarray of int64, shape (n,)

    Examples
    --------
    >>> signs = np.array([[True, True, False]])
    >>> classes(np.array([[-1, -1], [-1, 0], [-1, 2], [0, 1]]), signs)  # 1, x0, x2 and x0 x1
    array([0, 1, 0, 0])
    """
    padded = np.pad(signs, ((0, 0), (0, 1)))  # padding, -1, is a variable that keeps its sign
    flipped = np.bitwise_xor.reduce(padded[:, factors], axis=2)
    constant = np.zeros((1, len(signs)), dtype=np.bool_)
    _, number = np.unique(np.concatenate([constant, flipped.T]), axis=0, return_inverse=True)
    return np.asarray(number.reshape(-1)[1:], dtype=np.int64)


def split(clique: Clique, signs: Signs) -> Split:
    """Keep what concerns moments of the class of 1, all others being zero.

    Parameters
    ----------
    signs
        Shape (n_generators, n_variables).

    Examples
    --------
    >>> one, nothing = Polynomials.from_terms([{(): 1.0}]), Polynomials.empty()
    >>> clique = Clique((0, 1), 2, nothing, nothing, one)
    >>> split(clique, np.array([[True, True]])).widths  # 1 and the products of two; x0 and x1
    [4, 2]
    """
    signs = signs[signs[:, list(clique.variables)].any(axis=1)]
    own = {half: _parts(classes(basis, signs)) for half, basis in clique.bases().items()}
    multiples = clique.multiples
    odd = np.zeros(multiples.n_rows, dtype=np.bool_)
    odd[multiples.rows[classes(multiples.factors, signs) != 0]] = True
    return Split(np.flatnonzero(~odd), tuple(own[half] for half in clique.halves().tolist()))


def _parts(number: Index) -> tuple[Index, ...]:
    return tuple(np.flatnonzero(number == k) for k in np.unique(number))
