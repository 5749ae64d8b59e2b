"""Run one cell: everything except a dead worker is a result."""

from __future__ import annotations

import time
from dataclasses import replace

from relaxations.errors import ProblemError
from relaxations.search.enclosure import Reason
from smid.data import DataError
from smid.identification.estimate import Estimate
from smid.identification.identify import EmptyFeasibleSetError, identify
from smid.models import ModelError
from smid.study.cell import Job
from smid.study.errors import StudyError
from smid.study.memory import forget_peak, peak_memory
from smid.study.outcome import Outcome, Status
from smid.study.versions import computing_versions


def run_cell(job: Job) -> Outcome:
    """Identify the model on the samples of a cell; a cell that does not apply or fails is an outcome too.

    StudyError if this process has other versions than the one that saves the results. KeyboardInterrupt if the
    computation was interrupted, because an incomplete cell is not saved.
    """
    _check_versions(job)
    forget_peak()
    started = time.perf_counter()
    try:
        outcome = _outcome(
            identify(
                job.model,
                job.data,
                dict(job.cell.noise_bound),
                method=job.method,
                order=job.cell.order,
                **vars(job.settings),
            )
        )
    except EmptyFeasibleSetError as proof:
        outcome = Outcome(Status.EMPTY, str(proof))
    except (ModelError, DataError, ProblemError) as error:
        outcome = Outcome(Status.REFUSED, str(error))
    except MemoryError:
        outcome = Outcome(Status.FAILED, "out of memory: take fewer samples, a lower order or a sparser method")
    except Exception as error:
        outcome = Outcome(Status.FAILED, f"{type(error).__name__}: {error}")
    return replace(outcome, seconds=time.perf_counter() - started, peak_memory=peak_memory())


def _check_versions(job: Job) -> None:
    own = computing_versions()
    other = [f"{name} {own[name]}, not {job.versions[name]}" for name in own if own[name] != job.versions[name]]
    if other:
        raise StudyError(f"a worker has {'; '.join(other)}: install the same versions on every machine of the cluster")


def _outcome(estimate: Estimate) -> Outcome:
    if estimate.reason is Reason.INTERRUPTED:
        raise KeyboardInterrupt
    e = estimate.enclosure
    if e is None:
        return Outcome(Status.CERTIFIED, estimate.summary, estimate.intervals)
    message = f"{e.reason.value[0].upper()}{e.reason.value[1:]}."
    return Outcome(
        Status.CERTIFIED, message, estimate.intervals, e.method, e.complicating, e.solves, e.n_moments, e.largest_block
    )
