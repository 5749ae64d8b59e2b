"""Why a solver stopped."""

from enum import Enum


class Stop(Enum):
    """Why a solver stopped; no statement about what is proven."""

    SOLVED = "the solver reached its tolerances"
    INEXACT = "the solver stopped short of its tolerances"
    INFEASIBLE = "the solver reports an empty feasible set"
    UNBOUNDED = "the solver reports an unbounded objective"
    LIMIT = "the solver ran into its iteration or time limit"
    FAILED = "the solver failed"
