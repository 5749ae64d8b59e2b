"""The common interface of all solvers.

A back end is a module with the function ``run(solver, program, objective[, setting])``. It returns

- the :class:`Stop` and the solver's own status text;
- the moments without the constant one, shape (n_moments - 1,);
- the dual vector, shape (n_rows,).

Vectors that the solver does not return are NaN. The objective has no constant. ``run`` observes
:func:`relaxations.deadline.remaining`, and imports an optional library when it is called.
"""

from __future__ import annotations

import time
from dataclasses import dataclass
from importlib import import_module

import numpy as np

from relaxations.algebra.arrays import Array
from relaxations.deadline import check_time
from relaxations.errors import ProblemError
from relaxations.moments.conic import ConicProgram
from relaxations.solvers.back_ends import (
    DIRECT,
    INTERIOR,
    SECOND_ORDER,
    SEMIDEFINITE,
    BackEnd,
    back_ends,
    from_packages,
    through_cvxpy,
)
from relaxations.solvers.boxed import boxed
from relaxations.solvers.stop import Stop

Solver = str | BackEnd  # what ``solver=`` takes


@dataclass(frozen=True)
class Attempt:
    """A solver and its setting: ``str(attempt)`` names both.

    Parameters
    ----------
    setting
        ``"boxed"`` (:mod:`relaxations.solvers.boxed`), a setting of the back end, or empty for the usual one.
    """

    solver: Solver
    setting: str = ""

    def __str__(self) -> str:
        return f"{self.solver if isinstance(self.solver, str) else self.solver.name} {self.setting}".rstrip()


@dataclass(frozen=True)
class ConicSolution:
    """The result of a solver; nothing in it is proven.

    Parameters
    ----------
    status
        The solver's own status text.
    moments
        Shape (n_moments,).
    dual
        Shape (n_rows,). The dual vector; for ``Stop.INFEASIBLE`` the Farkas ray.
    """

    stop: Stop
    status: str
    moments: Array
    dual: Array
    seconds: float


def available_solvers() -> tuple[str, ...]:
    """Return the names of all installed solvers: the values of ``solver=``.

    Examples
    --------
    >>> "clarabel" in available_solvers()
    True
    """
    return tuple(b.name for b in back_ends() if b.installed)


def _back_end(solver: Solver) -> BackEnd:
    """Return a back end by its name, or the object itself; ProblemError if it is unknown or not installed."""
    if isinstance(solver, BackEnd):
        found: BackEnd | None = solver
    else:
        # cvxpy is asked last: it takes half a second.
        tables = (lambda: DIRECT, from_packages, through_cvxpy)
        found = next((b for table in tables for b in table() if b.name.lower() == solver.lower()), None)
    if found is None:
        raise ProblemError(f"unknown solver {solver!r}: choose one of {', '.join(available_solvers())}")
    if not found.installed:
        raise ProblemError(
            f"the solver {found.name!r} is not installed: {found.install}, or choose one of "
            f"{', '.join(available_solvers())}"
        )
    return found


def check_solver(solver: Solver) -> None:
    """Refuse a solver that is unknown or not installed, before any computation.

    Raises
    ------
    ProblemError
        When the solver is unknown or not installed.

    Examples
    --------
    >>> check_solver("clarabel")
    """
    _back_end(solver)


def attempts(solver: Solver) -> tuple[Attempt, ...]:
    """Return the attempts in order: the solver with each of its settings, then the other interior-point solvers.

    Any dual vector gives a valid bound. So a caller stops when the certified bound is accurate enough, and uses the
    best bound of all attempts. First-order methods are left out, because they are slower and less accurate.

    Raises
    ------
    ProblemError
        When the solver is unknown or not installed.

    Examples
    --------
    >>> [str(a) for a in attempts("clarabel")][:3]
    ['clarabel', 'clarabel boxed', 'clarabel regularised']
    """
    own = _back_end(solver)
    others = [b for b in DIRECT if b is not own and b.installed and b.method == INTERIOR]
    return (
        *(Attempt(own if own.run else own.name, setting) for setting in ("", *own.settings)),
        *(Attempt(b.name, "boxed") for b in others),
    )


def solve(program: ConicProgram, objective: Array, attempt: Attempt | Solver = "clarabel") -> ConicSolution:
    """Return a solver's minimum of ``objective`` over a conic program.

    The result is NaN with ``Stop.FAILED`` if a coefficient is not finite. The solver is not called then.

    Parameters
    ----------
    objective
        Shape (n_moments,). Coefficients of the moments; entry 0 belongs to the constant.
    attempt
        A solver's name or back end means its usual setting: :func:`relaxations.solvers.back_ends` lists them.

    Raises
    ------
    ProblemError
        When the solver is unknown or not installed, or the program has cones that it cannot treat.
    TimeIsUp
        When no time is left. A solver that starts gets the remaining time as its limit.

    Examples
    --------
    >>> from relaxations.proof.bounding import relax
    >>> from relaxations.formats.expressions import problem_of, variables
    >>> (x,) = variables("x")
    >>> problem, _ = problem_of(x, [x >= -1, x <= 1])
    >>> found = solve(relax(problem, "dense", 1).program, np.array([0.0, -1.0, 1.0]))  # x^2 - x
    >>> found.stop.name, found.moments.round(3)
    ('SOLVED', array([1.  , 0.5 , 0.25]))
    """
    how = attempt if isinstance(attempt, Attempt) else Attempt(attempt)
    own = _back_end(how.solver)
    matrices = program.cones.second_order or program.cones.semidefinite
    if matrices and own.cones and not {SECOND_ORDER, SEMIDEFINITE} & set(own.cones):
        raise ProblemError(
            f"the solver {own.name!r} solves linear programs, and this relaxation has semidefinite blocks: choose "
            "method='rlt', or solver='clarabel'"
        )
    check_time()
    started = time.perf_counter()
    if not all(np.isfinite(data).all() for data in (objective, program.rhs, program.matrix.data)):
        unknown = np.full(len(objective), np.nan)
        return ConicSolution(Stop.FAILED, "NotFinite", unknown, np.full(program.n_rows, np.nan), 0.0)
    run = own.run or import_module(f"relaxations.solvers.{own.file}").run
    if how.setting == "boxed":
        wider, rows = boxed(program)
        stop, status, x, z = run(own.name, wider, objective[1:])
        z = z[rows]
    else:
        stop, status, x, z = run(own.name, program, objective[1:], *([how.setting] if how.setting else []))
    return ConicSolution(stop, status, np.concatenate([[1.0], x]), z, time.perf_counter() - started)
