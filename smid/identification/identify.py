"""Certified parameter intervals of a model and its central model: the second phase of identification."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from concurrent.futures import Executor
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np

from relaxations.algebra.arrays import Array
from relaxations.deadline import STOPS, limited
from relaxations.proof.bounding import Emptiness
from relaxations.proof.method import Cuts, Method, method_names
from relaxations.search.enclosure import Interval, Reason
from relaxations.search.plan import Plan
from relaxations.solvers import Solver, check_solver
from smid.data import Dataset
from smid.data.given import Given, as_dataset
from smid.data.window import Window
from smid.display.from_plain import Plain, read
from smid.display.progress import Shows, spoken, with_bar
from smid.display.result import Part, Result
from smid.display.table import Table
from smid.feasible.feasible_set import check_data, check_noise_bound
from smid.fitting.binding import bind
from smid.identification.certificates import write_certificates
from smid.identification.choice import encloser_for
from smid.identification.encloser import Enclosed, Encloser, Settings
from smid.identification.error_bound import ErrorBound, error_bound
from smid.identification.estimate import CentreStatus, Estimate, ParameterInterval
from smid.identification.inversion.inverted import NAME as INVERSION
from smid.identification.inversion.inverted import Inverted
from smid.identification.outliers import WithOutliers
from smid.models import Model, ModelError

__all__ = ["METHODS", "EmptyFeasibleSetError", "identify"]

METHODS = (*method_names(), INVERSION)
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
    >>> from smid import Dataset, OutputError
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

    def __reduce__(self) -> tuple[type[EmptyFeasibleSetError], tuple[Any, ...]]:
        # An error pickles its message alone, and this one comes back from worker processes.
        return EmptyFeasibleSetError, (str(self), self.least_bound, self.samples)

    def _content(self) -> Iterator[Part]:
        yield str(self)
        rows = tuple((run, str(k), f"{weight:.0%}") for run, k, weight in self.samples)
        yield Table("What carries the proof.", ("experiment", "sample", "share"), rows, "lrr")

    def to_dict(self) -> dict[str, Any]:
        """Return plain data: the message, the certified least bound, and the most influential samples."""
        samples = [{"experiment": run, "index": k, "weight": weight} for run, k, weight in self.samples]
        return {"message": str(self), "least_bound": self.least_bound, "samples": samples}

    @staticmethod
    def from_dict(content: Mapping[str, Any]) -> EmptyFeasibleSetError:
        """Return the error that `to_dict` described."""
        carried = read(content, "samples", tuple[Plain, ...])
        samples = ((read(s, "experiment", str), read(s, "index", int), read(s, "weight", float)) for s in carried)
        least = read(content, "least_bound", float | None)
        return EmptyFeasibleSetError(read(content, "message", str), least, tuple(samples))


@with_bar
@limited
def identify(
    model: Model,
    data: Given,
    noise_bound: float | Mapping[str, float],
    *,
    method: str | Method | Cuts = "auto",
    order: int | None = None,
    solver: Solver = "clarabel",
    tolerance: float = 1e-4,
    rounds: int = 10,
    nodes: int = 0,
    seconds: float = np.inf,  # noqa: ARG001  (read by the decorator)
    executor: Executor | None = None,
    progress: Shows = None,
    certificate: str | Path | None = None,
    windows: bool = True,
    outliers: int = 0,
) -> Estimate:
    """Compute the parameter uncertainty intervals of a model.

    Parameters
    ----------
    data
        All its experiments are used together. A pandas frame or arrays ``(u, y, sampling_time)`` are taken too, see
        :func:`smid.data.as_dataset`.
    noise_bound
        In the channel's unit. At the least bound of :func:`smid.error_bound` the intervals shrink to a point whatever
        the truth is: take a larger one.
    method
        A short name of :func:`relaxations.proof.method_names`, or a method object, ``Lift(order=2)`` say.
        ``"auto"`` takes the parametric lift where it applies, the sparse hierarchy elsewhere; and for the
        complicating parameters of long records (all, with errors in variables) cuts, :mod:`relaxations.search.benders`.
        A model that is no polynomial is treated by ``"inversion"`` of its free run, which any model can be
        (:mod:`smid.identification.inversion`); it needs a box of every parameter.
    order
        Highest relaxation order (lower ones contract the box first); by default 2 for at most two complicating
        variables, 1 beyond.
    solver
        ``"clarabel"``, the name of any conic solver that cvxpy has, or a :class:`relaxations.solvers.BackEnd`.
    tolerance
        Stop once each gap is below this share of its interval's width.
    rounds
        At most so many contractions.
    nodes
        Where they leave a gap, branch with at most so many relaxations for each end (the lift only). A model with Max,
        Min, Abs or sign is always branched (:mod:`smid.identification.piecewise`). Inversion contracts at most so many
        boxes; 0: 20,000.
    seconds
        Time allowed, wall clock. Then the ends proven so far are returned, and ``reason`` says so. The time to write a
        certificate is not counted.
    executor
        Solves bounds side by side (:func:`relaxations.search.hierarchy.intervals`); cuts and piecewise models run here.
    progress
        Called with a line of text now and then; True shows a bar, in a terminal or a notebook.
    certificate
        File for the whole proof of the ends, or of an empty set: derived boxes, contractions and branches, as far as
        anything beyond the priors was proven. It is checked on the way, as ``python -m relaxations.check FILE`` does
        again; at a thousand samples that takes half a minute. With outliers, or outputs that share nothing, it holds
        the certificates of all parts. After an inversion the ends are those that the checker's arithmetic gives, which
        differ from those without a file by little. What was proven without a free run
        (:mod:`smid.identification.inversion.narrowing`) is proven again for the file, and a part of it may be lost.
    windows
        Prove the intervals of a long record on the windows that hold their ends (:mod:`smid.identification.windows`),
        where method and order are not asked for. They hold for the whole record; false proves them on all samples.
    outliers
        The intervals hold if at most so many samples of each output break the noise bound, wherever they are
        (:mod:`smid.identification.outliers`). Gross ones cost little; those that are allowed and not there cost width.

    Raises
    ------
    ModelError, DataError, ProblemError
        Bad input, before any solve.
    EmptyFeasibleSetError
        Where the feasible set is certified empty.

    Examples
    --------
    >>> from smid import Dataset, OutputError
    >>> u, y = [1.0, 0, 1, 1, 0, 0, 1, 0], [0.0, 1, 0.5, 1.3, 1.6, 0.8, 0.4, 1.2]
    >>> data = Dataset.from_arrays(input={"u": u}, output={"y": y}, sampling_time=1.0)
    >>> estimate = identify(OutputError(na=1, stable=True), data, noise_bound=0.1)
    >>> estimate["a1"].lower < -0.5 < estimate["a1"].upper
    True
    """
    # Refuse a wrong call before any work.
    check_solver(solver)
    settings = Settings(method, order, solver, tolerance, rounds, nodes, executor, spoken(progress))
    data = as_dataset(data, model)
    model, kept = bind(model, data), certificate is not None
    check_data(model, data)
    bounds = check_noise_bound(model, noise_bound, None)
    encloser: Encloser
    if outliers:
        encloser = WithOutliers(model, data, bounds, settings, kept, outliers, windows)
    else:
        encloser = encloser_for(model, data, bounds, settings, kept, windows)
    if certificate:
        _make_way(certificate)
    # Bound the parameters, and write the proof of all that was bounded.
    found = encloser.enclose()
    if certificate:
        certified = encloser.certified(found)
        found = certified.found
        if certified.certificates:
            write_certificates(certificate, certified.certificates, model, data, bounds, found.windows, outliers)
    enclosure = found.enclosure
    if isinstance(encloser, WithOutliers | Inverted) and found.reason is Reason.EMPTY:
        raise EmptyFeasibleSetError(encloser.contradiction, None, encloser.heaviest)
    if enclosure is not None and enclosure.empty is not None:
        raise _proven_empty(found, enclosure.empty, data, settings)
    # Examine the centre; the intervals are proven and must not be lost where this is stopped.
    status, nearest = CentreStatus.UNDECIDED, None
    if enclosure is not None and not (found.boxed and found.boxed.unbounded):
        with suppress(*STOPS):
            status, nearest = encloser.centre(enclosure)
    return _estimate(model, data, bounds, found, status, nearest, outliers)


def _estimate(
    model: Model,
    data: Dataset,
    bounds: Mapping[str, float],
    found: Enclosed,
    status: CentreStatus,
    nearest: Array | None,
    outliers: int,
) -> Estimate:
    """Return the result with its central model; without proven bounds it holds the box alone."""
    derived = () if found.boxed is None else found.boxed.derived
    unbounded = () if found.boxed is None else found.boxed.unbounded
    enclosure = None if unbounded else found.enclosure
    if enclosure is not None:
        proven = enclosure.intervals
    else:
        boxes = [(p.lower, p.upper) for p in model.parameters]
        if found.boxed is not None:
            problem = found.boxed.feasible.problem
            boxes = list(zip(problem.lower.tolist(), problem.upper.tolist(), strict=True))[: len(boxes)]
        proven = tuple(
            Interval(p.name, low, high, np.nan, np.nan, (True, True), ("", ""))
            for p, (low, high) in zip(model.parameters, boxes, strict=True)
        )
    intervals = tuple(ParameterInterval.of(i, p) for i, p in zip(proven, model.parameters, strict=True))
    names = [p.name for p in model.parameters]
    values = None if nearest is None else dict(zip(names, nearest.tolist(), strict=True))
    if enclosure is not None:
        model = model.with_values({i.name: i.centre for i in intervals} if values is None else values)
    return Estimate(
        model,
        data,
        bounds,
        intervals,
        status,
        values,
        derived,
        # A hidden signal has a variable for each sample, called signal[sample].
        tuple(dict.fromkeys(name.split("[")[0] for name in unbounded)),
        found.reason,
        enclosure,
        found.windows,
        outliers,
    )


def _make_way(certificate: str | Path) -> None:
    """Remove an old file: it would prove something else."""
    if not Path(certificate).resolve().parent.is_dir():
        raise ModelError(f"certificate={str(certificate)!r} lies in no folder that exists: make the folder first")
    Path(certificate).unlink(missing_ok=True)


def _proven_empty(found: Enclosed, empty: Emptiness, data: Dataset, settings: Settings) -> EmptyFeasibleSetError:
    """Return the error that names the samples of the proof, and the least noise bound where it can be computed."""
    assert found.boxed is not None
    feasible = found.boxed.feasible
    # Name the samples with the largest weight in the proof; those of windows are counted from the start of their run.
    heaviest = np.argsort(empty.weights)[::-1][:5]
    places = found.windows or [Window(e, 0, run.n_samples - 1) for e, run in enumerate(data.experiments)]
    samples = tuple(
        (data.experiments[places[e].experiment].name, places[e].first + int(k), float(w))
        for (e, k), w in zip(feasible.samples[heaviest], empty.weights[heaviest], strict=True)
        if w > 0
    )
    carried = ", ".join(f"{k} ({w:.0%})" for _, k, w in samples)
    # State what is proven, and of which bound.
    noisy = [m.channel for m in feasible.model.measurements if m.noise is not None]
    channel = next(c for c in feasible.model.output_channels if c in noisy)
    fixed = {c: b for c, b in feasible.bounds.items() if c != channel}
    given = feasible.bounds[channel]
    unit = feasible.data.channel(channel).unit
    proven = f"proven: no parameters explain the data within {given:g} {unit} on {channel}. ".replace("  ", " ")
    samples_text = f"Most influential samples: {carried}" if carried else ""
    parameters = range(len(feasible.model.parameters))
    plan = Plan.of(feasible.problem, settings.method, settings.order, targets=parameters)
    # With kinks or noisy curves the least bound is not available, or would take long.
    if feasible.templates.hinges or plan.projection is not None:
        return EmptyFeasibleSetError(
            f"{proven}Raise the bound or extend the model. {samples_text}".rstrip(), None, samples
        )
    # Enclose the least noise bound, so that the user knows how far to raise the given one.
    least: ErrorBound | None = None
    with suppress(ModelError):  # no point could be verified for any bound; what is proven stays so
        least = error_bound(
            feasible.model,
            feasible.data,
            fixed,
            method=settings.method,
            order=settings.order,
            solver=settings.solver,
            progress=settings.progress,
        )
    if least is None or not np.isfinite(least.upper):
        where = "Raise the bound (smid.error_bound encloses the least one) or extend the model."
    elif found.windows:
        where = f"The least bound is at least {least.lower:.6g}: raise the bound above it or extend the model."
    else:
        where = f"The least bound lies in {least.enclosure}: raise the bound above it or extend the model."
    return EmptyFeasibleSetError(f"{proven}{where} {samples_text}", None if least is None else least.lower, samples)
