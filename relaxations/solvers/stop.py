"""Why a solver stopped."""

from enum import Enum


class Stop(Enum):
    """Why a solver stopped; no statement about what is proven.

    Examples
    --------
    >>> import numpy as np
    >>> from relaxations.proof.bounding import relax
    >>> from relaxations.formats.expressions import problem_of, variables
    >>> from relaxations.solvers import solve
    >>> x, y = variables("x y")
    >>> problem, _ = problem_of(x, [x**2 + y**2 <= 1, x + y >= 2])
    >>> relaxed = relax(problem, "dense", 1)
    >>> solve(relaxed.program, np.zeros(relaxed.relaxation.n_moments)).stop.value
    'the solver reports an empty feasible set'
    """

    SOLVED = "the solver reached its tolerances"
    INEXACT = "the solver stopped short of its tolerances"
    INFEASIBLE = "the solver reports an empty feasible set"
    UNBOUNDED = "the solver reports an unbounded objective"
    LIMIT = "the solver ran into its iteration or time limit"
    FAILED = "the solver failed"
