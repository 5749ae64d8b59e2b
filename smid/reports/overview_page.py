"""The report on a record alone: what was understood of a file, and its samples over time."""

from __future__ import annotations

from os import PathLike
from pathlib import Path

from smid.data.overview import Overview
from smid.reports.content import Items, Page, Picture, Section
from smid.reports.documents import Document
from smid.reports.formats import write_page
from smid.reports.page import is_simulated


def overview_report(path: str | PathLike[str], overview: Overview, document: Document) -> Path:
    """Write the report of an overview; see :func:`smid.report` for formats and errors.

    Examples
    --------
    >>> import tempfile
    >>> from smid.data.columns import Table
    >>> from smid.data.overview import overview
    >>> found = overview(Table("run", "run.csv", {"y": ("1", "2", "4")}), sampling_time=1)
    >>> overview_report(Path(tempfile.mkdtemp()) / "run.html", found, found.to_dict()).name
    'run.html'
    """
    table = overview.table
    sections = (
        Section("Channels", (table, Items(overview.notes))),
        Section("Samples", (Picture(overview.plot(), "The samples; a line ends where samples are missing."),)),
    )
    sentence = f"{overview.run.n_samples} samples of {len(overview.channels)} channels, read from {overview.source}."
    page = Page(f"The record {overview.run.name}", (sentence,), sections, document, is_simulated([overview.source]))
    return write_page(page, path)
