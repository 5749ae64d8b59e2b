"""The page of the arm's inputs: what each tells, and how narrow certified intervals become."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from os import PathLike
from pathlib import Path

from smid.data import Dataset
from smid.reports.chapter import chapter_page, together
from smid.reports.content import Picture, Section
from smid.reports.documents import study_document
from smid.reports.formats import write_page
from smid.theses.hybrid.inputs import InputStudy

__all__ = ["inputs_page"]

_NOT_COMPARED = (
    "The thesis gives single values from single starts, no intervals; its white model found 1/J, b and Wd, and Ws "
    "at 1.6 whatever it did (table F.2).",
    "Table F.1 is read from a scan. Where it prints a fraction at every sine, the sum is multiplied by the 0.5 V of "
    "listing K.13.",
    "The arm is simulated exactly, sampled every 0.02 s with the voltage held; the thesis holds it for 0.002 s.",
)


def inputs_page(study: InputStudy, path: str | PathLike[str], settings: Mapping[str, str] | None = None) -> Path:
    """Write the page of the arm's inputs.

    Raises
    ------
    ValueError, OSError
        Where the path names no format, or cannot be written.

    Examples
    --------
    The study takes minutes and is not run here; ``smid hybrid inputs --report inputs.html`` does the same.

    >>> from smid.theses.hybrid.inputs import input_study
    >>> page = inputs_page(input_study(), "inputs.html")  # doctest: +SKIP
    """
    sections = (
        Section(
            "Certified intervals",
            (
                "No starting value: the constants are sought over orders of magnitude, and each bound is proven.",
                "Sticking is proven where the arm creeps. A signal that rushes through zero speed leaves Ws open: what "
                "the first instants hold of it is more than these bounds prove (see the least deviations).",
                study.table,
                Picture(study.plot_intervals(), "Intervals; orange: not within a factor of two. Line: the truth."),
            ),
        ),
        Section(
            "Excitation and spread",
            (
                "The order of excitation counts frequencies; it says nothing of where a nonlinear plant is driven to.",
                Picture(study.plot_spread(), "Inputs, input-output pairs, and autocovariances."),
            ),
        ),
    )
    records = {
        row.name: Dataset.from_arrays(
            input={"u": row.input}, output={"angle": row.angle}, sampling_time=study.sampling_time
        )
        for row in study.rows
    }
    page = chapter_page(
        "Inputs of the rotating arm",
        study.conclusion,
        sections,
        replace(together(records), source="rotating arm (simulated)"),
        document=study_document("hybrid-inputs", study.to_dict()),
        not_compared=_NOT_COMPARED,
        settings=settings,
    )
    return write_page(page, path)
