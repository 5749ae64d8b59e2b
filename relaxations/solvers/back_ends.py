"""The table of back ends: what each solver can do. Its library is imported when the solver is called."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache, cached_property
from importlib.util import find_spec

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
        The module of :mod:`relaxations.solvers` that has the function ``run`` (:mod:`relaxations.solvers.interface`).
    library
        The package that must be importable.
    method
        ``"interior point"``, ``"first order"`` or ``"simplex"``; empty if unknown.
    accuracy
        Typical gap between a certified bound and the optimum on small programs, as a share of the objective's
        coefficients. NaN if not measured.
    settings
        Further settings, tried in turn if the usual one is not accurate enough.
    install
        The command that installs it.
    """

    name: str
    file: str
    library: str
    cones: tuple[str, ...]
    method: str
    accuracy: float
    settings: tuple[str, ...] = ()
    install: str = ""

    @cached_property
    def installed(self) -> bool:
        """Return whether its library can be imported, without importing it."""
        return find_spec(self.library) is not None

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


def back_ends() -> tuple[BackEnd, ...]:
    """Return the solvers that are called directly, installed or not, then those of cvxpy.

    Examples
    --------
    >>> [b.name for b in back_ends() if b.reached == "directly"]
    ['clarabel', 'sdpa', 'scs', 'highs']
    """
    return (*DIRECT, *through_cvxpy())
