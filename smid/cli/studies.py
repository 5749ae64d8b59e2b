"""The outputs of a command that runs a study."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any, Protocol

from smid.cli.outputs import Outputs
from smid.reports.documents import study_document


class Study(Protocol):
    """A result with plain data."""

    def to_dict(self) -> dict[str, Any]:
        """Return plain data."""
        ...


def publish(
    outputs: Outputs,
    command: str,
    study: Study,
    page: Callable[[str, dict[str, str]], Path],
    settings: dict[str, str] | None = None,
) -> None:
    """Print the study of a command such as "clutch records", and write the files that the user asked for."""
    outputs.say(study)
    outputs.write(study_document(command.replace(" ", "-"), study.to_dict()))
    outputs.write_report(lambda path: page(path, {**(settings or {}), "command": f"smid {command}"}))
