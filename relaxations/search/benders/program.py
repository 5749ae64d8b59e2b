"""The linear program at fixed outer variables: their distance from feasible, and the multipliers of a cut."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import sparse

from relaxations.algebra.arrays import Array
from relaxations.moments.conic import Cones, ConicProgram
from relaxations.search.benders.elimination import eliminated
from relaxations.search.benders.split import Split
from relaxations.solvers import Solver, solve


@dataclass(frozen=True)
class Answer:
    """The solution of the linear program at a point.

    Parameters
    ----------
    inner
        Shape (n_inner,). Scaled.
    multipliers
        Shape (n_equalities + n_inequalities,). Of the cut that the point violates most.
    """

    excess: float
    inner: Array
    multipliers: Array


def ask(split: Split, p: Array, solver: Solver = "clarabel") -> Answer | None:
    """Return the least excess s such that all ``|z_t| <= 1 + s`` and all inequalities hold up to s.

    The point is feasible where s is not positive. None where the solver has no answer.

    Examples
    --------
    >>> from relaxations.formats.expressions import problem_of, variables
    >>> a, x = variables("a x")
    >>> problem, _ = problem_of(x, [a * x == 1, a >= 0.1, a <= 2, x >= 0, x <= 2])
    >>> split = Split.of(problem, np.array([0]))
    >>> [round(ask(split, np.array([value])).excess, 4) for value in (0.25, 0.4, 1.0)]  # a must be 1/2 at least
    [2.0, 0.5, -1.0]
    """
    values = split.values(p)
    constant, matrix = split.equalities.at(values)
    slack, rows = split.inequalities.at(values)
    if not rows.nnz and (fast := eliminated(constant, matrix, slack)):
        return Answer(*fast)
    found = least_excess(constant, matrix, slack, rows, solver)
    return None if found is None else Answer(*found)


def least_excess(
    constant: Array, matrix: sparse.csc_matrix, slack: Array, rows: sparse.csc_matrix, solver: Solver
) -> tuple[float, Array, Array] | None:
    """Return the least s with ``constant + matrix z = 0``, ``|z_t| <= 1 + s`` and ``slack + rows z >= -s``.

    With it come z and the multipliers of equalities and inequalities. None where the solver has no answer.
    """
    m, n = matrix.shape
    equal, unequal, each = matrix.tocoo(), rows.tocoo(), np.arange(n)
    beyond = np.arange(m, m + 2 * n + len(slack))  # the rows with s
    triplets = (
        np.concatenate([equal.data, np.ones(n), -np.ones(n), -unequal.data, -np.ones(len(beyond))]),
        (
            np.concatenate([equal.row, m + each, m + n + each, m + 2 * n + unequal.row, beyond]),
            np.concatenate([equal.col, each, each, unequal.col, np.full(len(beyond), n)]),
        ),
    )
    program = ConicProgram(
        sparse.csc_matrix(triplets, shape=(m + len(beyond), n + 1)),
        np.concatenate([-constant, np.ones(2 * n), slack]),
        Cones(m, len(beyond), (), ()),
        (),
    )
    cost = np.zeros(n + 2)
    cost[-1] = 1.0
    found = solve(program, cost, solver)
    if not (np.isfinite(found.dual).all() and np.isfinite(found.moments).all()):
        return None
    nonnegative = np.maximum(found.dual[m + 2 * n :], 0.0)
    return float(found.moments[-1]), found.moments[1:-1], np.concatenate([-found.dual[:m], nonnegative])
