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
    n = len(split.inner)
    identity = sparse.identity(n)
    unequal = sparse.vstack([identity, -identity, -rows])
    last = np.concatenate([np.zeros(len(constant)), -np.ones(2 * n + len(slack))])
    program = ConicProgram(
        sparse.csc_matrix(sparse.hstack([sparse.vstack([matrix, unequal]), sparse.csr_matrix(last[:, None])])),
        np.concatenate([-constant, np.ones(2 * n), slack]),
        Cones(len(constant), 2 * n + len(slack), (), ()),
        (),
    )
    cost = np.zeros(n + 2)
    cost[-1] = 1.0
    found = solve(program, cost, solver)
    if not (np.isfinite(found.dual).all() and np.isfinite(found.moments).all()):
        return None
    equal = found.dual[: len(constant)]
    nonnegative = np.maximum(found.dual[len(constant) + 2 * n :], 0.0)
    return Answer(float(found.moments[-1]), found.moments[1:-1], np.concatenate([-equal, nonnegative]))
