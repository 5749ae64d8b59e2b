"""Many sparse polynomials as NumPy arrays of terms: (row, monomial, coefficient).

A monomial is the sorted list of its variables with repetition, padded in front with -1. In degree 4, ``x3**2 * x7`` is
``[-1, 3, 3, 7]``. The product of two monomials is their concatenation, sorted. So thousands of constraints are
multiplied and collected without a Python loop over monomials.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from relaxations.algebra.arrays import Array, Index
from relaxations.algebra.ball_arithmetic import Balls, concatenate

Factors = NDArray[np.int64]


def pad(factors: Factors, degree: int) -> Factors:
    """Return monomials of shape (n, k) with -1 added in front, so that they have at least ``degree`` columns."""
    missing = degree - factors.shape[1]
    return factors if missing <= 0 else np.pad(factors, ((0, 0), (missing, 0)), constant_values=-1)


def padded(monomials: Sequence[Sequence[int]]) -> Factors:
    """Return monomials of any lengths as rows, sorted and padded in front with -1."""
    degree = max(map(len, monomials), default=0)
    rows = [[-1] * (degree - len(m)) + sorted(m) for m in monomials]
    return np.array(rows, dtype=np.int64).reshape(len(rows), degree)


def trim(factors: Factors) -> Factors:
    """Return monomials without the leading columns that contain only -1."""
    used = (factors >= 0).any(axis=0)
    return factors[:, int(np.argmax(used)) :] if used.any() else factors[:, :0]


def multiply(left: Factors, right: Factors) -> Factors:
    """Return the products of monomials row by row; a single row multiplies every row of the other.

    >>> multiply(np.array([[-1, 1], [0, 2]]), np.array([[1]]))  # x1 and x0 x2, times x1
    array([[-1,  1,  1],
           [ 0,  1,  2]])
    """
    rows = max(len(left), len(right))
    joined = np.concatenate(
        [np.broadcast_to(f, (rows, f.shape[1])) for f in (left, right)],
        axis=1,
    )
    return trim(np.sort(joined, axis=1))


def unique(factors: Factors) -> tuple[Factors, Index]:
    """Return the distinct monomials, the constant first, and ``place`` with ``monomials[place] == factors``."""
    if factors.shape[1] == 0:
        return factors[:1], np.zeros(len(factors), dtype=np.int64)
    # Pack the columns into integers of at most 62 bits: these sort faster than rows.
    base = int(factors.max(initial=0)) + 2
    per_word = max(1, int(62 / np.log2(base)))
    columns = factors.shape[1]
    words = []
    for start in range(0, columns, per_word):
        word = np.zeros(len(factors), dtype=np.int64)
        for column in range(start, min(start + per_word, columns)):
            word = word * base + (factors[:, column] + 1)
        words.append(word)
    if len(words) == 1:
        _, first, inverse = np.unique(words[0], return_index=True, return_inverse=True)
    else:
        _, first, inverse = np.unique(np.stack(words, axis=1), axis=0, return_index=True, return_inverse=True)
    return factors[first], inverse.reshape(-1).astype(np.int64)


@dataclass(frozen=True)
class Polynomials:
    """``n_rows`` polynomials in the same variables.

    Parameters
    ----------
    rows
        Shape (n_terms,). Number of the polynomial to which each term belongs.
    factors
        Shape (n_terms, degree). Monomial of each term: sorted variable numbers, padded in front with -1.
    coefficients
        Shape (n_terms,).

    Examples
    --------
    >>> p = Polynomials.from_terms([{(0, 1): 2.0, (): -1.0}])   # 2 x0 x1 - 1
    >>> p.degree
    2
    >>> p.evaluate(np.array([3.0, 4.0]))
    array([23.])
    """

    n_rows: int
    rows: Index
    factors: Factors
    coefficients: Balls

    @staticmethod
    def empty() -> Polynomials:
        """Return a family without polynomials."""
        none = np.zeros(0, dtype=np.int64)
        return Polynomials(0, none, none.reshape(0, 0), Balls.exact(none))

    @staticmethod
    def from_terms(polynomials: Sequence[Mapping[tuple[int, ...], float]]) -> Polynomials:
        """Return one polynomial for each mapping ``{variables with repetition: coefficient}``."""
        rows = np.array([row for row, p in enumerate(polynomials) for _ in p], dtype=np.int64)
        factors = padded([key for p in polynomials for key in p])
        coefficients = Balls.exact([value for p in polynomials for value in p.values()])
        return Polynomials(len(polynomials), rows, factors, coefficients).collect()

    @staticmethod
    def join(parts: Sequence[Polynomials]) -> Polynomials:
        """Return the polynomials of all parts, one part after the other."""
        if not parts:
            return Polynomials.empty()
        degree = max(p.factors.shape[1] for p in parts)
        offsets = np.cumsum([0, *(p.n_rows for p in parts)])
        return Polynomials(
            int(offsets[-1]),
            np.concatenate([p.rows + o for p, o in zip(parts, offsets[:-1], strict=True)]),
            np.concatenate([pad(p.factors, degree) for p in parts]),
            concatenate([p.coefficients for p in parts]),
        )

    @staticmethod
    def variables(indices: Index, coefficients: Array | float = 1.0, constants: Array | float = 0.0) -> Polynomials:
        """Return the affine family ``constants + coefficients * x[indices]``."""
        count = len(indices)
        own = np.arange(count)
        return Polynomials(
            count,
            np.concatenate([own, own]),
            np.concatenate([np.full((count, 1), -1), np.asarray(indices, dtype=np.int64).reshape(-1, 1)]),
            Balls.exact(np.concatenate([np.broadcast_to(constants, count), np.broadcast_to(coefficients, count)])),
        ).collect()

    @cached_property
    def term_degrees(self) -> Index:
        """Return the degree of every term."""
        return np.asarray((self.factors >= 0).sum(axis=1), dtype=np.int64)

    @property
    def degree(self) -> int:
        """Return the largest degree of any polynomial."""
        return int(self.term_degrees.max(initial=0))

    def row_degrees(self) -> Index:
        """Return the degree of each polynomial, shape (n_rows,)."""
        degrees = np.zeros(self.n_rows, dtype=np.int64)
        np.maximum.at(degrees, self.rows, self.term_degrees)
        return degrees

    def take(self, rows: Index) -> Polynomials:
        """Return the polynomials with the given numbers, in that order; a number may occur more than once.

        >>> Polynomials.variables(np.array([0, 1])).take(np.array([1, 0, 1])).evaluate(np.array([2.0, 3.0]))
        array([3., 2., 3.])
        """
        terms, places = self._terms_of(np.asarray(rows, dtype=np.int64))
        return Polynomials(len(rows), places, trim(self.factors[terms]), self.coefficients[terms])

    def _terms_of(self, rows: Index) -> tuple[Index, Index]:
        """Return the terms of each row that is given, and for each term the place of its row among those given."""
        order = np.argsort(self.rows, kind="stable")
        counts = np.bincount(self.rows, minlength=self.n_rows)
        first = (np.cumsum(counts) - counts)[rows]
        repeat = counts[rows]
        places = np.repeat(np.arange(len(rows)), repeat)
        within = np.arange(len(places)) - np.repeat(np.cumsum(repeat) - repeat, repeat)
        return order[first[places] + within], places

    def renumbered(self, numbers: Index) -> Polynomials:
        """Return the polynomials with variable k replaced by variable ``numbers[k]``."""
        moved = np.where(self.factors >= 0, numbers[self.factors], -1)
        return Polynomials(self.n_rows, self.rows, np.sort(moved, axis=1), self.coefficients)

    def collect(self) -> Polynomials:
        """Return the polynomials with equal monomials added up and zero terms dropped."""
        monomials, which = unique(self.factors)
        key, place = np.unique(self.rows * max(len(monomials), 1) + which, return_inverse=True)
        total = self.coefficients.segment_sum(place.reshape(-1), len(key))
        kept = (total.mid != 0) | (total.rad != 0)
        key = key[kept]
        rows, which = np.divmod(key, max(len(monomials), 1))
        return Polynomials(self.n_rows, rows, trim(monomials[which]), total[kept])

    def times_monomials(self, monomials: Factors) -> Polynomials:
        """Return all products: polynomial i times monomial j is row ``i * len(monomials) + j``."""
        count = len(monomials)
        terms = len(self.rows)
        factors = multiply(np.repeat(self.factors, count, axis=0), np.tile(monomials, (terms, 1)))
        return Polynomials(
            self.n_rows * count,
            np.repeat(self.rows, count) * count + np.tile(np.arange(count), terms),
            factors,
            self.coefficients[np.repeat(np.arange(terms), count)],
        )

    def times(self, other: Polynomials) -> Polynomials:
        """Return the products row by row, with rounding errors enclosed.

        >>> x = Polynomials.variables(np.array([0, 1]), 1.0, 1.0)  # 1 + x0, 1 + x1
        >>> x.times(x).evaluate(np.array([1.0, 2.0]))
        array([4., 9.])
        """
        # Pair each term of a row with each term of the other factor's row.
        theirs, mine = other._terms_of(self.rows)
        return Polynomials(
            self.n_rows,
            self.rows[mine],
            multiply(self.factors[mine], other.factors[theirs]),
            self.coefficients[mine] * other.coefficients[theirs],
        ).collect()

    def substitute_affine(self, centre: Array, scale: Array) -> Polynomials:
        """Return the polynomials in t for ``x = centre + scale * t``, with rounding errors enclosed."""
        rows, factors, coefficients = self.rows, self.factors, self.coefficients
        for column in range(self.factors.shape[1]):
            variable = factors[:, column]
            real = variable >= 0
            slope = Balls.exact(np.where(real, scale[variable], 1.0))
            moved = real & (centre[variable] != 0)
            constant = coefficients[moved] * Balls.exact(centre[variable[moved]])
            # The coefficient stays exact for a padding column and for a slope of 1.
            linear = coefficients * slope
            linear = Balls(
                np.where(slope.mid == 1, coefficients.mid, linear.mid),
                np.where(slope.mid == 1, coefficients.rad, linear.rad),
            )
            dropped = factors[moved].copy()
            dropped[:, column] = -1
            rows = np.concatenate([rows, rows[moved]])
            factors = np.concatenate([factors, dropped])
            coefficients = concatenate([linear, constant])
        return Polynomials(self.n_rows, rows, trim(np.sort(factors, axis=1)), coefficients).collect()

    def below(self, value: float) -> Polynomials:
        """Return ``value - p`` for each polynomial p, which is nonnegative where ``p <= value``."""
        minus = Polynomials(self.n_rows, self.rows, self.factors, -self.coefficients)
        both = Polynomials.join([minus, Polynomials.from_terms([{(): value}] * self.n_rows)])
        return Polynomials(self.n_rows, both.rows % self.n_rows, both.factors, both.coefficients).collect()

    def scale_rows(self, powers_of_two: Array) -> Polynomials:
        """Return each polynomial times an exact power of two."""
        return Polynomials(self.n_rows, self.rows, self.factors, self.coefficients.scaled(powers_of_two[self.rows]))

    def evaluate(self, point: Array) -> Array:
        """Return the values at a point, in plain floating-point arithmetic."""
        values = self.coefficients.mid * np.prod(np.append(point, 1.0)[self.factors], axis=1)  # -1 is the last entry
        return np.asarray(np.bincount(self.rows, values, self.n_rows), dtype=np.float64)

    def derivatives(self, n_variables: int) -> Polynomials:
        """Return the derivative of each polynomial by each variable: row ``i * n_variables + k``.

        >>> Polynomials.from_terms([{(0, 0, 1): 2.0}]).derivatives(2).evaluate(np.array([3.0, 5.0]))
        array([60., 18.])
        """
        term, column = np.nonzero(self.factors >= 0)
        left = self.factors[term]
        rows = self.rows[term] * n_variables + left[np.arange(len(term)), column]
        left[np.arange(len(term)), column] = -1
        count = self.n_rows * n_variables
        return Polynomials(count, rows, trim(np.sort(left, axis=1)), self.coefficients[term]).collect()

    def jacobian(self, point: Array) -> tuple[Index, Index, Array]:
        """Return the derivatives at a point as triplets (row, variable, value); a pair may occur more than once."""
        rows, columns, values = [], [], []
        powers = np.where(self.factors >= 0, point[self.factors], 1.0)
        for column in range(self.factors.shape[1]):
            real = self.factors[:, column] >= 0
            rows.append(self.rows[real])
            columns.append(self.factors[real, column])
            others = np.delete(powers[real], column, axis=1)
            values.append(self.coefficients.mid[real] * np.prod(others, axis=1))
        if not rows:
            none = np.zeros(0, dtype=np.int64)
            return none, none, np.zeros(0)
        return np.concatenate(rows), np.concatenate(columns), np.concatenate(values)

    def slopes(self, point: Array) -> sparse.csr_matrix:
        """Return the derivatives at a point as a matrix of shape (n_rows, len(point)).

        >>> Polynomials.from_terms([{(0, 0, 1): 2.0}]).slopes(np.array([3.0, 5.0])).toarray()
        array([[60., 18.]])
        """
        starts, columns, places = self._pattern
        values = np.bincount(places, self.jacobian(point)[2], len(columns))
        return sparse.csr_matrix((values, columns, starts), shape=(self.n_rows, len(point)))

    @cached_property
    def _pattern(self) -> tuple[Index, Index, Index]:
        """Where each row of the matrix of derivatives starts, its columns, and the place of each triplet."""
        rows, columns, _ = self.jacobian(np.zeros(int(self.factors.max(initial=-1)) + 1))
        pairs, places = np.unique(np.stack([rows, columns], axis=1), axis=0, return_inverse=True)
        starts = np.searchsorted(pairs[:, 0], np.arange(self.n_rows + 1))
        return starts.astype(np.int32), pairs[:, 1].astype(np.int32), places.reshape(-1)

    def at_zero(self, variables: Index, n_variables: int) -> Polynomials:
        """Return the polynomials with some variables set to zero, and the other variables numbered anew."""
        kept = np.setdiff1d(np.arange(n_variables), variables)
        place = np.full(n_variables + 1, -1, dtype=np.int64)  # the last entry is for padding, -1
        place[kept] = np.arange(len(kept))
        left = ~np.isin(self.factors, variables).any(axis=1)
        return Polynomials(self.n_rows, self.rows[left], trim(place[self.factors[left]]), self.coefficients[left])

    def occurring(self) -> Index:
        """Return the numbers of the variables that occur, sorted."""
        return np.unique(self.factors[self.factors >= 0])

    def terms(self) -> list[list[tuple[float, float, list[int]]]]:
        """Return the terms (midpoint, radius, variables) of each polynomial as Python objects."""
        members: list[list[tuple[float, float, list[int]]]] = [[] for _ in range(self.n_rows)]
        for row, mid, rad, factor in zip(
            self.rows.tolist(),
            self.coefficients.mid.tolist(),
            self.coefficients.rad.tolist(),
            self.factors.tolist(),
            strict=True,
        ):
            members[row].append((mid, rad, [v for v in factor if v >= 0]))
        return members
