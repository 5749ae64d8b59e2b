"""The report of a study: the result and the cost of each combination of order, method, noise bound and samples."""

from __future__ import annotations

from collections.abc import Mapping

from smid.reports.chapter import chapter_page, together
from smid.reports.content import Page, Picture, Section
from smid.reports.documents import study_document
from smid.reports.page import capitalised
from smid.study import Status, Study

_HOW = (
    "Each row is one identification. Its interval is certified: all parameters that explain these samples within this "
    "noise bound lie inside, for every order and method.",
    "The gap is the undecided part between certified and witnessed bounds, as a share of the interval's width. Memory "
    "is the largest memory of the process during the identification, libraries included.",
)


def study_page(study: Study, *, settings: Mapping[str, str] | None = None) -> Page:
    """Return the report of a study; see :func:`smid.report`."""
    certified = {cell.record for cell, outcome in study.done if outcome.status is Status.CERTIFIED}
    pictures = tuple(
        Picture(
            study.plot(record),
            f"{record}: certified bounds (thin), witnessed bounds (thick), widths and times, where they vary.",
        )
        for record in study.records
        if record in certified
    )
    sections = (
        *((Section("What varies", pictures),) if pictures else ()),
        Section("All runs", (*_HOW, study.table)),
        *((Section("Runs without intervals", study.messages),) if study.messages else ()),
    )
    return chapter_page(
        f"{capitalised(study.model.name)}: a study",
        f"{study.answer} {study.conclusion}".lstrip(),
        sections,
        together(study.records),
        document=study_document("study", study.to_dict()),
        settings=settings,
    )
