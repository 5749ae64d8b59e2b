"""The page of section 3.2: the Hammerstein model in three phases."""

from __future__ import annotations

from collections.abc import Mapping
from os import PathLike
from pathlib import Path

from smid.identification.figures import intervals_figure
from smid.reports.chapter import chapter_page
from smid.reports.content import Picture, Section
from smid.reports.documents import study_document
from smid.reports.formats import write_page
from smid.theses.clutch.hammerstein_study import FACTOR, HammersteinStudy

__all__ = ["hammerstein_page"]

_NOT_COMPARED = (
    "The thesis's records are confidential and its figures normalised. Ours are simulated by a plant with hysteresis "
    "and a pole that varies; its shapes and sizes are assumptions, fitted to nothing. So parameters, errors and noise "
    "bounds of the two cannot be compared as numbers, only in kind.",
    "The thesis identified on a part of 20C_ramp_a and does not say which. Our part is another one.",
    "The unit of its error bound is not printed. It is read as that of the pressure.",
    "For its validations the thesis shows figures and gives no error in numbers.",
    "How SparsePOP was set (boxes, tolerances, solver) is not told, so the printed intervals cannot be reproduced, "
    "only checked against themselves and against what the thesis's own model and noise bound allow.",
)


def hammerstein_page(
    study: HammersteinStudy, path: str | PathLike[str], settings: Mapping[str, str] | None = None
) -> Path:
    """Write the page of the Hammerstein study.

    Raises
    ------
    ValueError, OSError
        Where the path names no format, or cannot be written.

    Examples
    --------
    The study takes minutes and is not run here; ``smid clutch hammerstein --report hammerstein.html`` does the same.

    >>> from smid.theses.clutch.hammerstein_study import hammerstein_study
    >>> page = hammerstein_page(hammerstein_study(), "hammerstein.html")  # doctest: +SKIP
    """
    bound, part = study.bound, study.part
    sections = (
        Section("The thesis beside this study", (study.beside_thesis,)),
        Section(
            "Phase 1: error bound",
            (
                f"Identified on {part.source.removesuffix(' (simulated)')}. The least noise bound with which the model "
                f"explains these samples lies in {bound.enclosure} {bound.unit}. Below the lower end no parameters "
                "explain them (certified), with the upper end some do (witnessed).",
            ),
        ),
        Section(
            "Choice of the structure",
            (
                study.structures.conclusion,
                study.structures.table,
            ),
        ),
        Section(
            "Phase 2: parameter intervals",
            (
                study.orders.conclusion,
                study.orders.table,
                Picture(
                    intervals_figure(study.estimate),
                    f"Intervals at order {study.orders.orders[-1]} and {FACTOR:g} times the least noise bound, each "
                    "row on its own scale.",
                ),
            ),
        ),
        Section(
            "Widths against the noise bound",
            (
                "At the least noise bound the feasible set shrinks to a point, whatever the truth is.",
                study.widths.table,
                Picture(study.widths.plot(), "Widths of the certified intervals over the noise bound."),
            ),
        ),
        Section(
            "Phase 3: validation",
            (
                "Free runs of the central model over all records, as in figures 3.3 and 3.4 of the thesis.",
                Picture(study.plot(), "Pressure, measured and simulated freely, and the error with the noise bound."),
            ),
        ),
        Section(
            "Rivals on the same records",
            (
                "Least squares fits the free run to the same part, with the same structure and with all powers up to "
                "5. HS20 is the latter on 20C_step_a, the way the thesis made its own. The thesis's model and its HS20 "
                "are run as printed.",
                study.runs.table,
                Picture(study.runs.plot(), "RMSE of the free runs, model by model and record by record."),
            ),
        ),
        Section(
            "What the thesis prints, and what a certificate allows",
            (
                *study.printed.findings,
                study.printed.consistency,
                study.printed.table,
                Picture(
                    study.printed.plot(),
                    "Intervals on data of the thesis's central model with its noise bound, and what the thesis prints.",
                ),
            ),
        ),
    )
    page = chapter_page(
        "Clutch, section 3.2: the Hammerstein model in three phases",
        study.conclusion,
        sections,
        study.validation.data,
        document=study_document("clutch-hammerstein", study.to_dict()),
        not_compared=_NOT_COMPARED,
        settings=settings,
    )
    return write_page(page, path)
