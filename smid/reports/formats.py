"""The format of a report: the suffix of its path selects it."""

from __future__ import annotations

from itertools import count
from os import PathLike
from pathlib import Path

from relaxations.writing import check_writable, write_text
from smid.reports.content import Page, Picture
from smid.reports.documents import as_text
from smid.reports.markdown import as_markdown
from smid.reports.pdf import print_pdf

SUFFIXES = (".html", ".pdf", ".md", ".json")


def check_report(path: str | PathLike[str]) -> None:
    """Raise an error that names the cure if no report can be written there; call it before long work.

    Raises
    ------
    ValueError
        If the suffix is not a report format.
    OSError
        See :func:`check_writable`.

    Examples
    --------
    >>> check_report("report.docx")
    Traceback (most recent call last):
    ...
    ValueError: cannot write report.docx: '.docx' is not a report format; choose .html, .pdf, .md or .json
    """
    target = Path(path)
    if target.suffix not in SUFFIXES:
        choices = f"{', '.join(SUFFIXES[:-1])} or {SUFFIXES[-1]}"
        raise ValueError(f"cannot write {target}: {target.suffix!r} is not a report format; choose {choices}")
    check_writable(target)
    if target.suffix == ".pdf":
        check_writable(target.with_suffix(".html"))


def write_page(page: Page, path: str | PathLike[str]) -> Path:
    """Write a page as HTML, PDF, Markdown or JSON; return its path, or that of the HTML if no PDF could be printed.

    The HTML of a PDF is written beside it. The figures of ``a.md`` are in the folder ``a_files``.
    """
    check_report(path)
    from smid.reports.html import as_html  # needs jinja2 and matplotlib

    target = Path(path)
    match target.suffix:
        case ".json":
            return write_text(target, as_text(page.document))
        case ".md":
            return write_text(target, _markdown(page, target))
        case ".pdf":
            html = write_text(target.with_suffix(".html"), as_html(page))
            return target if print_pdf(html, target) else html
        case _:
            return write_text(target, as_html(page))


def _markdown(page: Page, target: Path) -> str:
    from smid.display.style import save_svg  # needs matplotlib

    folder, numbers = target.with_name(f"{target.stem}_files"), count(1)

    def keep(picture: Picture) -> str:
        folder.mkdir(exist_ok=True)
        name = f"figure-{next(numbers)}.svg"
        save_svg(picture.figure, folder / name)
        return f"{folder.name}/{name}"

    return as_markdown(page, keep)
