"""Reasons for which a solver stops."""

from enum import Enum


class Stop(Enum):
    """The reason for which a solver stopped; it does not say what is proven.

    Examples
    --------
    >>> Stop.INEXACT.value
    'the solver stopped short of its tolerances'
    """

    SOLVED = "the solver reached its tolerances"
    INEXACT = "the solver stopped short of its tolerances"
    INFEASIBLE = "the solver reports an empty feasible set"
    UNBOUNDED = "the solver reports an unbounded objective"
    LIMIT = "the solver ran into its iteration or time limit"
    FAILED = "the solver failed"
