"""Identify over orders, methods, noise bounds, sample sizes and records, and compare width and cost."""

from __future__ import annotations

import os
import time
from collections.abc import Collection, Iterable, Mapping, Sequence
from concurrent.futures import Executor
from contextlib import nullcontext
from itertools import product
from pathlib import Path

from relaxations.deadline import Progress
from relaxations.proof.method import Cuts, Method, method_of
from relaxations.solvers.interface import check_solver
from smid.data import DataError, Dataset
from smid.data.given import Given, as_dataset
from smid.display.progress import Shows, Step, spoken, with_bar
from smid.feasible.feasible_set import check_data, check_noise_bound
from smid.fitting.binding import bind
from smid.models import Model, ModelError
from smid.processes import spawned
from smid.study.cell import Cell, Job, Settings, method_fields
from smid.study.outcome import Outcome, Status
from smid.study.run_all import Pool, run_all
from smid.study.store import Store, open_store
from smid.study.study import Study
from smid.study.time_left import time_left
from smid.study.versions import computing_versions

NoiseBound = float | Mapping[str, float]


@with_bar
def order_study(
    model: Model,
    data: Given | Mapping[str, Given],
    noise_bound: NoiseBound | Iterable[NoiseBound],
    *,
    orders: Iterable[int] = (1, 2, 3),
    methods: Iterable[str | Method | Cuts] = ("auto",),
    sample_sizes: Iterable[int] | None = None,
    solver: str = "clarabel",
    tolerance: float = 1e-4,
    rounds: int = 10,
    nodes: int = 0,
    workers: int = 1,
    executor: Executor | None = None,
    folder: str | os.PathLike[str] | None = None,
    resume: bool = False,
    progress: Shows = None,
) -> Study:
    """Identify every combination of record, sample size, noise bound, method and relaxation order.

    A cell that does not apply, such as an order below the least one, is a result with a message. Ctrl-C stops the study
    and returns the cells that are done.

    Parameters
    ----------
    data
        A record, or several by name; each as for :func:`smid.identify`.
    noise_bound
        In the channel's unit, as in :func:`smid.identify`.
    orders
        Highest relaxation orders.
    methods
        Short names or method objects, as in :func:`smid.identify`, each with a name of its own. ``orders`` replaces the
        order of an object. Fields of the object are compared when a study is resumed, its code is not.
    sample_sizes
        Numbers of first samples of each experiment; by default all.
    solver, tolerance, rounds, nodes
        See :func:`smid.identify`.
    workers
        Number of processes on this machine, of one thread each. Measure times with one. In a script, put the call under
        ``if __name__ == "__main__":``.
    executor
        In place of workers: ``distributed.Client(address).get_executor()`` for a Dask cluster, for example.
    folder
        Folder for an SQLite file that saves each outcome.
    resume
        Continue the study in ``folder``. Data, model, settings, method objects and versions must be the same; the
        combinations may differ. Failed cells are run again.
    progress
        Called with a line of text now and then; True shows a bar, in a terminal or a notebook.

    Raises
    ------
    ModelError, DataError, ProblemError
        For bad input, before any solve.
    StudyError
        If the folder holds another study, the disk is full (the outcomes so far are saved), or the workers do not
        start.

    Examples
    --------
    >>> from smid.models import OutputError
    >>> u, y = [1.0, 0, 1, 1, 0, 0, 1, 0], [0.0, 1, 0.5, 1.3, 1.6, 0.8, 0.4, 1.2]
    >>> data = Dataset.from_arrays(input={"u": u}, output={"y": y}, sampling_time=1.0)
    >>> study = order_study(OutputError(na=1, stable=True), data, [0.1, 0.2], orders=[1], workers=1)
    >>> narrow, wide = (outcome.intervals[0].width for outcome in study.outcomes)
    >>> narrow < wide
    True
    """
    check_solver(solver)
    if workers < 1:
        raise ModelError(f"{workers} workers cannot run a study: give at least 1")
    if resume and folder is None:
        raise ModelError("resume needs the folder of the study: give folder=...")
    # Check the whole grid before any work.
    settings = Settings(solver, float(tolerance), int(rounds), int(nodes))
    if isinstance(data, Mapping):
        records = {name: as_dataset(record, model) for name, record in data.items()}
    else:
        record = as_dataset(data, model)
        records = {_name(record): record}
    bound = {name: bind(model, record) for name, record in records.items()}
    named = _named(methods)
    cells = _grid(bound, records, noise_bound, orders, named, sample_sizes)
    jobs = [Job.of(cell, named[cell.method], bound[cell.record], records[cell.record], settings) for cell in cells]
    for job in jobs:
        check_data(job.model, job.data)
    objects = {name: method_fields(method) for name, method in named.items() if not isinstance(method, str)}
    # A study in a folder is resumed only with equal data, model, settings and versions.
    subject = {
        "data": {name: record.checksum for name, record in records.items()},
        "model": model.to_dict(),
        "settings": {**vars(settings), "methods": objects},
        "versions": computing_versions(),
    }
    needed = min(workers, len(jobs))
    local = Pool(lambda: spawned(needed), 2 * needed)
    pool = local if executor is None else Pool(lambda: nullcontext(executor), None)
    with open_store(None if folder is None else Path(folder), subject, resume) as store:
        found, interrupted = _run(jobs, pool, store, spoken(progress))
    outcomes = tuple(found.get(cell) for cell in cells)
    return Study(next(iter(bound.values())), records, settings, cells, outcomes, interrupted)


def _run(jobs: Sequence[Job], pool: Pool, store: Store, progress: Progress | None) -> tuple[dict[Cell, Outcome], bool]:
    """Run the jobs that have no saved outcome; return all outcomes, and whether Ctrl-C came."""
    done = _known(jobs, store.outcomes())
    fresh: dict[Cell, Outcome] = {}
    begun = time.monotonic()
    left = [job for job in jobs if job.cell not in done]

    def take(job: Job, outcome: Outcome) -> None:
        store.add(job, outcome)
        fresh[job.cell] = outcome

    def tick() -> None:
        if progress is not None:
            missing = [job.cell for job in left if job.cell not in fresh]
            remaining = time_left(missing, fresh, time.monotonic() - begun)
            progress(Step("runs", len(done) + len(fresh), len(jobs), remaining))

    interrupted = False
    try:
        tick()
        run_all(left, pool, take, tick)
    except KeyboardInterrupt:
        interrupted = True
    return {**done, **fresh}, interrupted


def _named(methods: Iterable[str | Method | Cuts]) -> dict[str, str | Method | Cuts]:
    """Return the methods by name; ProblemError or ModelError for one that is none, or shares its name with another."""
    named: dict[str, str | Method | Cuts] = {}
    for method in methods:
        method_of(method)
        name = method if isinstance(method, str) else method.name
        if named.setdefault(name, method) != method:
            raise ModelError(f"two methods have the name {name!r}: results could not tell them apart; rename one")
    return named


def _grid(
    models: Mapping[str, Model],
    records: Mapping[str, Dataset],
    noise_bound: NoiseBound | Iterable[NoiseBound],
    orders: Iterable[int],
    methods: Collection[str],
    sample_sizes: Iterable[int] | None,
) -> tuple[Cell, ...]:
    """Return all combinations, records first, orders last; ModelError or DataError for one that is impossible."""
    # One value stands for a list of one.
    if isinstance(noise_bound, Mapping) or not isinstance(noise_bound, Iterable):
        bounds: list[NoiseBound] = [noise_bound]
    else:
        bounds = list(noise_bound)
    orders = list(orders)
    sizes = None if sample_sizes is None else list(sample_sizes)
    # Refuse values that no cell can have.
    for name, given in (("records", records), ("noise_bound", bounds), ("orders", orders), ("methods", methods)):
        if not given:
            raise ModelError(f"{name} is empty: a study needs at least one")
    for name, numbers in (("order", orders), ("sample size", sizes or [])):
        for number in numbers:
            if number < 1 or number != int(number):
                raise ModelError(f"{name} {number} is not a positive integer: give 1, 2, ...")
    # Combine the values of each record.
    cells: list[Cell] = []
    for name, record in records.items():
        longest = max(run.n_samples for run in record.experiments)
        for size in sizes or []:
            if size > longest:
                raise DataError(f"record {name!r} has {longest} samples, fewer than {size}: give smaller sizes")
        named = [tuple(check_noise_bound(models[name], bound, None).items()) for bound in bounds]
        cells += [
            Cell(name, int(size), bound, method, int(order))
            for size, bound, method, order in product(sizes or [longest], named, methods, orders)
        ]
    return tuple(dict.fromkeys(cells))


def _known(jobs: Sequence[Job], kept: Mapping[str, Outcome]) -> dict[Cell, Outcome]:
    """Return the saved outcomes of these jobs, without failures, which are run again."""
    found = {job.cell: kept[job.key] for job in jobs if job.key in kept}
    return {cell: outcome for cell, outcome in found.items() if outcome.status is not Status.FAILED}


def _name(data: Dataset) -> str:
    return data.experiments[0].name if len(data.experiments) == 1 else "all"
