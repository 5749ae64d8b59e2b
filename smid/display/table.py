"""A printed table, also for notebooks, and the form of its numbers."""

from __future__ import annotations

from dataclasses import dataclass
from html import escape


@dataclass(frozen=True)
class Table:
    """Text in rows and columns.

    Parameters
    ----------
    caption
        Empty for none.
    rows
        Each as long as the header.
    align
        One letter per column: "l" for words, "r" for numbers.

    Raises
    ------
    ValueError
        If a row, or `align`, is not as long as the header.

    Examples
    --------
    >>> print(Table("Errors in bar.", ("record", "RMSE"), (("20C_ramp_a", "0.5"),), "lr"))
    Errors in bar.
    record      RMSE
    20C_ramp_a   0.5
    """

    caption: str
    header: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    align: str

    def __post_init__(self) -> None:
        for row in (*self.rows, self.align):
            if len(row) != len(self.header):
                raise ValueError(f"{row!r} does not fit the header {self.header}: give as many cells")

    def __str__(self) -> str:
        widths = [max(len(row[k]) for row in (self.header, *self.rows)) for k in range(len(self.header))]
        lines = [
            "  ".join(
                cell.ljust(width) if side == "l" else cell.rjust(width)
                for cell, width, side in zip(row, widths, self.align, strict=True)
            ).rstrip()
            for row in (self.header, *self.rows)
        ]
        return "\n".join([self.caption, *lines] if self.caption else lines)

    def _repr_html_(self) -> str:
        # A caption element is as narrow as its table; notebooks align every cell to the right unless it says otherwise.
        caption = f"<figcaption>{escape(self.caption)}</figcaption>" if self.caption else ""
        head = self._cells(self.header, 'th scope="col"')
        body = "".join(self._cells(row, "td") for row in self.rows)
        table = f"<table><thead>{head}</thead><tbody>{body}</tbody></table>"
        return f'<figure style="margin: 1em 0; overflow-x: auto">{caption}{table}</figure>'

    def _cells(self, texts: tuple[str, ...], tag: str) -> str:
        sides = ("left" if side == "l" else "right" for side in self.align)
        cells = (
            f'<{tag} style="text-align: {side}">{escape(text)}</{tag[:2]}>'
            for text, side in zip(texts, sides, strict=True)
        )
        return f"<tr>{''.join(cells)}</tr>"


def figure(value: float) -> str:
    """Return a number with three digits; a dash for NaN.

    Examples
    --------
    >>> figure(0.12345), figure(3e-15), figure(float("nan"))
    ('0.123', '3e-15', '-')
    """
    return f"{value:.3g}" if value == value else "-"
