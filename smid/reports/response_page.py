"""The report of a response: its certified bands, and the intervals that they follow from."""

from __future__ import annotations

from collections.abc import Mapping

from smid.reports.content import Page, Picture, Section
from smid.reports.documents import response_document
from smid.reports.estimate_page import model_section, noise_bounds
from smid.reports.page import data_section, is_simulated
from smid.responses.band import ResponseBand

_HOW = (
    "Certificates in ball arithmetic bound linear functions of the parameters over all parameters that fit the data, "
    "as for the intervals. They give a polytope that holds these parameters. Taylor models and the multipliers of "
    "linear programs bound the response over the polytope, with every rounding error accounted for.",
    "The verified band holds responses of parameters that are verified to fit: no valid band is narrower.",
)


def response_page(band: ResponseBand, *, settings: Mapping[str, str] | None = None) -> Page:
    """Return the report of a response; see :func:`smid.report`."""
    estimate = band.estimate
    picture = Picture(
        band.plot(), "Certified band (light), verified band (dark), and the central model (line).", band.title
    )
    sections = (
        Section("Response", (picture, band.table, *band.summary[1:])),
        Section("Parameter intervals", (estimate.table, estimate.summary)),
        model_section(estimate.model, noise_bounds(estimate)),
        data_section(estimate.data, drawn=True),
        Section("How the bands are proven", _HOW),
    )
    simulated = is_simulated([estimate.data.source])
    return Page(
        f"{band.title}: certified bands", band.summary[:1], sections, response_document(band), simulated, settings or {}
    )
