"""The page of a recursive set on a record: intervals over time, and the certified changes."""

from __future__ import annotations

from collections.abc import Mapping

from smid.recursive.tracked_set import TrackedSet
from smid.reports.content import Items, Page, Picture, Section
from smid.reports.documents import study_document
from smid.reports.page import data_section, is_simulated

_HOW = (
    "Every sample cuts an outer set of the parameters, and a refinement cuts it in pieces with all stored samples. "
    "Multipliers prove each interval, with every rounding error accounted for. No parameters outside the intervals "
    "explain the samples within the noise bounds.",
    "A change is proven if no parameters in the first intervals, constant or within the stated drift, explain the "
    "samples since the set was started. The set then starts anew from the first intervals.",
)


def track_page(found: TrackedSet, settings: Mapping[str, str] | None = None) -> Page:
    """Return the page of a recursive set; settings are the options, in the user's words."""
    picture = Picture(found.plot(), "Certified intervals after each sample, and the certified changes.", "Intervals")
    changes = (Items(found.changes),) if found.changes else ("No change of the plant is proven.",)
    sections = (
        Section("Intervals", (picture, found.table)),
        Section("Changes of the plant", changes),
        data_section(found.data, drawn=True),
        Section("How the intervals are proven", _HOW),
    )
    document = study_document("track", found.to_dict())
    title = f"{found.data.output}: recursive intervals"
    return Page(title, (found.conclusion,), sections, document, is_simulated([found.data.source]), settings or {})
