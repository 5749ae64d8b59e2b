"""What each solver can do: a table, one line a back end; its library is imported when it is asked for."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache, cached_property
from importlib.util import find_spec

ZERO, NONNEGATIVE, SECOND_ORDER, SEMIDEFINITE = "zero", "nonnegative", "second order", "semidefinite"
ALL_CONES = (ZERO, NONNEGATIVE, SECOND_ORDER, SEMIDEFINITE)
INTERIOR = "interior point"


@dataclass(frozen=True)
class BackEnd:
    """One way to a solver.

    Parameters
    ----------
    name
        What ``solver=`` takes, in any case of letters.
    file
        The module of :mod:`relaxations.solvers` that runs it.
    library
        The package that must be importable.
    method
        ``"interior point"``, ``"first order"`` or ``"simplex"``; empty where cvxpy does not say.
    accuracy
        What a certified bound loses on small programs with an interior, as a share of the objective's coefficients.
        NaN where it has not been measured.
    settings
        Names of its other settings, to be tried in turn where the usual one stops short.
    install
        The line that installs it.
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
        """Tell whether its library can be imported, without doing so."""
        return find_spec(self.library) is not None

    @property
    def reached(self) -> str:
        """Tell how it is called."""
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
    """Return cvxpy's installed conic solvers, without those that are called directly."""
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
    """Return the table: those called directly, installed or not, then cvxpy's installed ones.

    Examples
    --------
    >>> [b.name for b in back_ends() if b.reached == "directly"]
    ['clarabel', 'sdpa', 'scs', 'highs']
    """
    return (*DIRECT, *through_cvxpy())
