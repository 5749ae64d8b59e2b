"""Worker processes of a diagnosis: copies of this process, with all that it has imported.

A copy starts in milliseconds and does not run the user's script again. Only a process with one thread can be copied
safely, and not on every system: elsewhere the diagnosis stays in its process, unless it is given an executor.
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

__all__ = ["copies"]

_ENDING = {signal.SIGINT, signal.SIGTERM}


@contextmanager
def copies(count: int) -> Iterator[Executor | None]:
    """Copy this process, for as long as the context lasts; give None where one process is wanted or can be had."""
    if count < 2 or sys.platform != "linux" or active_count() > 1:
        yield None
        return
    watched, held = get_context("fork").Pipe(duplex=False)
    with watched, held:
        # What interrupts the making of a copy would be lost.
        before = signal.pthread_sigmask(signal.SIG_BLOCK, _ENDING)
        try:
            pool = ProcessPoolExecutor(count, get_context("fork"), _begin, (watched, held))
            pool.submit(int)
        finally:
            signal.pthread_sigmask(signal.SIG_SETMASK, before)
        try:
            yield pool
        finally:
            held.close()  # ends the copies, also in the middle of what nobody waits for
            pool.shutdown(wait=True, cancel_futures=True)


def _begin(watched: Connection, held: Connection) -> None:
    held.close()  # only the first process holds it: the copies end with it, even if it is killed
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C reaches every process of a terminal; only the first reacts
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    signal.pthread_sigmask(signal.SIG_UNBLOCK, _ENDING)
    Thread(target=_end_with, args=(watched,), daemon=True).start()


def _end_with(watched: Connection) -> None:
    with suppress(EOFError, OSError):
        watched.recv_bytes()  # nothing is ever sent: this returns when the other end is closed
    os._exit(1)
