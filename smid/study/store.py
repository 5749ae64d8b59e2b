"""The outcomes of a study on disk: one SQLite file in the study's folder.

Each outcome is a transaction of its own in a write-ahead log, synced to the disk before the next cell counts as done.
So a kill loses only the running cells. Only one process may write: a second one is refused, because it would run cells
twice.

The file also holds data, model, settings and versions. They must agree before anything is added. The combinations may
differ, because a cell is found by its key.
"""

from __future__ import annotations

import json
import sqlite3
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from smid.study.cell import Job
from smid.study.errors import StudyError
from smid.study.outcome import Outcome

FILE = "study.sqlite"
FORMAT = 1
_TABLES = """
CREATE TABLE study (subject TEXT NOT NULL);
CREATE TABLE cells (key TEXT PRIMARY KEY, cell TEXT NOT NULL, outcome TEXT NOT NULL) WITHOUT ROWID;
"""
_DISK = ("SQLITE_FULL", "SQLITE_IOERR")

Subject = Mapping[str, Mapping[str, Any]]
"""What a study is of: "data", "model", "settings" and "versions", each as plain data by name."""


@dataclass(frozen=True)
class Store:
    """The open file of a study; ``place`` is its folder, for messages."""

    connection: sqlite3.Connection
    place: str

    def outcomes(self) -> dict[str, Outcome]:
        """Return the saved outcomes by key."""
        rows = self.connection.execute("SELECT key, outcome FROM cells")
        return {key: Outcome.from_dict(json.loads(text)) for key, text in rows}

    def add(self, job: Job, outcome: Outcome) -> None:
        """Save an outcome; it replaces an earlier one of the same cell. StudyError if the disk cannot be written."""
        row = (job.key, json.dumps(job.cell.to_dict()), json.dumps(outcome.to_dict(), allow_nan=False))
        try:
            with self.connection:
                self.connection.execute("INSERT OR REPLACE INTO cells VALUES (?, ?, ?)", row)
        except sqlite3.OperationalError as error:
            raise self._trouble(error) from None

    def begin(self, subject: Subject) -> None:
        """Write the subject of the study and the tables, in one transaction."""
        script = f"BEGIN; {_TABLES} PRAGMA user_version = {FORMAT};"
        try:
            self.connection.executescript(script)
            self.connection.execute("INSERT INTO study VALUES (?)", (json.dumps(subject),))
            self.connection.commit()
        except sqlite3.OperationalError as error:
            raise self._trouble(error) from None

    def check(self, subject: Subject) -> None:
        """Raise a StudyError with each difference if the file is about another subject."""
        (text,) = self.connection.execute("SELECT subject FROM study").fetchone()
        kept, given = json.loads(text), json.loads(json.dumps(subject))
        for part in ("data", "model", "settings", "versions"):
            different = _differences(_flat(kept[part]), _flat(given[part]))
            if different:
                raise StudyError(
                    f"{self.place} holds a study of other {part}: {'; '.join(different)}. Resume with the "
                    "same inputs, or begin a new study in another folder"
                )

    def _trouble(self, error: sqlite3.OperationalError) -> StudyError:
        if not error.sqlite_errorname.startswith(_DISK):
            return StudyError(f"{self.place}: {error}; check the file {FILE} there")
        cause = "the disk is full" if error.sqlite_errorname == "SQLITE_FULL" else f"cannot write ({error})"
        return StudyError(
            f"{self.place}: {cause}; the runs done so far are kept. Free some space there, then resume the study"
        )


@contextmanager
def open_store(folder: Path | None, subject: Subject, resume: bool) -> Iterator[Store]:
    """Open the file of a study, or create one.

    ``resume`` says whether the folder must hold the study already, or must not. StudyError if it does not fit: another
    study, another format, or another process that runs the study; also if nothing can be written there.
    """
    place = "memory" if folder is None else str(folder)
    if folder is not None:
        _check_folder(folder, resume)
    connection = _connect(folder, place)
    try:
        store = Store(connection, place)
        (kept_format,) = connection.execute("PRAGMA user_version").fetchone()
        (tables,) = connection.execute("SELECT count(*) FROM sqlite_master").fetchone()
        if kept_format == 0 and tables == 0:  # a new file, or one of a study that was killed before it began
            store.begin(subject)
        elif kept_format != FORMAT:
            raise StudyError(
                f"{place} holds a study in format {kept_format}, this version of smid reads format {FORMAT}: resume it "
                "with the version it was begun with, or begin a new study in another folder"
            )
        else:
            if not resume:
                raise StudyError(f"{place} holds a study already: resume it, or begin in another folder")
            store.check(subject)
        yield store
    finally:
        connection.close()


def _check_folder(folder: Path, resume: bool) -> None:
    if resume and not (folder / FILE).is_file():
        raise StudyError(f"{folder} holds no study to resume (no file {FILE}): check the path, or begin one there")
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise StudyError(f"cannot make the folder {folder}: {error.strerror}; choose another path") from None


def _connect(folder: Path | None, place: str) -> sqlite3.Connection:
    try:
        connection = sqlite3.connect(":memory:" if folder is None else folder / FILE, timeout=1.0)
        try:
            # Exclusive locking needs no shared memory, which network file systems do not have.
            connection.execute("PRAGMA locking_mode = EXCLUSIVE")
            connection.execute("PRAGMA journal_mode = WAL")
            connection.execute("PRAGMA synchronous = FULL")
            connection.execute("BEGIN IMMEDIATE")  # takes the lock now, before the first outcome
            connection.rollback()
        except sqlite3.Error:
            connection.close()
            raise
    except sqlite3.DatabaseError as error:
        cause = {
            "SQLITE_BUSY": "another process runs this study; wait for it, or choose another folder",
            "SQLITE_NOTADB": f"the file {FILE} there is not a database; choose another folder",
        }.get(error.sqlite_errorname, f"{error}; check the path, its permissions and the free space")
        raise StudyError(f"{place}: {cause}") from None
    return connection


def _flat(content: Mapping[str, Any], prefix: str = "") -> dict[str, Any]:
    """Return nested entries under joined names, so that a message can name a difference."""
    flat: dict[str, Any] = {}
    for name, value in content.items():
        if isinstance(value, list) and all(isinstance(item, dict) and "name" in item for item in value):
            value = {item["name"]: item for item in value}
        flat |= _flat(value, f"{prefix}{name} ") if isinstance(value, dict) else {prefix + name: value}
    return flat


def _differences(kept: Mapping[str, Any], given: Mapping[str, Any]) -> list[str]:
    """Return the entries that differ, each with both values."""
    names = [name for name in {**kept, **given} if kept.get(name) != given.get(name)]
    return [f"{name} was {_short(kept.get(name))}, now {_short(given.get(name))}" for name in names]


def _short(value: Any) -> str:
    if value is None:
        return "none"
    text = value if isinstance(value, str) else json.dumps(value)
    return text if len(text) <= 40 else f"{text[:37]}..."
