"""Run cells on an executor, and run those again whose worker died.

When a process of a pool dies, all running cells are lost, and the cell that killed it is unknown. These suspects are
run again one at a time, after all others, in new workers. So a cell that kills its worker fails after
:data:`MOST_LOSSES` losses, the last of them alone, and no other cell fails with it.
"""

from __future__ import annotations

import os
from collections import deque
from collections.abc import Callable, Sequence
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, Executor, Future, wait
from contextlib import AbstractContextManager
from dataclasses import dataclass

from smid.study.cell import Job
from smid.study.errors import StudyError
from smid.study.outcome import Outcome, Status
from smid.study.run_cell import run_cell

MOST_LOSSES = 3
_TICK = 1.0  # seconds


@dataclass(frozen=True)
class Pool:
    """Where cells are run: a function that returns a fresh executor, and the number of cells to submit at a time."""

    open: Callable[[], AbstractContextManager[Executor]]
    width: int | None


def run_all(jobs: Sequence[Job], pool: Pool, take: Callable[[Job, Outcome], None], tick: Callable[[], None]) -> None:
    """Run every job once, in the given order if the executor keeps it.

    Calls ``take`` in this thread with each outcome, and ``tick`` about every second. StudyError if the workers do not
    start, or their versions differ.
    """
    waiting = deque(jobs)
    suspects: list[tuple[Job, Exception]] = []
    while waiting:
        suspects += _pass(waiting, pool, pool.width, take, tick)
    for _ in range(MOST_LOSSES - 1):
        waiting.extend(job for job, error in suspects if not _is_final(error))
        suspects = [(job, error) for job, error in suspects if _is_final(error)]
        while waiting:
            suspects += _pass(waiting, pool, 1, take, tick)
    for job, error in suspects:
        take(job, Outcome(Status.FAILED, f"its worker died each time it was run: {_text(error)}"))


def _is_final(error: Exception) -> bool:
    """Tell whether the executor itself has run the cell again: Dask tries several workers."""
    return type(error).__name__ == "KilledWorker"


def _pass(
    waiting: deque[Job], pool: Pool, width: int | None, take: Callable[[Job, Outcome], None], tick: Callable[[], None]
) -> list[tuple[Job, Exception]]:
    """Run jobs until none waits or the executor breaks; return those that were lost."""
    lost: list[tuple[Job, Exception]] = []
    running: dict[Future[Outcome], Job] = {}
    with pool.open() as executor:
        try:
            # The probe fails if the workers do not even start.
            probe = executor.submit(os.getpid)
            broken = False
            # Submit up to the width, then wait for the next outcome.
            while running or (waiting and not broken):
                while waiting and not broken and (width is None or len(running) < width):
                    try:
                        future = executor.submit(run_cell, waiting[0])
                    except BrokenExecutor:
                        broken = True
                    else:
                        running[future] = waiting.popleft()
                for future in wait(running, _TICK, FIRST_COMPLETED).done:
                    job = running.pop(future)
                    try:
                        outcome = future.result()
                    except StudyError:
                        raise
                    except Exception as error:
                        lost.append((job, error))
                        broken = broken or isinstance(error, BrokenExecutor)
                    else:
                        take(job, outcome)
                tick()
            if broken and probe.exception() is not None:
                raise BrokenExecutor
        except BrokenExecutor:
            raise StudyError(
                "the worker processes do not start, or the executor is broken: in a script, put the call under "
                "if __name__ == '__main__':; otherwise give a fresh executor and resume"
            ) from None
        finally:
            for future in running:
                future.cancel()
    return lost


def _text(error: Exception) -> str:
    return f"{type(error).__name__}: {error}" if str(error) else type(error).__name__
