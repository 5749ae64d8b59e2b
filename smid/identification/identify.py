"""Phase 2: certified parameter uncertainty intervals and the central model."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import Executor
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from relaxations.algebra.ball_arithmetic import Array, Index
from relaxations.algebra.polynomial import Polynomials
from relaxations.deadline import STOPS, limited, stopped_by
from relaxations.moments.lasserre import METHODS as LASSERRE
from relaxations.moments.lift import METHODS as LIFTS
from relaxations.points.witness import find_witness
from relaxations.problem.problem import PolynomialProblem
from relaxations.proof.bounding import Emptiness, relax, resolve
from relaxations.proof.certificate_file import write_certificate
from relaxations.proof.proof_steps import Step
from relaxations.search.hierarchy import CUTS, Enclosure, Interval, Reason, intervals, takes_cuts
from relaxations.solvers.interface import check_solver
from smid.data import Dataset
from smid.display.result import Part, Result, plain
from smid.display.table import Table
from smid.feasible.feasible_set import FeasibleSet
from smid.identification.error_bound import error_bound
from smid.identification.estimate import CentreStatus, Estimate, ParameterInterval
from smid.identification.finite_box import Boxed, vanishing_factors, with_finite_box
from smid.identification.first_guess import equation_error_fit, magnitudes
from smid.identification.piecewise import piecewise_centre, piecewise_intervals
from smid.identification.piecewise_proof import Trail, stated
from smid.models import Model, ModelError
from smid.verification.origin import origin_of

Progress = Callable[[str], None]

METHODS = ("auto", CUTS, *LIFTS, *LASSERRE)
"""How bounds may be asked for."""


class EmptyFeasibleSetError(ValueError, Result):
    """A proven negative: no parameters and noises within the bound explain the data.

    Attributes
    ----------
    least_bound
        Certified lower end of the least noise bound, where it was computed.
    samples
        The samples that carry most of the proof.

    Examples
    --------
    >>> from smid.models import OutputError
    >>> u, y = [1.0, 0, 1, 1, 0, 0, 1, 0], [0.0, 1, 0.5, 1.3, 1.6, 0.8, 0.4, 1.2]
    >>> data = Dataset.from_arrays(input={"u": u}, output={"y": y}, sampling_time=1.0)
    >>> try:
    ...     identify(OutputError(stable=True), data, noise_bound=0.001)
    ... except EmptyFeasibleSetError as proof:
    ...     print(f"at least {proof.least_bound:.4f}, sample {proof.samples[0][1]} weighs most")
    at least 0.0339, sample 3 weighs most
    """

    def __init__(self, message: str, least_bound: float | None, samples: tuple[tuple[str, int, float], ...]) -> None:
        super().__init__(message)
        self.least_bound = least_bound
        self.samples = samples

    def _content(self) -> Iterator[Part]:
        yield str(self)
        rows = tuple((run, str(k), f"{weight:.0%}") for run, k, weight in self.samples)
        yield Table("What carries the proof.", ("experiment", "sample", "share"), rows, "lrr")

    def to_dict(self) -> dict[str, Any]:
        """Return plain data: the message, the certified least bound, and the samples that carry the proof."""
        return {"message": str(self), "least_bound": self.least_bound, "samples": plain(self.samples)}


@limited
def identify(
    model: Model,
    data: Dataset,
    noise_bound: float | Mapping[str, float],
    *,
    method: str = "auto",
    order: int | None = None,
    solver: str = "clarabel",
    tolerance: float = 1e-4,
    rounds: int = 10,
    nodes: int = 0,
    seconds: float = np.inf,  # noqa: ARG001  (read by the decorator)
    executor: Executor | None = None,
    progress: Progress | None = None,
    certificate: str | Path | None = None,
) -> Estimate:
    """Compute the parameter uncertainty intervals of a model.

    Parameters
    ----------
    data
        All its experiments are used together.
    noise_bound
        In the channel's unit. At the least bound of :func:`smid.error_bound` the intervals shrink to a point whatever
        the truth is: take a larger one.
    method
        One of {"auto", "benders", "lift", "rlt", "sparse", "dense", "terms", "chordal", "textbook"}.
        ``"auto"`` takes the parametric lift where it applies, the sparse hierarchy elsewhere; and for the
        complicating parameters of long records (all, with errors in variables) cuts, :mod:`relaxations.search.benders`.
    order
        Highest relaxation order (lower ones contract the box first); by default 2 for at most two complicating
        variables, 1 beyond.
    solver
        ``"clarabel"`` or the name of any conic solver that cvxpy has.
    tolerance
        Stop once each gap is below this share of its interval's width.
    rounds
        At most so many contractions.
    nodes
        Where they leave a gap, branch with at most so many relaxations for each end (the lift only). A model with Max,
        Min, Abs or sign is always branched (:func:`smid.identification.piecewise.piecewise_intervals`).
    seconds
        Time allowed, wall clock. Then the ends proven so far are returned, and ``reason`` says so. The time to write a
        certificate is not counted.
    executor
        Solves bounds side by side (:func:`relaxations.search.hierarchy.intervals`); cuts and piecewise models run here.
    progress
        Called with a line of text now and then.
    certificate
        File for the whole proof of the ends, or of an empty set: derived boxes, contractions and branches, as far as
        anything beyond the priors was proven. It is checked on the way, as ``python -m relaxations.check FILE`` does
        again; at a thousand samples that takes half a minute.

    Raises
    ------
    ModelError, DataError, ProblemError
        Bad input, before any solve.
    EmptyFeasibleSetError
        Where the feasible set is certified empty.

    Examples
    --------
    >>> from smid.models import OutputError
    >>> u, y = [1.0, 0, 1, 1, 0, 0, 1, 0], [0.0, 1, 0.5, 1.3, 1.6, 0.8, 0.4, 1.2]
    >>> data = Dataset.from_arrays(input={"u": u}, output={"y": y}, sampling_time=1.0)
    >>> estimate = identify(OutputError(na=1, stable=True), data, noise_bound=0.1)
    >>> estimate["a1"].lower < -0.5 < estimate["a1"].upper
    True
    """
    check_solver(solver)
    feasible = FeasibleSet(model, data, noise_bound)
    model = feasible.model
    parameters = range(len(model.parameters))
    cuts = takes_cuts(feasible.problem, method, order)
    resolve(feasible.problem, "auto" if cuts else method, order)
    if feasible.openings:
        return _piecewise(feasible, method, order, solver, tolerance, rounds, nodes, progress, certificate)
    if certificate:
        _make_way(certificate)
    boxed = Boxed(feasible, (), feasible.problem.unbounded, feasible.problem)
    steps: list[Step] = []
    record = steps.append if certificate else None
    known: list[Array] = []
    try:
        boxed = with_finite_box(feasible, solver, progress, record)
        if boxed.unbounded:
            return _box_only(boxed, Reason.UNBOUNDED)
        known = [] if cuts else _first_witness(boxed.feasible)
    except STOPS as stop:
        return _box_only(boxed, Reason[stopped_by(stop)])
    problem = boxed.feasible.problem
    enclosure = intervals(
        problem,
        parameters,
        method=method,
        order=order,
        solver=solver,
        tolerance=tolerance,
        rounds=rounds,
        nodes=nodes,
        known=known,
        start=_start(boxed.feasible) if cuts else None,
        executor=executor,
        progress=progress,
        record=record,
    )
    if certificate and steps:
        write_certificate(certificate, boxed.stated, steps, origin=origin_of(model, data, feasible.bounds))
    if enclosure.empty is not None:
        raise _proven_empty(feasible, enclosure.empty, method, order, solver, progress)
    status, nearest = CentreStatus.UNDECIDED, None
    with suppress(*STOPS):  # the intervals are proven and must not be lost with the centre
        status, nearest = _centre(problem, enclosure, len(model.parameters), solver)
    return _estimate(feasible, enclosure, boxed.derived, status, nearest)


def _estimate(
    feasible: FeasibleSet, enclosure: Enclosure, derived: tuple[str, ...], status: CentreStatus, nearest: Array | None
) -> Estimate:
    model = feasible.model
    found = tuple(ParameterInterval.of(i, p) for i, p in zip(enclosure.intervals, model.parameters, strict=True))
    names = [p.name for p in model.parameters]
    values = None if nearest is None else dict(zip(names, nearest.tolist(), strict=True))
    central = values if values is not None else {i.name: i.centre for i in found}
    return Estimate(
        model.with_values(central),
        feasible.data,
        feasible.bounds,
        found,
        status,
        values,
        derived,
        (),
        enclosure.reason,
        enclosure,
    )


def _piecewise(
    feasible: FeasibleSet,
    method: str,
    order: int | None,
    solver: str,
    tolerance: float,
    rounds: int,
    nodes: int,
    progress: Progress | None,
    certificate: str | Path | None,
) -> Estimate:
    """Identify a model whose Max, Min, Abs or sign are not decided by the priors and the data alone."""
    if method not in ("auto", "lift"):
        raise ModelError(f"a model with Max, Min, Abs or sign is bounded by the lift: method={method!r} does not apply")
    if certificate:
        products = vanishing_factors(feasible.model, feasible.problem.unbounded)
        if products:
            raise ModelError(
                f"the proof of a box for {', '.join(products)} beside Max, Min, Abs or sign cannot be written: give "
                "bounds, or leave certificate out"
            )
        _make_way(certificate)
    trail = Trail(kept=certificate is not None)
    enclosure = piecewise_intervals(
        feasible,
        order=order,
        solver=solver,
        tolerance=tolerance,
        rounds=rounds,
        nodes=nodes,
        progress=progress,
        trail=trail,
    )
    if certificate and (trail.steps or trail.parts):
        problem, kinks = stated(feasible)
        proof = trail.whole(problem, len(feasible.model.parameters))
        origin = origin_of(feasible.model, feasible.data, feasible.bounds)
        write_certificate(certificate, problem, proof, kinks, origin)
    if enclosure.empty is not None:
        raise _proven_empty(feasible, enclosure.empty, method, order, solver, progress)
    loose = [p.name for p in feasible.model.parameters if not np.isfinite(p.upper - p.lower)]
    left = tuple(i.name for i in enclosure.intervals if not np.isfinite(i.width))
    if left:
        return _box_only(Boxed(feasible, (), left, feasible.problem), enclosure.reason)
    status, nearest = CentreStatus.UNDECIDED, None
    with suppress(*STOPS):  # the intervals are proven and must not be lost with the centre
        status, nearest = piecewise_centre(feasible, enclosure, solver)
    return _estimate(feasible, enclosure, tuple(loose), status, nearest)


def _make_way(certificate: str | Path) -> None:
    """Remove an old file: it would prove something else."""
    if not Path(certificate).resolve().parent.is_dir():
        raise ModelError(f"certificate={str(certificate)!r} lies in no folder that exists: make the folder first")
    Path(certificate).unlink(missing_ok=True)


def _box_only(boxed: Boxed, reason: Reason) -> Estimate:
    """Return the box, all that is known where the computation ended before its bounds."""
    feasible = boxed.feasible
    found = tuple(
        ParameterInterval.of(Interval(p.name, float(low), float(high), np.nan, np.nan, (True, True), ("", "")), p)
        for p, low, high in zip(feasible.model.parameters, feasible.problem.lower, feasible.problem.upper, strict=False)
    )
    # A hidden signal has a variable for each sample, called signal[sample].
    unbounded = tuple(dict.fromkeys(name.split("[")[0] for name in boxed.unbounded))
    return Estimate(
        feasible.model,
        feasible.data,
        feasible.bounds,
        found,
        CentreStatus.UNDECIDED,
        None,
        boxed.derived,
        unbounded,
        reason,
        None,
    )


def _start(feasible: FeasibleSet) -> Array:
    """Return the equation-error fit as a guess of a feasible point."""
    parameters, _ = equation_error_fit(feasible)
    start = np.zeros(feasible.n_variables)
    start[: len(parameters)] = parameters
    return start


def _first_witness(feasible: FeasibleSet) -> list[Array]:
    """Return a verified feasible point found from the equation-error fit, if any."""
    problem = feasible.problem
    parameters, rms = equation_error_fit(feasible)
    *_, complicating = resolve(problem, "auto", None)
    nothing = Polynomials.from_terms([{}])
    found = find_witness(
        problem, problem, nothing, complicating, _start(feasible), magnitudes(feasible, parameters, max(rms, 1e-9))
    )
    return [] if found is None else [found.point]


def _proven_empty(
    feasible: FeasibleSet, empty: Emptiness, method: str, order: int | None, solver: str, progress: Progress | None
) -> EmptyFeasibleSetError:
    heaviest = np.argsort(empty.weights)[::-1][:5]
    samples = tuple(
        (feasible.data.experiments[e].name, int(k), float(w))
        for (e, k), w in zip(feasible.samples[heaviest], empty.weights[heaviest], strict=True)
        if w > 0
    )
    carried = ", ".join(f"{k} ({w:.0%})" for _, k, w in samples)
    noisy = [m.channel for m in feasible.model.measurements if m.noise is not None]
    channel = next(c for c in feasible.model.output_channels if c in noisy)
    fixed = {c: b for c, b in feasible.bounds.items() if c != channel}
    given = feasible.bounds[channel]
    unit = feasible.data.channel(channel).unit
    proven = f"proven: no parameters explain the data within {given:g} {unit} on {channel}. ".replace("  ", " ")
    samples_text = f"Samples that carry the proof: {carried}"
    if feasible.structure.hinges:
        return EmptyFeasibleSetError(f"{proven}Raise the bound or extend the model. {samples_text}", None, samples)
    least = error_bound(
        feasible.model, feasible.data, fixed, method=method, order=order, solver=solver, progress=progress
    )
    where = f"The least bound lies in {least.enclosure}: raise the bound above it or extend the model."
    if not np.isfinite(least.upper):
        where = "Raise the bound (smid.error_bound encloses the least one) or extend the model."
    return EmptyFeasibleSetError(f"{proven}{where} {samples_text}", least.lower, samples)


def _centre(
    problem: PolynomialProblem, enclosure: Enclosure, count: int, solver: str
) -> tuple[CentreStatus, Array | None]:
    """Decide whether the centres are feasible; where not, look for the nearest feasible point."""
    centre = np.array([i.centre for i in enclosure.intervals])
    lower, upper = problem.lower.copy(), problem.upper.copy()
    lower[:count] = upper[:count] = centre
    fixed = problem.with_box(lower, upper)
    start = np.zeros(problem.n_variables)
    start[:count] = centre
    nothing = Polynomials.from_terms([{}])
    *_, complicating = resolve(problem, "auto", None)
    if find_witness(fixed, fixed, nothing, np.setdiff1d(complicating, np.arange(count)), start) is not None:
        return CentreStatus.FEASIBLE, None
    status = CentreStatus.UNDECIDED
    method, order, _ = resolve(fixed, enclosure.method if enclosure.method in LIFTS else "auto", None)
    if method in LIFTS and relax(fixed, method, order, solver).bound(nothing).bound == np.inf:
        status = CentreStatus.INFEASIBLE
    nearest = _nearest(problem, enclosure, centre, complicating)
    return status, nearest


def _nearest(problem: PolynomialProblem, enclosure: Enclosure, centre: Array, complicating: Index) -> Array | None:
    """Return the parameters of a verified point whose largest distance to the centre, in widths, is small."""
    if not enclosure.witnesses:
        return None
    count, last = len(centre), problem.n_variables
    width = np.array([max(i.width, 1e-300) for i in enclosure.intervals])
    # distance - |theta_k - centre_k| / width_k >= 0, the distance being one more variable
    closeness = Polynomials.from_terms(
        [
            {(last,): 1.0, (k,): sign / width[k], (): -sign * centre[k] / width[k]}
            for k in range(count)
            for sign in (1.0, -1.0)
        ]
    )
    lower, upper = problem.lower.copy(), problem.upper.copy()
    lower[:count] = [i.lower for i in enclosure.intervals]
    upper[:count] = [i.upper for i in enclosure.intervals]
    extended = replace(
        problem,
        names=(*problem.names, "distance"),
        lower=np.append(lower, 0.0),
        upper=np.append(upper, 1.0),
    ).with_inequalities(closeness)
    begin = min(enclosure.witnesses, key=lambda w: float(np.abs((w[:count] - centre) / width).max()))
    found = find_witness(extended, extended, extended.variable(last), complicating, np.append(begin, 1.0))
    return np.asarray(begin[:count] if found is None else found.point[:count])
