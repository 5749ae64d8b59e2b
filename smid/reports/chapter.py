"""The frame of a study's page: what it found, its sections, what cannot be compared, and the records."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

from smid.data import Dataset
from smid.reports.content import Items, Page, Section
from smid.reports.documents import Document
from smid.reports.page import data_section, is_simulated

__all__ = ["chapter_page", "together"]


def together(records: Mapping[str, Dataset]) -> Dataset:
    """Put the records of a study together, each under its own name; the parts of a split record keep their numbers."""

    def named(name: str, data: Dataset) -> Dataset:
        names = [name] if len(data.experiments) == 1 else [f"{name}_{k + 1}" for k in range(len(data.experiments))]
        return data.with_experiments([replace(r, name=n) for r, n in zip(data.experiments, names, strict=True)])

    return Dataset.merge([named(name, data) for name, data in records.items()])


def chapter_page(
    title: str,
    conclusion: str,
    sections: Sequence[Section],
    data: Dataset,
    *,
    document: Document,
    not_compared: Sequence[str] = (),
    settings: Mapping[str, str] | None = None,
) -> Page:
    """Return the page of a study.

    Parameters
    ----------
    conclusion
        The result in a few sentences, for the top of the page.
    data
        The records that were used.
    document
        The study as plain data.
    not_compared
        What of the source cannot be compared with this study, and why.
    settings
        What was asked for, in the user's words; shown at the end.
    """
    compared = (Section("What cannot be compared", (Items(tuple(not_compared)),)),) if not_compared else ()
    return Page(
        title,
        (conclusion,),
        (*sections, *compared, data_section(data, drawn=False)),
        document,
        is_simulated([data.source]),
        settings or {},
    )
