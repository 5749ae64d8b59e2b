"""The report of a comparison: the scores of all models, their free runs in one picture, and their equations."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from smid.reports.content import Block, Facts, Heading, Page, Picture, Section
from smid.reports.documents import compare_document
from smid.reports.page import data_section, equations, is_simulated
from smid.validation import Comparison

_HOW = (
    "Each model runs freely: it reads the input, and the measured output only to start. All models are scored on the "
    "same samples. The fit is 100 % for a perfect free run, and 0 % for one that is no better than the mean of the "
    "output."
)


def comparison_page(comparison: Comparison, *, settings: Mapping[str, str] | None = None) -> Page:
    """Return the report of a comparison; see :func:`smid.report`."""
    sections = (
        Section("Scores", (comparison.table, _HOW)),
        Section("Free runs", tuple(_pictures(comparison))),
        Section("Models", tuple(_models(comparison))),
        data_section(comparison.data, drawn=False),
    )
    count = len(comparison.validations)
    return Page(
        f"Comparison of {count} models" if count > 1 else "Free run of one model",
        (comparison.sentence,),
        sections,
        compare_document(comparison),
        is_simulated([comparison.data.source]),
        settings or {},
    )


def _pictures(comparison: Comparison) -> Iterator[Block]:
    for number, score in enumerate(comparison.validations[comparison.best].scores):
        yield Picture(
            comparison.plot(number),
            f"{score.experiment}: {score.channel} measured and simulated; the best model is in front. Bottom: errors.",
            f"Measured {score.channel} and all free runs over time, with the errors below: {score.experiment}",
        )


def _models(comparison: Comparison) -> Iterator[Block]:
    for name, run in comparison.validations.items():
        yield Heading(name)
        yield equations(run.model)
        yield Facts(tuple((parameter, f"{value:.6g}") for parameter, value in run.model.values.items()))
