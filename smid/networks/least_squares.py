"""A least-squares problem as the methods use it: the error at a point, and its normal equations.

    E(theta) = r'r / n,    E(theta + d) ~ E + 2 d'(J'r / n) + d'(J'J / n) d,    J = d r / d theta

The normal equations are summed over blocks of samples, so that no Jacobian of millions of rows is held in memory.

A problem may have a box. The methods then project: a trial is cut at the box, and a number at an end of its box stays
there while the gradient points outwards. (An infinite error outside the box would end a descent at its first wall.)

Reference: Bertsekas, "Projected Newton methods for optimization problems with simple constraints", SIAM J. Control
Optim. 20 (1982).
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from typing import Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from relaxations.algebra.arrays import Array
from smid.models import ModelError

__all__ = ["Bounded", "Iterate", "LeastSquares", "Method", "NormalEquations", "box_of", "held", "sum_normal_equations"]


@dataclass(frozen=True, eq=False)
class NormalEquations:
    """The quadratic model of the error around a point.

    Parameters
    ----------
    error
        Mean of the squared residuals.
    gradient
        Shape (p,). ``J'r / n``, half the gradient of the error.
    gram
        Shape (p, p). ``J'J / n``.
    """

    error: float
    gradient: Array
    gram: Array


class LeastSquares(Protocol):
    """A problem that the methods can minimise."""

    def error(self, theta: Array) -> float:
        """Return the mean of the squared residuals; infinite or NaN where there is none."""
        ...

    def normal_equations(self, theta: Array) -> NormalEquations:
        """Return the normal equations."""
        ...


@runtime_checkable
class Bounded(LeastSquares, Protocol):
    """A problem whose numbers lie in a box."""

    @property
    def box(self) -> tuple[Array, Array]:
        """Return the lower and the upper ends, shape (p,) each."""
        ...


def box_of(problem: LeastSquares, theta: Array) -> tuple[Array, Array]:
    """Return the box of a problem, infinite where it has none."""
    if isinstance(problem, Bounded):
        return problem.box
    return np.full(theta.shape, -np.inf), np.full(theta.shape, np.inf)


def held(theta: Array, gradient: Array, lower: Array, upper: Array) -> NDArray[np.bool_]:
    """Return which numbers stay at an end of their box, because the error falls outwards; shapes (..., p)."""
    return np.asarray(((theta <= lower) & (gradient > 0)) | ((theta >= upper) & (gradient < 0)) | (lower == upper))


@dataclass(frozen=True, eq=False)
class Iterate:
    """A point of a descent, shape (p,), and the mean of its squared residuals."""

    theta: Array
    error: float


Method = Callable[[LeastSquares, Array], Iterator[Iterate]]
"""Yields the start, then points of falling error; ends when no step lowers the error."""


def sum_normal_equations(blocks: Iterable[tuple[Array, Array]]) -> NormalEquations:
    """Return the normal equations of blocks of samples.

    Parameters
    ----------
    blocks
        Residuals, shape (n_i,), and their Jacobian, shape (n_i, p).

    Raises
    ------
    ModelError
        If there is no sample.

    Examples
    --------
    >>> sum_normal_equations([(np.array([1.0, 3.0]), np.array([[1.0], [2.0]]))]).gradient
    array([3.5])
    """
    square, gradient, gram, count = 0.0, np.zeros(1), np.zeros((1, 1)), 0
    for residual, jacobian in blocks:
        square += float(residual @ residual)
        gradient = gradient + jacobian.T @ residual
        gram = gram + jacobian.T @ jacobian
        count += residual.size
    if not count:
        raise ModelError("least squares without samples: give at least one residual")
    return NormalEquations(square / count, gradient / count, gram / count)
