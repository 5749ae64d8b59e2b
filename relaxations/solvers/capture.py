"""Capture what a library writes directly to the standard output or error of the process."""

from __future__ import annotations

import os
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from threading import Lock
from typing import IO


@dataclass
class _Stream:
    """A file descriptor of the process. The first thread that enters redirects it, and the last one restores it."""

    descriptor: int
    lock: Lock = field(default_factory=Lock)
    inside: int = 0
    drop: bool = False
    kept: int | None = None  # a copy of the descriptor, while it is redirected
    sink: IO[bytes] | None = None

    def enter(self) -> None:
        with self.lock:
            if not self.inside:
                with suppress(OSError):  # no redirection without the stream or a temporary file
                    self._divert()
            self.inside += 1

    def leave(self, drop: bool) -> None:
        with self.lock:
            self.inside -= 1
            self.drop |= drop
            if not self.inside:
                self._restore()

    def _divert(self) -> None:
        flush(self.descriptor)
        self.sink = tempfile.TemporaryFile()  # noqa: SIM115  (closed when the descriptor is restored)
        self.kept = os.dup(self.descriptor)
        os.dup2(self.sink.fileno(), self.descriptor)

    def _restore(self) -> None:
        if self.sink is not None and self.kept is not None:
            flush(self.descriptor)
            os.dup2(self.kept, self.descriptor)
            os.close(self.kept)
            # Other threads may have written too: without a failure the text is passed on.
            if not self.drop:
                self.sink.seek(0)
                while written := self.sink.read(1 << 16):
                    os.write(self.descriptor, written)
            self.sink.close()
        self.kept, self.sink, self.drop = None, None, False


_streams = {number: _Stream(number) for number in (1, 2)}


def flush(descriptor: int) -> None:
    """Flush Python's buffer of standard output (1) or standard error (2)."""
    stream = sys.stdout if descriptor == 1 else sys.stderr
    if stream is not None:
        with suppress(OSError, ValueError):
            stream.flush()


@contextmanager
def captured(descriptor: int) -> Iterator[list[str]]:
    """Capture what is written to a file descriptor, 1 or 2, inside a ``with`` block.

    The block gets a list of reasons to drop the text. If the list is empty at the end, the text is written then.
    """
    reasons: list[str] = []
    _streams[descriptor].enter()
    try:
        yield reasons
    finally:
        _streams[descriptor].leave(bool(reasons))
