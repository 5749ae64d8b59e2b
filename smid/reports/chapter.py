"""The page of a study: what it found, and its tables and figures, section by section."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from os import PathLike
from pathlib import Path

import numpy as np
from matplotlib.artist import Artist
from matplotlib.figure import Figure

from smid.data import Dataset
from smid.reports.page import render_page
from smid.reports.style import inline_svg
from smid.reports.writing import check_writable, write_text
from smid.table import Table

__all__ = ["Picture", "Section", "chapter_report", "together"]

_MANY = 1000  # points
_SHARP = 200  # pixels per inch


@dataclass(frozen=True)
class Picture:
    """A figure of a page.

    Parameters
    ----------
    figure : Figure
    caption : str
        What it shows, also for readers who do not see it.
    """

    figure: Figure
    caption: str


@dataclass(frozen=True)
class Section:
    """Paragraphs, then tables, then figures.

    Parameters
    ----------
    title : str
    paragraphs : tuple of str
    tables : tuple of Table
    pictures : tuple of Picture
    """

    title: str
    paragraphs: tuple[str, ...] = ()
    tables: tuple[Table, ...] = ()
    pictures: tuple[Picture, ...] = ()


def together(records: Mapping[str, Dataset]) -> Dataset:
    """Put the records of a study together, each under its own name."""
    return Dataset.merge(
        [data.with_experiments([replace(run, name=name) for run in data.experiments]) for name, data in records.items()]
    )


def chapter_report(
    path: str | PathLike[str],
    title: str,
    conclusion: str,
    sections: Sequence[Section],
    data: Dataset,
    *,
    not_compared: Sequence[str] = (),
    settings: Mapping[str, str] | None = None,
) -> Path:
    """Write the page of a study.

    Parameters
    ----------
    path : str or path
    title : str
    conclusion : str
        The result in a few sentences, for the top of the page.
    sections : sequence of Section
    data : Dataset
        The records that were used.
    not_compared : sequence of str
        What of the source cannot be compared with this study, and why.
    settings : mapping str -> str, optional
        What was asked for, in the user's words; shown at the end.

    Returns
    -------
    Path

    Raises
    ------
    OSError
        Where the path cannot be written.

    Examples
    --------
    >>> import tempfile
    >>> data = Dataset.from_arrays(input=[0.0, 1.0], output=[0.0, 2.0], sampling_time=1.0)
    >>> table = Table("Errors.", ("record", "RMSE"), (("first", "0.5"),), "lr")
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     page = chapter_report(Path(folder) / "a.html", "Study", "Done.", [Section("Errors", (), (table,))], data)
    ...     "<td>0.5</td>" in page.read_text()
    True
    """
    check_writable(path)
    page = render_page(
        "chapter.html.j2",
        data=None,
        sources=[data.source],
        title=title,
        conclusion=conclusion,
        sections=[
            (section, [_drawn(p, f"picture-{k}-{n}") for n, p in enumerate(section.pictures)])
            for k, section in enumerate(sections)
        ],
        records=data,
        not_compared=not_compared,
        settings=settings,
    )
    return write_text(path, page)


def _drawn(picture: Picture, salt: str) -> str:
    """Return the figure for the page; clouds of points and bands of many corners are drawn as pixels.

    Each point would be an element of its own, and corners of a band are never simplified.
    """
    figure = picture.figure
    heavy: list[Artist] = [
        line
        for axes in figure.axes
        for line in axes.lines
        if line.get_marker() not in ("None", "", None) and np.shape(line.get_path().vertices)[0] > _MANY
    ]
    for axes in figure.axes:
        for group in axes.collections:
            corners = sum(np.shape(path.vertices)[0] for path in group.get_paths())
            if max(corners, np.shape(group.get_offsets())[0]) > _MANY:
                heavy.append(group)
    for artist in heavy:
        artist.set_rasterized(True)
    if heavy:
        figure.set_dpi(_SHARP)
    return inline_svg(figure, picture.caption, salt)
