"""The one pattern of the studies' commands."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import click

from smid.cli.console import Progress
from smid.cli.outputs import Outputs, writes
from smid.cli.studies import publish
from smid.theses.chapter import Chapter, write_chapter

__all__ = ["study_command"]

Made = tuple[Chapter, Mapping[str, object]]


def study_command(make: Callable[..., Made]) -> click.Command:
    """Return the command of a study, with the options of ``make`` and ``--json`` and ``--report``.

    ``make(progress, **options)`` returns the study and the settings that the page shows.
    """

    @writes("json", "report")
    def run(outputs: Outputs, **options: Any) -> None:
        with Progress() as progress:
            chapter, settings = make(progress, **options)
        shown = {name: str(value) for name, value in settings.items()}
        publish(outputs, chapter.command, chapter, lambda path, asked: write_chapter(chapter, path, asked), shown)

    command = click.command(make.__name__, help=make.__doc__)(run)
    # Click collects the options of a function in reverse order.
    command.params[:0] = reversed(getattr(make, "__click_params__", []))
    return command
