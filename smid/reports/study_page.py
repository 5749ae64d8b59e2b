"""The page of a study: what each combination of order, method, noise bound and samples gave, and what it cost."""

from __future__ import annotations

from collections.abc import Mapping

from smid.reports.chapter import chapter_page, together
from smid.reports.content import Page, Picture, Section
from smid.reports.documents import study_document
from smid.reports.page import capitalised
from smid.study import Status, Study

__all__ = ["study_page"]

_HOW = (
    "Each row is one identification. Its interval is certified: whichever parameters explain these samples within this "
    "noise bound lie inside, whatever order and method found it.",
    "The gap is the share of the interval that is undecided between certified and witnessed ends. Memory is the most "
    "that the process held while it ran the cell, the libraries included.",
)


def study_page(study: Study, *, settings: Mapping[str, str] | None = None) -> Page:
    """Return the page of a study; see :func:`smid.report`."""
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
        *((Section("What varies", pictures),) if pictures else ()),
        Section("All cells", (*_HOW, study.table)),
        *((Section("Cells without intervals", study.messages),) if study.messages else ()),
    )
    return chapter_page(
        f"{capitalised(study.model.name)}: a study",
        study.conclusion,
        sections,
        together(study.records),
        document=study_document("study", study.to_dict()),
        settings=settings,
    )
