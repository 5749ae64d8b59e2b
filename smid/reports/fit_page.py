"""The report of a fit: its values with standard errors, its scores and its free run."""

from __future__ import annotations

from collections.abc import Mapping

from smid.reports.content import Page, Picture, Section
from smid.reports.documents import fit_document
from smid.reports.estimate_page import model_section
from smid.reports.page import capitalised, data_section, is_simulated
from smid.validation import ModelFit


def fit_page(found: ModelFit, *, settings: Mapping[str, str] | None = None) -> Page:
    """Return the report of a fit; see :func:`smid.report`."""
    pictures = tuple(
        Picture(
            found.plot(number),
            f"{score.experiment}: {score.channel} measured and simulated. Bottom: error.",
            f"Measured {score.channel} and its free run over time, with the error below: {score.experiment}",
        )
        for number, score in enumerate(found.scores)
    )
    sections = (
        Section("Parameters", (found.table, *found.notes)),
        Section("Free run", (found.score_table, *pictures)),
        model_section(found.model),
        data_section(found.data, drawn=False),
    )
    return Page(
        f"{capitalised(found.model.name)}: fit",
        (found.sentence,),
        sections,
        fit_document(found),
        is_simulated([found.data.source]),
        settings or {},
    )
