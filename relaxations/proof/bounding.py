"""One relaxation on one box: certified bounds of any objective, and proofs that the set is empty."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from relaxations.algebra.arrays import Array
from relaxations.algebra.polynomial import Polynomials, pad
from relaxations.deadline import TimeIsUp, check_time
from relaxations.moments.conic import ConicProgram, Multipliers, conic_program, multipliers
from relaxations.moments.moment import Relaxation
from relaxations.moments.parametric_lift import METHODS as LIFTS
from relaxations.moments.parametric_lift import degrees_in
from relaxations.problem.problem import PolynomialProblem
from relaxations.proof.certificate import Certificate, certify
from relaxations.proof.method import Method, Order, relaxation_method
from relaxations.proof.thinned import thinned
from relaxations.reductions.scaling import Scaling
from relaxations.solvers import ConicSolution, Solver, Stop, attempts, solve

DIVERGING = 1e6  # duals of scaled problems beyond this hint at an empty set
CLOSE = 1e-6
NOTHING = Polynomials.from_terms([{}])


@dataclass(frozen=True)
class Emptiness:
    """A proof that no point satisfies all constraints.

    ``margin`` is the certified bound of the zero objective, which is positive (with the multipliers' scale).
    ``weights``, shape (n_equalities,), are the shares of the problem's equalities in the proof; their sum is one.
    """

    margin: float
    weights: Array


@dataclass(frozen=True)
class Relaxed:
    """A relaxation on one box, ready for any objective; made by :func:`relax`. ``scaled`` is the problem in [-1, 1]."""

    problem: PolynomialProblem
    scaling: Scaling
    scaled: PolynomialProblem
    relaxation: Relaxation
    program: ConicProgram
    solver: Solver

    def bound(self, objective: Polynomials, close: float = CLOSE, loss: float = 0.0) -> CertifiedBound:
        """Return the certified lower bound of an objective, one row in the problem's own variables.

        No other solver or setting is tried where the bound loses less than ``close`` times the scaled coefficients. A
        long certificate may lose ``loss`` in the objective's unit, so that it holds fewer numbers.
        """
        scaled = self.scaling.polynomials(objective)
        cost = np.zeros(self.relaxation.n_moments)
        np.add.at(cost, self.relaxation.moments_of(scaled.factors), scaled.coefficients.mid)
        # On a small box the objective hardly moves, and the solver's tolerances would be coarse beside that.
        largest_cost = float(np.max(np.abs(cost[1:]), initial=0.0))
        unit = 2.0 ** np.floor(np.log2(largest_cost)) if 0 < largest_cost < 1 else 1.0
        size = float(np.abs(cost[1:]).sum()) or 1.0
        best, tried = CertifiedBound(-np.inf, None, ""), list[str]()
        for attempt in attempts(self.solver):
            try:
                solution = solve(self.program, cost / unit, attempt)
            except TimeIsUp:
                if not tried:
                    raise
                break  # what the attempts before prove is not lost
            best = max(self._certified(scaled, solution, unit), best, key=lambda certified: certified.bound)
            tried.append(f"{attempt}: {solution.status}" if tried else solution.status)
            with np.errstate(invalid="ignore"):  # a solver that fails may return infinite moments
                value = cost @ solution.moments
            if best.bound >= value - close * size:
                break
        return replace(self._thinned(scaled, best, loss), status="; ".join(tried))

    def _certified(self, objective: Polynomials, solution: ConicSolution, unit: float) -> CertifiedBound:
        """Return the bound that a solution of the objective over ``unit`` proves, in the scaled variables."""
        if not np.isfinite(solution.dual).all():
            return CertifiedBound(-np.inf, None, solution.status)
        largest = float(np.max(np.abs(solution.dual), initial=0.0))
        if largest > 0 and (solution.stop is Stop.INFEASIBLE or largest > DIVERGING):
            # A ray of the dual proves emptiness at any length: at unit length it neither drowns nor overflows.
            ray = multipliers(self.relaxation, self.program, solution.dual / largest)
            proof = certify(self.relaxation, NOTHING, ray)
            if proof.bound > 0:
                return CertifiedBound(np.inf, proof, solution.status)
        dual = multipliers(self.relaxation, self.program, solution.dual * unit)
        proof = certify(self.relaxation, objective, dual)
        point = self.scaling.recover(self.relaxation.first_order(solution.moments))
        return CertifiedBound(proof.bound, proof, solution.status, point, solution.moments)

    def _thinned(self, objective: Polynomials, found: CertifiedBound, loss: float) -> CertifiedBound:
        """Return the bound of a thinner certificate; the proof that a set is empty need only stay above zero."""
        if found.certificate is None:
            return found
        empty = found.bound == np.inf
        subject, loss = (NOTHING, 0.5 * found.certificate.bound) if empty else (objective, loss)
        thin = thinned(self.relaxation, subject, found.certificate, loss)
        return replace(found, certificate=thin, bound=np.inf if empty else thin.bound)

    def variances(self, certified: CertifiedBound) -> Array:
        """Return ``L(t^2) - L(t)^2`` of each scaled variable, shape (n_variables,): NaN where it has no such moment.

        All are zero where the moments are those of one point.
        """
        squares = np.full(self.relaxation.n_variables, np.nan)
        if certified.moments is None:
            return squares
        monomials = pad(self.relaxation.monomials, 2)
        own = (self.relaxation.degrees == 2) & (monomials[:, -1] == monomials[:, -2])
        squares[monomials[own, -1]] = certified.moments[own]
        return np.asarray(squares - self.relaxation.first_order(certified.moments) ** 2, dtype=np.float64)

    def emptiness(self, proof: Certificate) -> Emptiness:
        """Return the proof of an empty set with the weight that each equality carries in it."""
        return Emptiness(proof.bound, equality_weights(self.problem, self.relaxation, proof.multipliers))


@dataclass(frozen=True)
class CertifiedBound:
    """One certified bound: infinite where the set is certified empty, minus infinity where nothing is proven.

    Parameters
    ----------
    certificate
        Of the objective; of the constant zero where the set is empty. None where nothing is proven.
    status
        The solver's words, attempt by attempt.
    point
        Shape (n_variables,). The moments of first order, in the problem's own variables: a guess of a minimiser.
    moments
        Shape (n_moments,). The solver's, of the scaled variables; the constant first.
    """

    bound: float
    certificate: Certificate | None
    status: str
    point: Array | None = None
    moments: Array | None = None


def relax(
    problem: PolynomialProblem,
    method: str | Method,
    order: Order,
    solver: Solver = "clarabel",
    objective: Polynomials | None = None,
    steps: int = 1,
) -> Relaxed:
    """Scale a problem with a finite box and build its relaxation.

    Parameters
    ----------
    problem
        With a finite box.
    method
        An object of :mod:`relaxations.proof.method`, or its short name.
    order
        One for each of :func:`relaxations.moments.lasserre_hierarchy.groups` where the cliques differ.
    objective
        What is to be bounded, one row for each objective: a relaxation that knows may be smaller, by symmetry or terms,
        and serves no other then. Products of variables that share no constraint must be known.
    steps
        Of the extension of supports, for ``"terms"`` and ``"chordal"``.

    Raises
    ------
    ProblemError
        Where the box is infinite, the order too low, the lift does not apply, or the machine's memory is too small.
    TimeIsUp
        Where the time limit ends before the relaxation is built.

    Examples
    --------
    >>> from relaxations.formats.expressions import problem_of, variables
    >>> x, y = variables("x y")
    >>> problem, _ = problem_of(x, [x * y == 1, x >= 0, x <= 2, y >= 0, y <= 4])
    >>> relaxed = relax(problem, "lift", 2)
    >>> [round(relaxed.bound(problem.variable(*end)).bound, 4) for end in ((0, 1), (0, -1), (1, 1))]  # x, -x and y
    [0.25, -2.0, 0.5]
    """
    check_time()
    scaling = Scaling.of_box(problem)
    scaled = scaling.apply(problem)
    known = None if objective is None else scaling.polynomials(objective)
    relaxation = relaxation_method(method).build(scaled, order, known, steps)
    check_time()
    return Relaxed(problem, scaling, scaled, relaxation, conic_program(relaxation), solver)


def equality_weights(problem: PolynomialProblem, relaxation: Relaxation, dual: Multipliers) -> Array:
    """Return the share of each of the problem's equalities in a dual solution, shape (n_equalities,), with sum one.

    The lift lists the multiples of an equality one after the other. Where all equalities have as many, as those of
    :mod:`smid` do, the shares follow from the multipliers; otherwise all equalities share alike.
    """
    count = problem.equalities.n_rows
    alike = np.full(count, 1.0 / max(count, 1))
    degrees = np.unique(degrees_in(problem.equalities, relaxation.complicating))
    if relaxation.method not in LIFTS or len(degrees) != 1:
        return alike
    weights = np.abs(dual.equalities).reshape(count, -1).sum(axis=1)
    total = weights.sum()
    return np.asarray(weights / total if total > 0 else alike, dtype=np.float64)
