"""Worker processes on this machine, which end with this process even if it is killed.

Each watches a pipe whose other end only this process holds.
"""

from __future__ import annotations

import os
import signal
import sys
from collections.abc import Iterator
from concurrent.futures import Executor, ProcessPoolExecutor
from contextlib import contextmanager, suppress
from multiprocessing import get_context
from multiprocessing.connection import Connection
from threading import Thread, active_count

__all__ = ["THREADS", "copies", "spawned"]

# Without a limit each worker uses all cores: a fit of 0.4 s then took 15 s.
THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "RAYON_NUM_THREADS")
_ENDING = {signal.SIGINT, signal.SIGTERM}


@contextmanager
def spawned(count: int) -> Iterator[ProcessPoolExecutor]:
    """Start new processes of one thread each, for as long as the context lasts.

    They work on every system and beside other threads; the user's script needs a ``__main__`` guard.
    """
    context = get_context("spawn")
    watched, held = context.Pipe(duplex=False)
    with watched, held, _one_thread_each():
        pool = ProcessPoolExecutor(count, context, _begin, (watched,))
        try:
            yield pool
        except BaseException:
            held.close()  # ends the workers; their results are not needed
            raise
        finally:
            pool.shutdown(wait=True, cancel_futures=True)


@contextmanager
def copies(count: int) -> Iterator[Executor | None]:
    """Copy this process, with all that it has imported, for as long as the context lasts.

    A copy starts in milliseconds and does not run the user's script again.  Only a process of one thread can be copied
    safely, and not on every system: elsewhere, and where one process is wanted, None is given.
    """
    if count < 2 or sys.platform != "linux" or active_count() > 1:
        yield None
        return
    context = get_context("fork")
    watched, held = context.Pipe(duplex=False)
    with watched, held:
        # What interrupts the making of a copy would be lost.
        before = signal.pthread_sigmask(signal.SIG_BLOCK, _ENDING)
        try:
            pool = ProcessPoolExecutor(count, context, _begin_copy, (watched, held))
            pool.submit(int)
        finally:
            signal.pthread_sigmask(signal.SIG_SETMASK, before)
        try:
            yield pool
        finally:
            held.close()  # ends the copies, also in the middle of what nobody waits for
            pool.shutdown(wait=True, cancel_futures=True)


@contextmanager
def _one_thread_each() -> Iterator[None]:
    """Set the number of threads that new processes inherit, unless the user has set it."""
    missing = [name for name in THREADS if name not in os.environ]
    os.environ.update(dict.fromkeys(missing, "1"))
    try:
        yield
    finally:
        for name in missing:
            os.environ.pop(name, None)


def _begin(watched: Connection) -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C reaches every process of a terminal; only the first reacts
    Thread(target=_end_with, args=(watched,), daemon=True).start()


def _begin_copy(watched: Connection, held: Connection) -> None:
    held.close()  # a copy inherits it, and only the first process may hold it
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    _begin(watched)
    signal.pthread_sigmask(signal.SIG_UNBLOCK, _ENDING)


def _end_with(watched: Connection) -> None:
    with suppress(EOFError, OSError):
        watched.recv_bytes()  # nothing is ever sent: this returns when the other end is closed
    os._exit(1)
