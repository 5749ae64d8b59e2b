"""A plain-text table."""

from __future__ import annotations

from collections.abc import Sequence

__all__ = ["figure", "text_table"]


def text_table(header: Sequence[str], rows: Sequence[Sequence[str]], align: str) -> str:
    """Give lines of aligned cells.

    Parameters
    ----------
    header : sequence of str
    rows : sequence of sequences of str
    align : str
        One letter per column: "l" for left, "r" for right.

    Returns
    -------
    str

    Examples
    --------
    >>> print(text_table(["error", "RMSE"], [["free run", "0.5"]], "lr"))
    error     RMSE
    free run   0.5
    """
    widths = [max(len(row[k]) for row in (header, *rows)) for k in range(len(header))]
    return "\n".join(
        "  ".join(
            cell.ljust(width) if side == "l" else cell.rjust(width)
            for cell, width, side in zip(row, widths, align, strict=True)
        ).rstrip()
        for row in (header, *rows)
    )


def figure(value: float) -> str:
    """Give a number to three figures.

    Examples
    --------
    >>> figure(0.12345), figure(3e-15), figure(float("nan"))
    ('0.123', '3e-15', '-')
    """
    return f"{value:.3g}" if value == value else "-"
