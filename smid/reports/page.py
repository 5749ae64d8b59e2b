"""What all pages share: the frame, the record, and what it was computed with."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from datetime import UTC, datetime
from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined

from smid.data import Dataset
from smid.data.resample import Resampling
from smid.reports.figures import data_figure
from smid.reports.style import inline_svg
from smid.reports.versions import versions


def render_page(
    template: str,
    *,
    data: Dataset | None,
    sources: Sequence[str] = (),
    links: Mapping[str, str] | None = None,
    **content: Any,
) -> str:
    """Fill a template.

    Parameters
    ----------
    template : str
        Its file name in ``templates``.
    data : Dataset or None
        The record to show.
    sources : sequence of str
        Where further numbers on the page come from: one that is simulated labels the page.
    links : mapping str -> str, optional
        Words -> address, relative to the page.
    **content
        What the template names beside these.

    Returns
    -------
    str
        The page.
    """
    environment = Environment(
        loader=PackageLoader("smid.reports"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    named = [*sources, *([data.source] if data is not None else [])]
    return environment.get_template(template).render(
        data=data,
        data_picture=None if data is None else inline_svg(data_figure(data), "The samples over time", "data"),
        resampled=[] if data is None else _resampled(data),
        simulated=any("simulated" in source.casefold() for source in named),
        links=links or {},
        versions=versions(),
        written=datetime.now(UTC).strftime("%Y-%m-%d %H:%M UTC"),
        **content,
    )


def _resampled(data: Dataset) -> list[tuple[str, Resampling]]:
    """Return the experiments whose time stamps were irregular, each with what was done about it."""
    pairs = zip(data.experiments, data.resampling, strict=False)  # empty where there were no time stamps
    return [(run.name, record) for run, record in pairs if record.method != "none"]
