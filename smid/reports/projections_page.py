"""The report of projections: the polygons of all pairs, and the intervals that they follow from."""

from __future__ import annotations

from collections.abc import Mapping

from smid.reports.content import Page, Picture, Section
from smid.reports.documents import projections_document
from smid.reports.estimate_page import model_section, noise_bounds
from smid.reports.page import capitalised, data_section, is_simulated
from smid.responses.projections import Projections

_HOW = (
    "For each direction in the plane of two parameters, a certificate in ball arithmetic bounds the sum of both, with "
    "factors, over all parameters that fit the data: a half-plane. Half-planes make the polygon. Values inside it may "
    "be impossible: only the verified points are proven to fit."
)


def projections_page(found: Projections, *, settings: Mapping[str, str] | None = None) -> Page:
    """Return the report of projections; see :func:`smid.report`."""
    estimate = found.estimate
    picture = Picture(
        found.plot(),
        "Certified polygons (light), verified points (dark) and the interval midpoints (diamonds).",
        f"Projections of the feasible set on pairs of {', '.join(found.parameters)}",
    )
    sections = (
        Section("Pairs of parameters", (picture, found.table, *found.notes[1:])),
        Section("Parameter intervals", (estimate.table, estimate.summary)),
        model_section(estimate.model, noise_bounds(estimate)),
        data_section(estimate.data, drawn=False),
        Section("How the polygons are proven", (_HOW,)),
    )
    return Page(
        f"{capitalised(estimate.model.name)}: pairs of parameters",
        found.notes[:1],
        sections,
        projections_document(found),
        is_simulated([estimate.data.source]),
        settings or {},
    )
