"""The page of a study: what each combination of order, method, noise bound and samples gave, and what it cost."""

from __future__ import annotations

from collections.abc import Mapping
from os import PathLike
from pathlib import Path

from smid.reports.chapter import Picture, Section, chapter_report, together
from smid.study import Status, Study

__all__ = ["study_page"]

_HOW = (
    "Each row is one identification. Its interval is certified: whichever parameters explain these samples within this "
    "noise bound lie inside, whatever order and method found it.",
    "The gap is the share of the interval that is undecided between certified and witnessed ends. Memory is the most "
    "that the process held while it ran the cell, the libraries included.",
)


def study_page(study: Study, path: str | PathLike[str], settings: Mapping[str, str] | None = None) -> Path:
    """Write the page of a study.

    Parameters
    ----------
    study : Study
    path : str or path
    settings : mapping str -> str, optional

    Returns
    -------
    Path

    Raises
    ------
    OSError
        Where the path cannot be written.
    """
    certified = {cell.record for cell, outcome in study.done if outcome.status is Status.CERTIFIED}
    pictures = tuple(
        Picture(
            study.plot(record),
            f"{record}: certified ends (thin) and witnessed ones (thick), widths and times, where they vary.",
        )
        for record in study.records
        if record in certified
    )
    sections = (
        Section("What varies", (), (), pictures),
        Section("All cells", _HOW, (study.table,), ()),
        *((Section("Cells without intervals", study.messages),) if study.messages else ()),
    )
    return chapter_report(
        path,
        f"{study.model.name[0].upper()}{study.model.name[1:]}: a study",
        study.conclusion,
        sections if pictures else sections[1:],
        together(study.records),
        settings=settings,
    )
