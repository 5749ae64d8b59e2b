"""The reports of virtual sensors: the choice of one, and its check on records."""

from __future__ import annotations

from collections.abc import Mapping
from os import PathLike
from pathlib import Path

from smid.data import Dataset
from smid.reports.content import Page, Picture, Section
from smid.reports.documents import study_document
from smid.reports.formats import write_page
from smid.reports.page import data_section, is_simulated
from smid.sensors import SensorCheck, SensorTraining

__all__ = ["write_check", "write_training"]


def write_training(
    found: SensorTraining, training: Dataset, path: str | PathLike[str], settings: Mapping[str, str] | None = None
) -> Path:
    """Write how a sensor was chosen and tested as a page, and return the path."""
    output = found.test.output.name
    page = Page(
        f"Virtual sensor of {output}",
        (found.conclusion,),
        (
            Section("Structures", (found.table, *found.notes, found.reliability)),
            _check_section("Test", found.test),
            Section("Certified range", (found.certified.table,)),
            data_section(training, drawn=False),
        ),
        study_document("sensor-train", found.to_dict()),
        is_simulated([training.source]),
        settings or {},
    )
    return write_page(page, path)


def write_check(found: SensorCheck, path: str | PathLike[str], settings: Mapping[str, str] | None = None) -> Path:
    """Write the check of a sensor as a page, and return the path."""
    page = Page(
        f"Virtual sensor of {found.output.name}: check",
        (found.conclusion,),
        (_check_section("Records", found), data_section(found.data, drawn=False)),
        study_document("sensor-check", found.to_dict()),
        is_simulated([found.data.source]),
        settings or {},
    )
    return write_page(page, path)


def _check_section(title: str, found: SensorCheck) -> Section:
    name = found.output.name
    picture = Picture(
        found.plot(),
        f"Measured {name} and the interval of the sensor; right: less the computed {name}.",
        f"Measured {name} over time with the interval of the sensor, and the error beside it",
    )
    return Section(title, (found.table, *found.prediction.warnings, picture))
