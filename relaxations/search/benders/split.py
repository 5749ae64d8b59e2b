"""A problem split into few outer variables p and many inner ones z that enter linearly."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import sparse

from relaxations.algebra.arrays import Array, Index
from relaxations.algebra.polynomial import Factors, Polynomials, pad, trim, unique
from relaxations.problem.problem import PolynomialProblem


@dataclass(frozen=True)
class Rows:
    """Constraints as sums over pairs: an inner variable or none, times a monomial of the outer ones.

    Parameters
    ----------
    mid, rad
        Shape (n_rows, (1 + n_inner) * n_monomials). Column ``t * n_monomials + a`` belongs to monomial a times inner
        variable t - 1 (none for t = 0).
    """

    mid: sparse.csr_matrix
    rad: sparse.csr_matrix

    @property
    def count(self) -> int:
        """Return the number of constraints."""
        return int(self.mid.shape[0])

    def at(self, values: Array) -> tuple[Array, sparse.csc_matrix]:
        """Return the constant and the matrix in the inner variables once the monomials have values."""
        own, k = self.mid.tocoo(), len(values)
        inner = self.mid.shape[1] // k
        data = own.data * values[own.col % k]
        matrix = sparse.csc_matrix((data, (own.row, own.col // k)), shape=(self.count, inner))
        return matrix[:, 0].toarray().ravel(), matrix[:, 1:]


@dataclass(frozen=True)
class Split:
    """The constraints in outer variables as they are and inner ones scaled to [-1, 1].

    Parameters
    ----------
    outer, inner
        Numbers of the variables in the problem.
    centre, radius
        Shape (n_inner,). Of the inner variables' box.
    monomials
        Shape (n_monomials, degree). Of the outer variables, numbered among themselves; -1 for padding; constant first.

    Examples
    --------
    >>> from relaxations.formats.expressions import problem_of, variables
    >>> a, x = variables("a x")
    >>> problem, _ = problem_of(x, [a * x == 1, a >= 0.1, a <= 2, x >= 0, x <= 2])
    >>> split = Split.of(problem, np.array([0]))
    >>> split.monomials.tolist(), split.equalities.mid.toarray()  # a (1 + z) - 1, in pairs 1, a, z, z a
    ([[-1], [0]], array([[-1.,  1.,  0.,  1.]]))
    """

    outer: Index
    inner: Index
    centre: Array
    radius: Array
    monomials: Factors
    equalities: Rows
    inequalities: Rows

    @staticmethod
    def of(problem: PolynomialProblem, outer: Index) -> Split:
        """Split a problem with a finite box that is affine in all variables but the outer ones."""
        n = problem.n_variables
        inner = np.setdiff1d(np.arange(n), outer)
        centre, scale = np.zeros(n), np.ones(n)
        centre[inner], scale[inner] = frame(problem.lower[inner], problem.upper[inner])
        families = [f.substitute_affine(centre, scale) for f in (problem.equalities, problem.inequalities)]

        place = np.full(n + 1, -1, dtype=np.int64)  # the last entry is for padding, -1
        place[outer] = np.arange(len(outer))
        degree = max(1, *(f.factors.shape[1] for f in families))
        own = [np.sort(pad(place[f.factors], degree), axis=1) for f in families]
        monomials, number = unique(np.concatenate([np.full((1, degree), -1), *own]))
        column = np.zeros(n + 1, dtype=np.int64)
        column[inner] = 1 + np.arange(len(inner))
        numbers = np.split(number[1:], [len(own[0])])
        rows = [
            _rows(family, column[family.factors].max(axis=1, initial=0), numbers[k], len(inner), len(monomials))
            for k, family in enumerate(families)
        ]
        return Split(outer, inner, centre[inner], scale[inner], trim(monomials), *rows)

    def values(self, p: Array) -> Array:
        """Return the values of the monomials at a point, shape (n_monomials,)."""
        return np.asarray(np.prod(np.where(self.monomials >= 0, p[self.monomials], 1.0), axis=1), dtype=np.float64)

    def affine(self, centre: Array, radius: Array) -> tuple[Array, Array]:
        """Return the monomials as affine functions of s where ``p = centre + radius s``, and their largest error.

        Shapes (n_monomials, 1 + n_outer), the constant first, and (n_monomials,). The error is that for ``|s| <= 1``,
        without rounding.
        """
        count = len(self.monomials)
        affine, missed = np.zeros((count, 1 + len(centre))), np.zeros(count)
        affine[:, 0] = 1.0
        for variable in self.monomials.T:
            real = variable >= 0
            middle, reach = np.where(real, centre[variable], 1.0), np.where(real, radius[variable], 0.0)
            missed = missed * (np.abs(middle) + reach) + np.abs(affine[:, 1:]).sum(axis=1) * reach
            slope = affine[:, 0] * reach
            affine = affine * middle[:, None]
            affine[np.arange(count), 1 + np.where(real, variable, 0)] += slope
        return affine, missed

    def recover(self, p: Array, z: Array) -> Array:
        """Return a point in the problem's own variables."""
        point = np.empty(len(self.outer) + len(self.inner))
        point[self.outer], point[self.inner] = p, self.centre + self.radius * z
        return point


def frame(lower: Array, upper: Array) -> tuple[Array, Array]:
    """Return centre and radius of a box, the radius rounded up."""
    centre = 0.5 * lower + 0.5 * upper
    radius = np.maximum(upper - centre, centre - lower)
    return centre, np.where(radius > 0, np.nextafter(radius, np.inf), 0.0)


def _rows(family: Polynomials, inner: Index, monomial: Index, n_inner: int, n_monomials: int) -> Rows:
    """Return the rows of one family of constraints."""
    shape = (family.n_rows, (1 + n_inner) * n_monomials)
    place = (family.rows, inner * n_monomials + monomial)
    return Rows(
        sparse.csr_matrix((family.coefficients.mid, place), shape=shape),
        sparse.csr_matrix((family.coefficients.rad, place), shape=shape),
    )
