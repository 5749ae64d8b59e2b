"""A table for the eye: a caption, a header, cells of text, and how a number is written there."""

from __future__ import annotations

from dataclasses import dataclass

__all__ = ["Table", "figure"]


@dataclass(frozen=True)
class Table:
    """Text in rows and columns.

    Parameters
    ----------
    caption : str
        What the table says; empty for none.
    header : tuple of str
    rows : tuple of tuples of str
        Each as long as the header.
    align : str
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


def figure(value: float) -> str:
    """Write a number to three figures; a dash for none.

    Parameters
    ----------
    value : float

    Returns
    -------
    str

    Examples
    --------
    >>> figure(0.12345), figure(3e-15), figure(float("nan"))
    ('0.123', '3e-15', '-')
    """
    return f"{value:.3g}" if value == value else "-"
