"""The table of back ends: what each solver can do. Its library is imported when the solver is called."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache, cached_property
from importlib.metadata import entry_points
from importlib.util import find_spec
from typing import Any

ZERO, NONNEGATIVE, SECOND_ORDER, SEMIDEFINITE = "zero", "nonnegative", "second order", "semidefinite"
ALL_CONES = (ZERO, NONNEGATIVE, SECOND_ORDER, SEMIDEFINITE)
INTERIOR = "interior point"


@dataclass(frozen=True)
class BackEnd:
    """One way to call a solver.

    Parameters
    ----------
    name
        The value of ``solver=``, in upper or lower case.
    file
        The module of :mod:`relaxations.solvers` that runs it; not needed with ``run``.
    library
        The package that must be importable; empty where none is needed.
    method
        ``"interior point"``, ``"first order"`` or ``"simplex"``; empty if unknown.
    accuracy
        Typical gap between a certified bound and the optimum on small programs, as a share of the objective's
        coefficients. NaN if not measured.
    settings
        Further settings, tried in turn if the usual one is not accurate enough.
    install
        The command that installs it.
    run
        A function ``run(name, program, objective)`` (and a setting as a fourth argument, where ``settings`` names
        some) that returns a :class:`relaxations.solvers.Stop`, the solver's word, the moments without the constant, and
        the dual vector. For a solver from outside this package.
    """

    name: str
    file: str = ""
    library: str = ""
    cones: tuple[str, ...] = ALL_CONES
    method: str = ""
    accuracy: float = float("nan")
    settings: tuple[str, ...] = ()
    install: str = ""
    run: Callable[..., tuple[Any, ...]] | None = None

    @cached_property
    def installed(self) -> bool:
        """Return whether its library can be imported, without importing it."""
        return not self.library or find_spec(self.library) is not None

    @property
    def reached(self) -> str:
        """Return ``"directly"`` or ``"through cvxpy"``."""
        return "through cvxpy" if self.file == "through_cvxpy" else "directly"


DIRECT = (
    BackEnd(
        "clarabel", "clarabel", "clarabel", ALL_CONES, INTERIOR, 1e-6, ("boxed", "regularised"), "pip install clarabel"
    ),
    BackEnd("sdpa", "sdpa", "sdpap", ALL_CONES, INTERIOR, 1e-5, ("boxed",), "pip install sdpa-python"),
    BackEnd("scs", "scs", "scs", ALL_CONES, "first order", 1e-4, (), "pip install scs"),
    BackEnd("highs", "highs", "scipy", (ZERO, NONNEGATIVE), "simplex", 1e-6, (), "pip install scipy"),
)


@cache
def through_cvxpy() -> tuple[BackEnd, ...]:
    """Return the installed conic solvers of cvxpy, without those that are called directly."""
    import cvxpy
    from cvxpy.reductions.solvers.defines import SOLVER_MAP_CONIC

    of_cvxpy = {cvxpy.Zero: ZERO, cvxpy.NonNeg: NONNEGATIVE, cvxpy.SOC: SECOND_ORDER, cvxpy.PSD: SEMIDEFINITE}
    found = []
    for name in cvxpy.installed_solvers():
        if name.lower() in {d.name for d in DIRECT}:
            continue
        known = getattr(SOLVER_MAP_CONIC.get(name), "SUPPORTED_CONSTRAINTS", ())
        cones = tuple(cone for kind, cone in of_cvxpy.items() if kind in known)
        found.append(BackEnd(name, "through_cvxpy", "cvxpy", cones, "", float("nan")))
    return tuple(found)


@cache
def from_packages() -> tuple[BackEnd, ...]:
    """Return the back ends of other packages: entry points in the group ``relaxations.solvers``."""
    return tuple(point.load() for point in entry_points(group="relaxations.solvers"))


def back_ends() -> tuple[BackEnd, ...]:
    """Return the solvers that are called directly, installed or not, those of other packages, then those of cvxpy.

    Examples
    --------
    >>> [b.name for b in back_ends() if b.reached == "directly"]
    ['clarabel', 'sdpa', 'scs', 'highs']
    """
    return (*DIRECT, *from_packages(), *through_cvxpy())
