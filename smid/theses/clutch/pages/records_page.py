"""The page of the bundled records."""

from __future__ import annotations

from collections.abc import Mapping
from os import PathLike
from pathlib import Path

from smid.reports.chapter import chapter_page
from smid.reports.content import Picture, Section
from smid.reports.documents import study_document
from smid.reports.formats import write_page
from smid.theses.clutch.overview import RecordOverview

__all__ = ["records_page"]

_NOT_COMPARED = (
    "The thesis's records are confidential and its figures normalised. These bear the names of its data sets; their "
    "profiles of the current, and every size between pressure and position, are our assumptions.",
)


def records_page(
    overview: RecordOverview, path: str | PathLike[str], settings: Mapping[str, str] | None = None
) -> Path:
    """Write the page of the bundled records.

    Raises
    ------
    ValueError, OSError
        Where the path names no format, or cannot be written.

    Examples
    --------
    >>> import tempfile
    >>> from smid.theses.clutch.overview import record_overview
    >>> records_page(record_overview(), Path(tempfile.mkdtemp()) / "records.html").name
    'records.html'
    """
    picture = Picture(overview.plot(), "Current, pressure and position of each record, in percent of the largest.")
    count = len(overview.data.experiments)
    page = chapter_page(
        "Clutch: the simulated records",
        f"{count} records of current, pressure, position and temperature, all simulated.",
        (
            Section(
                "Records",
                (
                    overview.table,
                    picture,
                ),
            ),
        ),
        overview.data,
        document=study_document("clutch-records", overview.to_dict()),
        not_compared=_NOT_COMPARED,
        settings=settings,
    )
    return write_page(page, path)
