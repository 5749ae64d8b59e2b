"""The report on a record alone: what was understood of it, and its samples over time."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import zip_longest
from os import PathLike
from pathlib import Path

from smid.data import Dataset
from smid.data.overview import Overview
from smid.display.versions import versions
from smid.reports.content import Items, Page, Picture, Section
from smid.reports.documents import DATASET, Document
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
    return write_page(_page(f"The record {overview.name}", (overview,), document), path)


def dataset_page(data: Dataset, *, settings: Mapping[str, str] | None = None) -> Page:
    """Return the report of a data set, which shows each experiment; see :func:`smid.report`."""
    overviews = tuple(
        Overview.of(run, data.channels, data.sampling_time, record, data.source or "arrays in memory", {})
        for run, record in zip_longest(data.experiments, data.resampling)
    )
    document = {"schema": DATASET, "experiments": [o.to_dict() for o in overviews], "versions": versions()}
    name = overviews[0].name if len(overviews) == 1 else f"of {len(overviews)} experiments"
    return _page(f"The record {name}", overviews, document, settings or {})


def _page(title: str, overviews: Sequence[Overview], document: Document, settings: Mapping[str, str] = {}) -> Page:
    sections = list[Section]()
    for one in overviews:
        of = f" of {one.name}" if len(overviews) > 1 else ""
        sections.append(Section(f"Channels{of}", (one.table, Items(one.notes))))
        figure = Picture(one.plot(), "The samples; a line ends where samples are missing.")
        sections.append(Section(f"Samples{of}", (figure,)))
    count = sum(one.samples for one in overviews)
    sentence = f"{count} samples of {len(overviews[0].channels)} channels, read from {overviews[0].source}."
    simulated = is_simulated([overviews[0].source])
    return Page(title, (sentence,), tuple(sections), document, simulated, settings)
