"""What a solver is asked and what it answers."""

from __future__ import annotations

import time
from dataclasses import dataclass

import numpy as np

from relaxations.balls import Array
from relaxations.conic import ConicProgram
from relaxations.errors import ProblemError
from relaxations.solvers.stop import Stop


@dataclass(frozen=True)
class ConicSolution:
    """A solver's answer, none of it proven.

    Parameters
    ----------
    stop : Stop
    status : str
        The solver's own word.
    moments : ndarray, shape (n_moments,), the constant first
    dual : ndarray, shape (n_rows,)
        The dual vector; for ``Stop.INFEASIBLE`` the Farkas ray.
    seconds : float
    """

    stop: Stop
    status: str
    moments: Array
    dual: Array
    seconds: float


def available_solvers() -> tuple[str, ...]:
    """Return the names that ``solver=`` takes on this machine: ``clarabel`` and cvxpy's installed solvers."""
    import cvxpy

    return ("clarabel", *(name for name in cvxpy.installed_solvers() if name != "CLARABEL"))


def check_solver(solver: str) -> None:
    """Raise ProblemError unless ``solver`` is known, before any work."""
    if solver != "clarabel" and solver not in available_solvers():
        raise ProblemError(f"unknown solver {solver!r}: choose one of {', '.join(available_solvers())}")


def solve(program: ConicProgram, objective: Array, solver: str = "clarabel") -> ConicSolution:
    """Minimise ``objective`` over a conic program.

    Parameters
    ----------
    program : ConicProgram
    objective : ndarray, shape (n_moments,)
        Coefficients of the moments; entry 0 belongs to the constant.
    solver : str
        ``"clarabel"``, or the name of any conic solver that cvxpy knows.

    Raises
    ------
    ProblemError
        For an unknown solver.
    """
    check_solver(solver)
    started = time.perf_counter()
    # A solver's library is imported when it is asked for.
    if solver == "clarabel":
        from relaxations.solvers import clarabel

        stop, status, x, z = clarabel.run(program, objective[1:])
    else:
        from relaxations.solvers import through_cvxpy

        stop, status, x, z = through_cvxpy.run(solver, program, objective[1:])
    return ConicSolution(stop, status, np.concatenate([[1.0], x]), z, time.perf_counter() - started)
