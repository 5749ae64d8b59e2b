"""Text files of columns: separator, header and units are detected.

The rows in the middle of a file tell its separator, and which columns hold numbers or dates. The data begin at the
first row that has these, and the row above is the header. A row of units may stand between the two, and any lines above
them.
"""

import csv
import os
import re
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TypeVar

from smid.data.columns import Table, is_missing, is_number, split_unit
from smid.data.dates import is_date
from smid.data.decode import decode
from smid.data.errors import DataError

# The sign before the decimals, and the one between groups of three digits; what a number then looks like.
_GROUP = {".": ",", ",": "."}
_NUMBER = {
    decimal: re.compile(rf"[+-]?((\d+|[1-9]\d{{0,2}}(\{group}\d{{3}})+)(\{decimal}\d*)?|\{decimal}\d+)([eE][+-]?\d+)?")
    for decimal, group in _GROUP.items()
}
# A unit in brackets belongs to the word before it, also where blanks separate the columns.
_NEEDED = 12  # bytes of memory for each byte of a file: 12 with 15 digits a number, and 22 with 4
_SAMPLE = 20  # rows that tell the layout of a file
_BLANKS = re.compile(r"\s+(?![\[(])")
_TWO_NUMBERS = re.compile(r"[-+]?[\d.]+\s+[-+]?[\d.]+")
# One unit, or several with their exponents between multiplication and division.
_SYMBOL = (
    r"(?:[numkMGdch\u00b5\u03bc]|da)?(?:s|sec|min|h|V|Vpp|A|W|Wh|Hz|Pa|bar|barg|m|g|t|K|N|J|F|H|T|C|S|l|L|Ohm|\u2126|\u03a9|rad|eV|mol|VA|var)"
    r"|psi|deg[CF]?|\u00b0[CF]?|%|ppm|rpm|RPM|dB|in|ft|lb|d|1|[Vv]olts?|[Ss]econds?|[Aa]mp(?:ere)?s?|[Cc]elsius|[Bb]ar"
)
_UNIT = re.compile(
    rf"(?:{_SYMBOL})(?:\^?-?\d|[\u00b2\u00b3])?(?:[ ./*\u00b7](?:{_SYMBOL})(?:\^?-?\d|[\u00b2\u00b3])?)*"
)
Item = TypeVar("Item")


def read_text(path: Path, encoding: str | None = None) -> str:
    """Return the text of a file; DataError if there is none, it is too long, or its encoding is not clear."""
    if not path.is_file():
        raise DataError(f"no file {str(path)!r}; check the path (the current folder is {str(Path.cwd())!r})")
    size, memory = path.stat().st_size, _memory()
    if _NEEDED * size > memory:
        raise DataError(
            f"{path.name} has {size / 1e9:.3g} GB, and to read its cells takes about {_NEEDED * size / 1e9:.3g} GB of "
            f"memory; this machine has {memory / 1e9:.3g} GB: give parts of the file as several experiments, or its "
            "numbers as .npz or .parquet, which take 8 bytes each"
        )
    return decode(path.read_bytes(), path.name, encoding)


def _memory() -> float:
    """Return the bytes of this machine's memory; 8 GB where it does not say."""
    return float(os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")) if hasattr(os, "sysconf") else 8e9


def sniff_delimiter(lines: Sequence[str]) -> str:
    """Return the separator of lines of data: semicolon, tab, comma, or else blanks.

    The semicolon comes first because files that use it may write decimal commas.
    """
    for least in (len(lines) / 2, 0):
        for delimiter in (";", "\t", ","):
            rows = [next(csv.reader([line], delimiter=delimiter, skipinitialspace=True)) for line in lines]
            # Numbers with decimal commas between blanks are no columns between commas.
            if sum(len(row) > 1 and not any(map(_TWO_NUMBERS.fullmatch, row)) for row in rows) > least:
                return delimiter
    return " "


def _rows(text: str, delimiter: str | None, origin: str) -> list[tuple[int, list[str]]]:
    """Return line number and stripped cells of every row below the comments."""
    lines = text.splitlines()
    first = next((k for k, line in enumerate(lines) if line.strip() and not line.lstrip().startswith("#")), None)
    if first is None:
        raise DataError(f"{origin}: the file holds no rows; export the data again")
    separator = delimiter or sniff_delimiter(_layout([line for line in lines[first:] if line.strip()]))
    if separator.isspace() and separator != "\t":
        rows = [_BLANKS.split(line.strip()) for line in lines[first:]]
    elif len(separator) == 1:
        rows = list(csv.reader(lines[first:], delimiter=separator, skipinitialspace=True))
        if len(rows) != len(lines) - first:
            raise DataError(f"{origin}: a quoted cell spans several lines; remove the line break or the quote")
    else:
        raise DataError(f"{origin}: delimiter {separator!r} is not one character; give ',', ';', ' ' or '\\t'")
    numbered = ((first + k + 1, [cell.strip() for cell in row]) for k, row in enumerate(rows))
    return [(number, row) for number, row in numbered if any(row)]


def _middle(items: Sequence[Item]) -> Sequence[Item]:
    """Return the items in the middle, among which there are neither titles nor sums."""
    return items[len(items) // 2 :][:_SAMPLE]


def _layout(lines: Sequence[str]) -> Sequence[str]:
    """Return the lines that tell the separator; in a short file the first one too, because a row may be incomplete."""
    return [*lines[:1], *_middle(lines)] if len(lines) < _SAMPLE else _middle(lines)


def _is_value(cell: str) -> bool:
    return is_number(cell) or is_date(cell) or any(number.fullmatch(cell) for number in _NUMBER.values())


def _beginning(rows: Sequence[list[str]]) -> int:
    """Return the first row that has a value, or nothing, in every column that holds values further down."""
    below = _middle(rows)
    width = max(map(len, below))
    valued = [k for k in range(width) if 2 * sum(_is_value(row[k]) for row in below if k < len(row)) >= len(below)] or [
        0
    ]
    for k, row in enumerate(rows):
        cells = [row[j] if j < len(row) else "" for j in valued]
        if any(map(_is_value, cells)) and all(_is_value(cell) or is_missing(cell) for cell in cells):
            return k
    return 1


def _titles(rows: Sequence[list[str]]) -> tuple[list[str], list[str], int]:
    """Return the names of the columns, their units from a row of their own, and the number of the first row of data."""
    start = _beginning(rows)
    if not start:
        return [], [], 0
    # A row of names holds no value; where there is none, the row above the data has some number in a name.
    plain = [k for k in range(start) if not any(map(_is_value, rows[k]))]
    header = plain[-1] if plain else start - 1
    above = rows[header - 1] if header - 1 in plain else []
    if len(rows[header]) > 1 and sum(map(bool, above)) >= sum(map(bool, rows[header])) and _are_units(rows[header]):
        return above, [cell.strip("[]() ") for cell in rows[header]], header + 1
    return rows[header], [], header + 1


def _are_units(row: Sequence[str]) -> bool:
    return all(not cell or cell == "-" or _UNIT.fullmatch(cell.strip("[]() ")) for cell in row)


def read_csv(
    path: Path, delimiter: str | None = None, decimal: str | None = None, encoding: str | None = None
) -> Table:
    r"""Read a text file of columns.

    Lines above the header are skipped; a row of units below it gives the units. Columns without a header are named "0",
    "1", ... A column without header and cells (a separator at the end of the lines) is dropped. All numbers of the file
    together tell the sign before decimals and that between groups of digits.

    Parameters
    ----------
    delimiter
        The separator: ",", ";", "\t" or " " (any blanks); detected if not given.
    decimal
        The sign before the decimals, "." or ","; the other one may separate groups of three digits.
    encoding
        The name of the encoding; by default what the bytes tell.

    Raises
    ------
    DataError
        If the file is missing or empty, a header name occurs twice, a row has more cells than the header, or the file
        does not tell its encoding, or whether 1,000 is one or a thousand.

    Examples
    --------
    >>> import tempfile
    >>> folder = Path(tempfile.mkdtemp())
    >>> _ = (folder / "run.csv").write_text("Test rig 4\ncurrent;pressure\n[A];[bar]\n1,5;2,0\n")
    >>> table = read_csv(folder / "run.csv")
    >>> table.cells["current"], table.units
    (('1.5',), {'current': 'A', 'pressure': 'bar'})
    """
    text = read_text(path, encoding)
    table = table_of_rows(_rows(text, delimiter, path.name), path, decimal)
    comment = re.match(r"\s*#\s*(.+)", text)
    return replace(table, comment=comment[1].strip().rstrip(".")) if comment else table


def table_of_rows(rows: Sequence[tuple[int, list[str]]], path: Path, decimal: str | None) -> Table:
    """Return the columns of rows of cells, each with its number in the file; DataError as for `read_csv`."""
    origin = path.name
    if decimal not in (None, *_GROUP):
        raise DataError(f"decimal = {decimal!r}: give '.' or ','")
    titles, stated, start = _titles([row for _, row in rows])
    header = titles or [str(k) for k in range(len(rows[0][1]))]
    body = rows[start:]
    if not body:
        raise DataError(f"{origin}: there is a header but no row of numbers; export the data again")
    width = len(header)
    for number, row in body:
        if any(row[width:]):
            raise DataError(
                f"{origin}: line {number} has {len(row)} cells but the first row has {width}; "
                "check the delimiter and the header"
            )
    # Short rows are filled up with empty cells.
    padded = _with_points([(row + [""] * width)[:width] for _, row in body], [n for n, _ in body], decimal, origin)
    # Name the columns; a separator at the end of the lines gives an empty column without title.
    cells: dict[str, tuple[str, ...]] = {}
    units: dict[str, str] = {}
    for k, (title, column) in enumerate(zip(header, zip(*padded, strict=True), strict=True)):
        if not any(column) and (not titles or not title):
            continue
        name, unit = split_unit(title)
        unit = unit or (stated[k] if k < len(stated) else "")
        if name in cells:
            raise DataError(f"{origin}: two columns are named {name!r}; rename one in the header")
        cells[name] = column
        if unit and unit != "-":
            units[name] = unit
    return Table(path.stem, origin, cells, units, tuple(number for number, _ in body))


def _with_points(rows: list[list[str]], lines: Sequence[int], decimal: str | None, origin: str) -> list[list[str]]:
    """Return the rows with a point before the decimals of numbers, and without signs between groups of digits."""
    if decimal is None:
        if not any("," in cell for row in rows for cell in row):
            return rows
        signed = [
            (line, cell)
            for line, row in zip(lines, rows, strict=True)
            for cell in row
            if ("," in cell or "." in cell) and any(number.fullmatch(cell) for number in _NUMBER.values())
        ]
        fitting = [sign for sign, number in _NUMBER.items() if all(number.fullmatch(cell) for _, cell in signed)]
        if signed and len(fitting) != 1:
            line, cell = next(((n, c) for n, c in signed if "," in c), signed[0])
            why = "is one number with a decimal comma and another with a comma between groups of digits"
            mixed = "does not have the same decimal sign as other numbers of the file"
            raise DataError(
                f"{origin}: line {line}: {cell!r} {why if fitting else mixed}; give decimal=',' or decimal='.', or "
                "export the data without separators of thousands"
            )
        decimal = fitting[0]
    number, group = _NUMBER[decimal], _GROUP[decimal]
    return [
        [cell.replace(group, "").replace(decimal, ".") if number.fullmatch(cell) else cell for cell in row]
        for row in rows
    ]
