"""One user's work: a folder, a process that runs the steps in it, and what is known so far."""

from __future__ import annotations

import asyncio
import multiprocessing
import os
import signal
from collections.abc import AsyncIterator, Mapping
from contextlib import suppress
from multiprocessing.connection import Connection
from multiprocessing.process import BaseProcess
from pathlib import Path, PurePath
from typing import Any

from relaxations.writing import write_bytes
from smid.app.steps import PRODUCED, STEPS, code_of
from smid.app.worker import work
from smid.data import DataError

__all__ = ["Session"]

_KILL = 9  # Windows has no name for it
_PATIENCE = 2.0  # seconds that a process may take to end by itself
_NO_RECORD = (".html", ".json", ".toml", ".py")


class Session:
    """The steps that were run, and the process that keeps what they found.

    A step that runs while another one is running waits for it.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self._codes: dict[str, str] = {}
        self._known: list[str] = []
        self._turn = asyncio.Lock()
        self._closed = False
        self._start()

    def _start(self) -> None:
        # Spawned, so that no thread of the server is copied; and at once, so that its libraries are loaded in time.
        context = multiprocessing.get_context("spawn")
        self._connection: Connection
        self._connection, theirs = context.Pipe()
        self._process: BaseProcess = context.Process(target=work, args=(theirs, str(self.folder)))
        self._process.start()
        theirs.close()
        self._is_ready = False

    async def ready(self) -> None:
        """Wait until the process has loaded its libraries.

        Raises
        ------
        EOFError
            If it has ended.
        """
        if not self._is_ready:
            await asyncio.to_thread(self._connection.recv)
            self._is_ready = True

    @property
    def script(self) -> str:
        """Return the Python of all steps that were run and whose results stand."""
        return "\n\n".join(f"# {step}\n{code}" for step, code in self._codes.items()) + "\n"

    def keep(self, name: str, content: bytes) -> str:
        """Write a file of the user into the folder; return its name.

        Raises
        ------
        DataError
            If the name is none of a record.
        """
        plain = PurePath(name.replace("\\", "/")).name
        if not plain or plain.startswith(".") or PurePath(plain).suffix.lower() in _NO_RECORD:
            raise DataError(f"{name!r} is not a record: give a text file of columns, .npz, .mat, .xlsx or .parquet")
        write_bytes(self.folder / plain, content)
        return plain

    async def run(self, step: str, fields: Mapping[str, str]) -> AsyncIterator[dict[str, Any]]:
        """Yield the code of a step, its lines of progress, and its result.

        Raises
        ------
        DataError, ModelError
            If a field does not make sense; nothing is run.
        """
        async with self._turn:
            code = code_of(step, fields, self._known)
            for later in STEPS[STEPS.index(step) :]:
                self._codes.pop(later, None)
            yield {"code": code}
            async for event in self._events(step, code):
                if "names" in event:
                    self._known = event["names"]
                    if set(PRODUCED[step]) & set(self._known):
                        self._codes[step] = code
                yield event

    async def _events(self, step: str, code: str) -> AsyncIterator[dict[str, Any]]:
        """Yield what the process says until it has the result; start another one where it is gone."""
        try:
            await self.ready()
            self._connection.send((step, code))
            while True:
                event = await asyncio.to_thread(self._connection.recv)
                yield event
                if "names" in event:
                    return
        except (EOFError, OSError):
            if self._closed:
                return
            self._end()
            self._start()
            self._codes.clear()
            gone = "the computation has ended, perhaps for lack of memory: read the record again, with fewer samples"
            yield {"error": gone, "answer": None, "names": [], "files": []}

    def stop(self) -> None:
        """End the running step early, if there is one (the process ignores it else); it returns what it has found."""
        if self._is_ready:
            self._signal(signal.SIGINT)

    def _signal(self, number: int) -> None:
        """Send a signal to the process and those that it started; where there are no groups, end the process."""
        if not hasattr(os, "killpg"):
            self._process.terminate()
            return
        with suppress(ProcessLookupError):
            os.killpg(self._process.pid or 0, number)

    def close(self) -> None:
        """End the process for good."""
        self._closed = True
        self._end()

    def _end(self) -> None:
        self.stop()
        self._connection.close()
        self._process.join(_PATIENCE)
        if self._process.is_alive():
            if self._is_ready:
                self._signal(_KILL)
            self._process.kill()
            self._process.join()
