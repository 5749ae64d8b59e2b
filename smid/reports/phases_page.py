"""The page of the three phases: error bound, intervals, validation."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from smid.reports.content import Page, Picture, Section
from smid.reports.documents import study_document
from smid.reports.estimate_page import estimate_page
from smid.reports.page import capitalised
from smid.study.phases import Phases


def phases_page(found: Phases, settings: Mapping[str, str] | None = None) -> Page:
    """Return the page of the three phases; settings are the options, in the user's words."""
    page = estimate_page(found.estimate, found.bound, found.validations, notes=found.unstable, settings=settings)
    widths = Section(
        "Widths against the noise bound",
        (
            "At the least noise bound the feasible set shrinks to a point, whatever the true parameters are.",
            Picture(found.widths.plot(), "Widths of the certified intervals over the noise bound.", "Widths"),
            found.widths.table,
        ),
    )
    intervals, bound, *rest = page.sections
    return replace(
        page,
        title=f"{capitalised(found.estimate.model.name)}: error bound, intervals and validation",
        result=(found.conclusion,),
        sections=(bound, intervals, widths, *rest),
        document=study_document("phases", found.to_dict()),
    )
