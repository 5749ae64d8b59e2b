"""A certified box for variables that have none.

Let U be the unbounded variables; constraints that are not affine in them together are left out. Outside the cube
``|x_k| <= m_k tau`` (k in U, tau >= 1) write ``x_k = m_k tau rho_k`` with ``max |rho_k| = 1`` and ``s = 1 / tau`` in
[0, 1]. A row times s,

    s f_0 + sum_k m_k rho_k f_k,

is a polynomial again, over variables that are all bounded. A latent that enters the rows with s only, as ``s z``,
becomes one variable ``z'`` with ``s l <= z' <= s u``, which keeps the problem linear in it. On each face
``rho_k = 1`` and ``rho_k = -1`` a certified lower bound ``s_min > 0`` of s proves ``tau <= 1 / s_min`` there; an empty
face proves ``tau < 1``. The largest tau over all faces bounds every variable of U. Where ``s_min`` stays at zero the
data do not bound the variables (or the order is too low to show it), and that is reported.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from relaxations.algebra.arrays import Array, Index
from relaxations.algebra.polynomial import Polynomials, pad
from relaxations.deadline import Progress
from relaxations.moments.parametric_lift import complicating_variables
from relaxations.problem.problem import PolynomialProblem
from relaxations.proof.bounding import relax
from relaxations.proof.proof_steps import Bound, Reach, Recorder, Step
from relaxations.search.benders.enclose import enclose
from relaxations.search.enclosure import uninterrupted
from relaxations.search.hierarchy import intervals
from relaxations.search.interval_state import Ends
from relaxations.search.plan import Plan
from relaxations.search.tightener import BOXES
from relaxations.solvers import Solver

BLOCKS, LENGTHS = 4, (12, 250)  # so many blocks of equalities, first short ones, are tried before all of them
LONG = 6  # times the length of a block: of fewer equalities blocks are most
ROUGH = 0.5  # of the width that is left of the scale: a box twice as large as it need be will do


@dataclass(frozen=True)
class DerivedBox:
    """A problem with the box that was proven (unchanged where none was), and the variables that this concerns."""

    problem: PolynomialProblem
    derived: tuple[str, ...]
    unbounded: tuple[str, ...]


def derive_box(
    problem: PolynomialProblem,
    magnitude: Array,
    solver: Solver = "clarabel",
    progress: Progress | None = None,
    record: Recorder | None = None,
) -> DerivedBox:
    """Prove a finite box for the unbounded variables, or name those for which none could be proven.

    Parameters
    ----------
    magnitude
        Shape (n_variables,). Guess of the size of each unbounded variable; a poor guess gives a wider box.
    record
        Called with the proof of the box (:mod:`relaxations.proof.proof_steps`), where there is one.

    Raises
    ------
    ProblemError
        For an unknown solver, or one that is not installed.

    Examples
    --------
    >>> import sympy
    >>> from relaxations.problem.problem import from_sympy
    >>> theta, error = sympy.symbols("theta error")
    >>> problem, _ = from_sympy(None, [], [2 * theta + error - 1], [theta, error], {error: (-0.1, 0.1)})
    >>> found = derive_box(problem, np.array([0.25, 1.0]))
    >>> found.derived, found.problem.upper.round(6)
    (('theta',), array([0.55, 0.1 ]))
    """
    loose = np.flatnonzero(~np.isfinite(problem.upper - problem.lower))
    if not len(loose):
        return DerivedBox(problem, (), ())
    # A part of a long problem often suffices: fewer constraints only enlarge the set.
    for length in (length for length in LENGTHS if problem.equalities.n_rows > LONG * length):
        left = _part(problem, loose, length)
        part, _ = problem.without(np.setdiff1d(np.arange(problem.n_variables), left))
        found = _derived(part, np.searchsorted(left, loose), magnitude[left], solver, progress, record)
        if not found.unbounded:
            lower, upper = problem.lower.copy(), problem.upper.copy()
            lower[left], upper[left] = found.problem.lower, found.problem.upper
            return replace(found, problem=problem.with_box(lower, upper))
    return _derived(problem, loose, magnitude, solver, progress, record)


def _derived(
    problem: PolynomialProblem,
    loose: Index,
    magnitude: Array,
    solver: Solver,
    progress: Progress | None,
    record: Recorder | None,
) -> DerivedBox:
    """Prove a finite box for the loose variables from all constraints of a problem."""
    # Multiply the rows by s; those that are not affine in the loose variables together are left out.
    names = tuple(problem.names[k] for k in loose)
    kept = [_jointly_affine(family, loose) for family in (problem.equalities, problem.inequalities)]
    affine = replace(
        problem, equalities=problem.equalities.take(kept[0]), inequalities=problem.inequalities.take(kept[1])
    )
    riding = _riding(affine, loose)
    cone, scale = _homogenise(affine, loose, riding, magnitude)
    # Bound s from below on every face of the cube.
    s = problem.n_variables
    largest = 1.0
    faces: list[tuple[int, int, tuple[Step, ...]]] = []
    for k in loose:
        for side in (1, -1):
            if (side > 0 and problem.upper[k] <= 0) or (side < 0 and problem.lower[k] >= 0):
                continue
            lower, upper = cone.lower.copy(), cone.upper.copy()
            lower[k] = upper[k] = side
            face = cone.with_box(lower, upper)
            steps: list[Step] = []
            least = _least_scale(face, s, solver, progress, steps.append if record else None)
            faces.append((int(k), side, tuple(steps)))
            if least <= 0:
                return DerivedBox(problem, (), names)
            largest = max(largest, 1.0 / np.nextafter(least, 0))
    # The largest tau over all faces bounds every loose variable.
    if record:
        record(Reach(problem, cone, loose, riding, scale[loose], kept[0], kept[1], tuple(faces)))
    reach = np.nextafter(largest * scale[loose] * (1 + 1e-12), np.inf)
    lower, upper = problem.lower.copy(), problem.upper.copy()
    lower[loose] = np.maximum(lower[loose], -reach)
    upper[loose] = np.minimum(upper[loose], reach)
    return DerivedBox(problem.with_box(lower, upper), names, ())


def _part(problem: PolynomialProblem, loose: Index, length: int) -> Index:
    """Return the variables of some equalities, blocks of successive ones evenly over all, and the unbounded ones."""
    starts = np.linspace(0, problem.equalities.n_rows - length, BLOCKS).astype(np.int64)
    rows = np.unique(starts[:, None] + np.arange(length))
    return np.union1d(problem.equalities.take(rows).occurring(), loose)


def _least_scale(
    face: PolynomialProblem, s: int, solver: Solver, progress: Progress | None, record: Recorder | None
) -> float:
    """Return a certified lower bound of s over a face; infinite where the face is empty."""
    # Try the least order, then cuts on a long record, then contractions up to the highest order.
    plan = Plan.of(face)
    relaxed = relax(face, plan.method, plan.least, solver)
    first = relaxed.bound(face.variable(s))
    if first.bound > 0:
        if record:
            record(Bound.of(relaxed, face.variable(s), first))
        return first.bound
    if plan.cuts:
        ends = Ends(face.lower.copy(), face.upper.copy(), ROUGH, 0.0, [])
        say = progress or (lambda _: None)
        end = [(s, 1)]
        empty = enclose(
            face, ends, end, plan.complicating, solver=solver, start=None, nodes=BOXES, say=say, record=record
        )
        if empty is not None or ends.lower[s] > 0:
            return np.inf if empty is not None else float(ends.lower[s])
    found = uninterrupted(
        intervals(
            face,
            [s],
            method=plan.without_cuts,
            solver=solver,
            rounds=4,
            witnesses=False,
            progress=progress,
            record=record,
        )
    )
    return np.inf if found.empty is not None else found.intervals[0].lower


def _jointly_affine(family: Polynomials, loose: Index) -> Index:
    """Return the rows that are affine in the loose variables together."""
    curved = family.rows[np.isin(family.factors, loose).sum(axis=1) > 1]
    return np.setdiff1d(np.arange(family.n_rows), curved)


def _homogenise(
    problem: PolynomialProblem, loose: Index, riding: Index, magnitude: Array
) -> tuple[PolynomialProblem, Array]:
    """Return the problem in (rho, z', s) and the scale of each loose variable."""
    n = problem.n_variables
    # A power of two: multiplying coefficients by it rounds nothing.
    scale = np.ones(n)
    guess = np.where(magnitude[loose] > 0, magnitude[loose], 1.0)
    scale[loose] = 2.0 ** np.ceil(np.log2(guess))
    lower, upper = problem.lower.copy(), problem.upper.copy()
    lower[riding], upper[riding] = np.minimum(lower[riding], 0.0), np.maximum(upper[riding], 0.0)
    lower[loose] = np.where(problem.lower[loose] >= 0, 0.0, -1.0)
    upper[loose] = np.where(problem.upper[loose] <= 0, 0.0, 1.0)
    moved = PolynomialProblem(
        (*problem.names, "s"),
        np.append(lower, 0.0),
        np.append(upper, 1.0),
        _rows(problem.equalities, loose, riding, scale, n),
        Polynomials.join([_rows(problem.inequalities, loose, riding, scale, n), _cone_of_box(problem, riding, n)]),
    )
    return moved, scale


def _riding(problem: PolynomialProblem, loose: Index) -> Index:
    """Return the bounded variables that may absorb s: linear, alone, and never beside a loose variable."""
    complicating = complicating_variables(problem)
    candidate = np.ones(problem.n_variables, dtype=bool)
    candidate[loose] = False
    if complicating is not None:
        candidate[complicating] = False
    for family in (problem.equalities, problem.inequalities):
        factors = family.factors
        real = factors >= 0
        beside = np.flatnonzero(np.any(np.isin(factors, loose), axis=1))
        candidate[factors[beside][real[beside]]] = False
        crowded = np.flatnonzero(np.sum(candidate[factors] & real, axis=1) > 1)
        candidate[factors[crowded][real[crowded]]] = False
    return np.flatnonzero(candidate)


def _rows(family: Polynomials, loose: Index, riding: Index, scale: Array, s: int) -> Polynomials:
    """Multiply the rows that hold a loose or riding variable by s, and substitute the new variables."""
    real = family.factors >= 0
    is_loose = np.any(np.isin(family.factors, loose) & real, axis=1)
    is_riding = np.any(np.isin(family.factors, riding) & real, axis=1)
    touched = np.zeros(family.n_rows, dtype=bool)
    touched[family.rows[is_loose | is_riding]] = True
    times_s = touched[family.rows] & ~is_loose & ~is_riding
    factors = pad(family.factors, family.factors.shape[1] + 1)
    factors = np.sort(np.where((np.arange(factors.shape[1]) == 0) & times_s[:, None], s, factors), axis=1)
    factor_scale = np.where(real & is_loose[:, None], scale[family.factors], 1.0).prod(axis=1)
    return Polynomials(family.n_rows, family.rows, factors, family.coefficients.scaled(factor_scale)).collect()


def _cone_of_box(problem: PolynomialProblem, riding: Index, s: int) -> Polynomials:
    """Return ``s upper - z' >= 0`` and ``z' - s lower >= 0`` for riding variables."""
    rows: list[dict[tuple[int, ...], float]] = []
    for sign, end in ((-1.0, problem.upper), (1.0, -problem.lower)):
        rows += [{(k,): sign, (s,): float(end[k])} for k in riding.tolist()]
    return Polynomials.from_terms(rows)
