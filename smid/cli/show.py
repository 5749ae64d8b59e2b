"""``smid show``: what was understood of a record, before any model."""

from __future__ import annotations

from dataclasses import dataclass

import click

from smid.cli.console import Command
from smid.cli.options import FILE, Reading, argument, group, option, takes
from smid.cli.outputs import Outputs, writes
from smid.data.overview import Overview
from smid.data.show import show as show_file
from smid.display.versions import versions
from smid.reports import overview_report
from smid.reports.documents import SHOW


@dataclass(frozen=True)
class Shown:
    """A record, and the columns of it to show."""

    path: str = argument(type=FILE, metavar="DATA")
    columns: tuple[str, ...] = option(
        "--column", multiple=True, metavar="COL", help="Column to show; repeatable. [default: every column of numbers]"
    )
    sampling_time: float | None = option(
        type=float, metavar="S", help="Sampling time in seconds. [default: from the time stamps]"
    )
    time: str | None = option(
        metavar="COL", help="Column of time stamps. [default: the column named time, or the only one of dates]"
    )
    reading: Reading = group(Reading)

    def load(self) -> Overview:
        """Return what was understood of the record."""
        return show_file(self.path, self.columns, self.sampling_time, self.time, **vars(self.reading))


@click.command(cls=Command)
@takes(shown=Shown)
@writes("json", "report")
def show(shown: Shown, outputs: Outputs) -> None:
    """Print what was understood of a record: channels, units, sampling time, gaps, ranges and faults.

    DATA is the record (a text file of columns, .npz or .mat).
    """
    found = shown.load()
    document = {"schema": SHOW, "overview": found.to_dict(), "versions": versions()}
    outputs.say(found)
    outputs.write(document)
    outputs.write_report(lambda path: overview_report(path, found, document))
