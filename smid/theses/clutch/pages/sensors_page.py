"""The page of chapter 5, virtual sensors, and of the single sensor that section 6.2 asks for."""

from __future__ import annotations

from collections.abc import Mapping
from os import PathLike
from pathlib import Path

from smid.data.bundled import load_clutch
from smid.display.table import Table
from smid.reports.chapter import chapter_page
from smid.reports.content import Picture, Section
from smid.reports.documents import study_document
from smid.reports.formats import write_page
from smid.theses.clutch.sensor_chapter import SensorChapter
from smid.theses.clutch.sensor_study import ErrorTable

__all__ = ["sensors_page"]

_NOT_COMPARED = (
    "The thesis's records are confidential, and its positions and errors are normalised by a scale that is not told. "
    "Ours are in mm, on simulated records whose sizes between pressure and position are assumptions. Only how errors "
    "compare from row to row of a table can be held against the thesis's.",
    "How large hysteresis is, and how long the steps last, is not told. Ours last some 0.25 s. A median over 250 "
    "samples, 0.5 s, wipes them out: CFPX with that filter is poor here, which says nothing about the thesis's.",
    "The thresholds of its dead zones are not printed. Ours are found from the records.",
    "Its errors are those of whole records, of which 70 % trained the sensor. So are ours in tables 5.1 to 5.4; the "
    "single sensor is judged on records that it has not seen.",
)


def sensors_page(chapter: SensorChapter, path: str | PathLike[str], settings: Mapping[str, str] | None = None) -> Path:
    """Write the page of the virtual sensors.

    Raises
    ------
    ValueError, OSError
        Where the path names no format, or cannot be written.

    Examples
    --------
    The study takes minutes and is not run here; ``smid clutch sensors --report sensors.html`` does the same.

    >>> from smid.theses.clutch.sensor_chapter import sensor_chapter
    >>> page = sensors_page(sensor_chapter(), "sensors.html")  # doctest: +SKIP
    """
    plain = tuple(name for name in chapter.cross.sensors if " " not in name)
    treated = tuple(name for name in chapter.cross.sensors if " " in name)
    sections = (
        *(
            Section(
                f"Table {study.number}: {study.subject}",
                (
                    study.table,
                    Picture(
                        study.plot(), f"Errors of table {study.number}, ours and the thesis's, each over its first."
                    ),
                ),
            )
            for study in chapter.tables
        ),
        Section(
            "Temperature and hysteresis",
            (
                "A sensor trained at one temperature fails at the others, and one that never saw the loops fails on "
                "records with hysteresis: 20C_step_b, 60C_step_c and m20C_step_c.",
                _part(chapter.cross, plain).table,
                Picture(_part(chapter.cross, plain).plot(), "The sensors as they are, on every record."),
                Picture(_part(chapter.cross, treated).plot(), "With median filter or dead zone, on every record."),
            ),
        ),
        Section(
            "Figures 5.2 to 5.29",
            (
                "Figures 5.1, 5.10 and 5.15 of the thesis are drawings of structures.",
                _errors(chapter),
                *(
                    Picture(
                        traces.plot(),
                        f"Figure {number}: {', '.join(traces.simulated) or 'position over pressure'}; "
                        f"{', '.join(traces.records)}.",
                    )
                    for number, traces in chapter.traces.items()
                ),
            ),
        ),
        Section(
            "One sensor for all temperatures, with hysteresis",
            (
                chapter.single.conclusion,
                "It reads pressure and temperature. Play operators, their thresholds found in training, tell the "
                "branch of the loop.",
                chapter.single.held_out.table,
                chapter.single.training.table,
                Picture(chapter.single.plot(), "Errors on the held-out records, sensor by sensor."),
            ),
        ),
        Section(
            "An interval for the position",
            (
                chapter.intervals.conclusion,
                chapter.intervals.table,
                Picture(chapter.intervals.plot(), "A part of each held-out record with its interval."),
            ),
        ),
    )
    page = chapter_page(
        "Clutch, chapter 5: virtual sensors of the position",
        f"{chapter.single.conclusion} {chapter.intervals.conclusion}",
        sections,
        load_clutch(),
        document=study_document("clutch-sensors", chapter.to_dict()),
        not_compared=_NOT_COMPARED,
        settings=settings,
    )
    return write_page(page, path)


def _part(errors: ErrorTable, sensors: tuple[str, ...]) -> ErrorTable:
    places = [errors.sensors.index(name) for name in sensors]
    return ErrorTable(errors.caption, sensors, errors.records, errors.rmse[:, places])


def _errors(chapter: SensorChapter) -> Table:
    rows = tuple(
        (number, name, ", ".join(traces.records), f"{error:.3f}")
        for number, traces in chapter.traces.items()
        for name, error in traces.rmse.items()
    )
    return Table("RMSE behind each figure [mm].", ("figure", "sensor", "records", "RMSE"), rows, "lllr")
