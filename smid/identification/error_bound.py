"""An enclosure of the least noise bound under which the model explains the data: the first phase of identification.

The least bound is the optimum of a polynomial problem: minimise D subject to the model's equations and
``|noise| <= D``. A verified point gives its upper end. With ``D`` no larger than that, the relaxations contract towards
the optimum and certify the lower end. At the least bound the feasible set shrinks to a point *whatever the truth is*:
identify with a larger one.
"""

from __future__ import annotations

import time
from collections.abc import Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from relaxations.algebra.arrays import Array
from relaxations.deadline import STOPS, limited, stopped_by
from relaxations.points.witness import Witness, find_witness
from relaxations.problem.problem import PolynomialProblem
from relaxations.proof.method import Cuts, Method
from relaxations.search.enclosure import Reason
from relaxations.search.hierarchy import intervals
from relaxations.search.plan import Plan
from relaxations.solvers import Solver, check_solver
from smid.data import DataError, Dataset
from smid.data.given import Given, as_dataset
from smid.data.window import cut_all, windows_before
from smid.display.from_plain import fields_from_plain
from smid.display.progress import Shows, spoken, with_bar
from smid.display.result import Part, Result
from smid.display.table import Table
from smid.feasible.feasible_set import FREE_BOUND, FeasibleSet
from smid.feasible.template import Templates, is_polynomial
from smid.fitting.binding import bind
from smid.identification.estimate import open_end, round_down, round_up
from smid.identification.finite_box import with_finite_box
from smid.identification.first_guess import equation_error_fit, magnitudes
from smid.identification.missing import with_missing
from smid.identification.windows.scan import Scan
from smid.identification.windows.whole_record import WholeRecord
from smid.identification.windows.windowed import LONG, has_windows
from smid.models import Model, ModelError

ROUGH = 2
"""Rounds for the parameters before missing samples get a box: their set is next to a point, and slow to contract."""


@dataclass(frozen=True, eq=False, repr=False)
class ErrorBound(Result):
    """An enclosure of the least noise bound of a channel.

    Parameters
    ----------
    lower
        Certified: with any smaller bound the feasible set is empty.
    upper
        Verified: with this bound it is not. Infinite where the computation was stopped before a point was verified.
    parameters
        Parameters of the verified point: a minimax fit. Empty without one.
    fixed
        Bounds of the other noisy channels.
    """

    channel: str
    unit: str
    lower: float
    upper: float
    parameters: Mapping[str, float]
    fixed: Mapping[str, float]
    reason: Reason
    seconds: float

    @staticmethod
    def from_dict(content: Mapping[str, Any]) -> ErrorBound:
        """Return the enclosure that `to_dict` described."""
        found: ErrorBound = fields_from_plain(ErrorBound, content, upper=open_end(content, "upper", np.inf))
        return found

    @property
    def gap(self) -> float:
        """Return the width of the enclosure."""
        return self.upper - self.lower

    @property
    def enclosure(self) -> str:
        """Return the enclosure as text, its ends rounded outwards."""
        digits = 6 if self.upper == 0 or self.gap > 1e-5 * self.upper else 8
        return f"[{round_down(self.lower, digits)}, {round_up(self.upper, digits)}]"

    def __str__(self) -> str:
        if not np.isfinite(self.upper):
            return f"least noise bound of {self.channel}: not known; {self.reason.value}"
        return f"least noise bound of {self.channel}: in {self.enclosure} {self.unit}".rstrip() + (
            " (lower end certified, upper end witnessed)" if self.lower > 0 else " (witnessed; no lower end is proven)"
        )

    def _content(self) -> Iterator[Part]:
        said = str(self)
        yield f"{said[0].upper()}{said[1:]}; {self.reason.value}."
        if not self.parameters:
            return
        rows = tuple((name, f"{value:.6g}") for name, value in self.parameters.items())
        yield Table("Parameters that explain the data with the upper end.", ("parameter", "value"), rows, "lr")


@with_bar
@limited
def error_bound(
    model: Model,
    data: Given,
    fixed: Mapping[str, float] | None = None,
    *,
    method: str | Method | Cuts = "auto",
    order: int | None = None,
    solver: Solver = "clarabel",
    tolerance: float = 1e-3,
    rounds: int = 12,
    nodes: int = 200,
    seconds: float = np.inf,  # noqa: ARG001  (read by the decorator)
    progress: Shows = None,
) -> ErrorBound:
    """Enclose the least noise bound of the output (phase 1 of the clutch thesis, 3.2.3).

    Parameters
    ----------
    data
        As for :func:`smid.identify`.
    fixed
        Bounds of the other noisy channels (errors in variables); exactly one noisy channel must remain.
    method, solver
        See :func:`smid.identify`.
    order
        Highest relaxation order; by default the least, for here branching closes a gap sooner than order does.
    tolerance
        Stop once the enclosure is narrower than this share of its upper end.
    rounds
        At most so many contractions.
    nodes
        Where they leave a gap, branch with at most so many relaxations.
    seconds
        Time allowed, wall clock. Then the enclosure proven so far is returned, and ``reason`` says so.
    progress
        Called with a line of text now and then; True shows a bar, in a terminal or a notebook.

    Raises
    ------
    ModelError, DataError
        Where model, data and fixed bounds do not fit together, or no feasible point could be verified.

    Examples
    --------
    >>> from smid import Dataset, OutputError
    >>> u, y = [1.0, 0, 1, 1, 0, 0, 1, 0], [0.0, 1, 0.5, 1.3, 1.6, 0.8, 0.4, 1.2]
    >>> data = Dataset.from_arrays(input={"u": u}, output={"y": y}, sampling_time=1.0)
    >>> bound = error_bound(OutputError(na=1, stable=True), data)
    >>> 0 < bound.lower <= bound.upper < 0.05
    True
    """
    started = time.perf_counter()
    check_solver(solver)
    data = as_dataset(data, model)
    model = bind(model, data)
    noisy = [m.channel for m in model.measurements if m.noise is not None]
    open_channels = [c for c in noisy if c not in (fixed or {})]
    if len(open_channels) != 1:
        raise ModelError(
            f"noise bounds to find: {', '.join(open_channels) or 'none'}; give the known ones in fixed={{channel: "
            "bound} so that exactly one remains"
        )
    channel = open_channels[0]
    if not is_polynomial(model):
        raise ModelError(
            "the least noise bound is enclosed for polynomials only, and a line of the model is none: give the noise "
            "bound as a number"
        )
    settings = {"solver": solver, "rounds": rounds, "nodes": nodes, "progress": spoken(progress)}
    if not fixed and method == "auto" and order is None and has_windows(model, data):
        # Else all samples: where no run stays finite or is verified, or an input stands still in the windows.
        with suppress(DataError):
            return _by_windows(model, data, channel, settings, tolerance)
    found = _on_all_samples(model, data, channel, settings, tolerance, fixed or {}, method, order)
    return replace(found, seconds=time.perf_counter() - started)


def _on_all_samples(
    model: Model,
    data: Dataset,
    channel: str,
    settings: Mapping[str, Any],
    tolerance: float,
    fixed: Mapping[str, float],
    method: str | Method | Cuts,
    order: int | None,
) -> ErrorBound:
    """Enclose the least noise bound of a channel with no windows: those of a slow pole are as long as the record."""
    started, solver = time.perf_counter(), settings["solver"]
    feasible = FeasibleSet(model, data, fixed, channel)
    # Cuts bound variables that complicate; the noise bound does not complicate.
    by_cuts = method == Cuts.name or isinstance(method, Cuts)

    def plan_of(problem: PolynomialProblem) -> Plan:
        plan = Plan.of(problem, "auto" if by_cuts else method, order)
        return replace(plan.without_cuts, order=plan.asked or plan.least)

    plan = plan_of(feasible.problem)
    found: list[Array] = []  # verified points, the best last; the noise bound is the last variable
    reach = np.inf

    def result(lower: float, reason: Reason) -> ErrorBound:
        best = found[-1] if found else None
        return ErrorBound(
            channel,
            data.channel(channel).unit,
            lower,
            np.inf if best is None else float(np.nextafter(best[-1], np.inf)),
            {} if best is None else {p.name: float(best[k]) for k, p in enumerate(model.parameters)},
            dict(fixed),
            reason,
            time.perf_counter() - started,
        )

    # Verified points give the upper end, and cap the noise bound; then prove a finite box.
    try:
        for witness in _minimax(feasible, plan):
            if witness.value < reach:
                reach = witness.value
                found.append(witness.point)
        if not found:
            raise ModelError(
                "no feasible point could be verified for any noise bound: check the priors and parameter bounds"
            )
        capped = feasible.with_problem(_capped(feasible.problem, reach))
        boxed = with_finite_box(capped, solver, settings["progress"])
        if len(capped.missing) and not boxed.unbounded:
            present = boxed.feasible.problem
            targets, rough = range(len(model.parameters)), plan_of(present)
            first = intervals(present, targets, method=rough, solver=solver, rounds=ROUGH, witnesses=False)
            boxed = with_missing(capped, boxed, first, solver)
    except STOPS as stop:
        return result(0.0, Reason[stopped_by(stop)])
    if boxed.unbounded:
        return result(0.0, Reason.STALLED)
    # Raise the certified lower end.
    problem = boxed.feasible.problem
    kept = np.isin(feasible.problem.names, problem.names)
    enclosure = intervals(
        problem,
        [problem.n_variables - 1],
        method=plan_of(problem) if len(capped.missing) else plan,
        tolerance=0.0,
        absolute=tolerance * reach,
        known=[found[-1][kept]],
        **settings,
    )
    found.append(min(enclosure.witnesses, key=lambda point: float(point[-1])))
    return result(max(enclosure.intervals[0].lower, 0.0), enclosure.reason)


def _by_windows(
    model: Model,
    data: Dataset,
    channel: str,
    settings: Mapping[str, Any],
    tolerance: float,
) -> ErrorBound:
    """Certify the lower end on the windows that hold a minimax fit, which is verified on the whole record."""
    started, unit = time.perf_counter(), data.channel(channel).unit
    try:
        scale = float(np.nanstd(np.concatenate([run.values[channel] for run in data.experiments])))
        scan = Scan(model, data, {channel: scale})
        values = scan.values(scan.inside)
        whole = WholeRecord(Templates.of(model), data)
        upper = whole.least_bounds(values, whole.noises(scan.problem.simulate(scan.inside)))[channel]
    except STOPS as stop:
        reason = Reason[stopped_by(stop)]
        return ErrorBound(channel, unit, 0.0, np.inf, {}, {}, reason, time.perf_counter() - started)
    if not np.isfinite(upper):
        raise DataError("no run is verified: take all samples")
    # Longer windows until the ends meet.
    length = scan.memory(0.1 * tolerance * scan.least)
    while True:
        windows = windows_before(scan.places(scan.least_rows), length)
        part = _on_all_samples(model, cut_all(data, windows), channel, settings, tolerance / 2, {}, "auto", None)
        tight = upper - part.lower <= tolerance * upper
        length *= 2
        if tight or part.reason not in (Reason.TIGHT, Reason.STALLED, Reason.ROUNDS) or length > LONG:
            reason = Reason.TIGHT if tight else Reason.WINDOWS if part.reason is Reason.TIGHT else part.reason
            return ErrorBound(channel, unit, part.lower, upper, values, {}, reason, time.perf_counter() - started)


def _minimax(feasible: FeasibleSet, plan: Plan) -> Iterator[Witness]:
    """Yield verified points of small noise bound."""
    problem = feasible.problem
    last = problem.n_variables - 1
    assert problem.names[last] == FREE_BOUND
    parameters, rms = equation_error_fit(feasible)
    magnitude = magnitudes(feasible, parameters, max(rms, 1e-9))
    start = np.zeros(problem.n_variables)
    for shrink in (1.0, 0.9, 0.5, 0.0):  # towards zero: an equation-error fit errs, at worst towards instability
        start[: len(parameters)] = shrink * parameters
        found = find_witness(problem, problem, problem.variable(last), plan.complicating, start, magnitude)
        if found is not None:
            yield found


def _capped(problem: PolynomialProblem, reach: float) -> PolynomialProblem:
    """Return the problem with the noise bound, and the noises it bounds, at most ``reach``."""
    last = problem.n_variables - 1
    lower, upper = problem.lower.copy(), problem.upper.copy()
    upper[last] = reach
    inequalities = problem.inequalities
    bounding = np.unique(inequalities.rows[(inequalities.factors == last).any(axis=1)])
    noises = np.setdiff1d(inequalities.take(bounding).occurring(), [last])
    lower[noises], upper[noises] = np.maximum(lower[noises], -reach), np.minimum(upper[noises], reach)
    return problem.with_box(lower, upper)
