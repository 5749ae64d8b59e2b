"""Text files of columns: separator, header and units are detected."""

import codecs
import csv
import re
from collections.abc import Sequence
from pathlib import Path

from smid.data.columns import Table, is_number, split_unit
from smid.data.errors import DataError

# The sign before the decimals, and the one between groups of three digits; what a number then looks like.
_GROUP = {".": ",", ",": "."}
_NUMBER = {
    decimal: re.compile(rf"[+-]?((\d+|[1-9]\d{{0,2}}(\{group}\d{{3}})+)(\{decimal}\d*)?|\{decimal}\d+)([eE][+-]?\d+)?")
    for decimal, group in _GROUP.items()
}
# A unit in brackets belongs to the word before it, also where blanks separate the columns.
_BLANKS = re.compile(r"\s+(?![\[(])")


def read_text(path: Path) -> str:
    """Return the text of a file in UTF-8, UTF-16 with its mark, or else Latin-1 (older instruments write µ in it)."""
    if not path.is_file():
        raise DataError(f"no file {str(path)!r}; check the path (the current folder is {str(Path.cwd())!r})")
    raw = path.read_bytes()
    try:
        return raw.decode("utf-16" if raw.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)) else "utf-8-sig")
    except UnicodeDecodeError:
        return raw.decode("latin-1")


def sniff_delimiter(line: str) -> str:
    """Return the separator of a line of text: semicolon, comma, tab, or else blanks.

    The semicolon comes first because files that use it may write decimal commas.
    """
    for delimiter in (";", ",", "\t"):
        if delimiter in line.strip():
            return delimiter
    return " "


def _rows(text: str, delimiter: str | None, origin: str) -> list[tuple[int, list[str]]]:
    """Return line number and stripped cells of every row of data or header."""
    lines = text.splitlines()
    first = next((k for k, line in enumerate(lines) if line.strip() and not line.lstrip().startswith("#")), None)
    if first is None:
        raise DataError(f"{origin}: the file holds no rows; export the data again")
    separator = delimiter or sniff_delimiter(lines[first])
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


def read_csv(path: Path, delimiter: str | None = None, decimal: str | None = None) -> Table:
    r"""Read a text file of columns.

    Lines at the top that start with `#` are skipped. A first row with a cell that is not a number is the header;
    columns without a header are named "0", "1", ... A column without header and cells (a separator at the end of the
    lines) is dropped. All numbers of the file together tell the sign before decimals and that between groups of digits.

    Parameters
    ----------
    delimiter
        The separator: ",", ";", "\t" or " " (any blanks); detected if not given.
    decimal
        The sign before the decimals, "." or ","; the other one may separate groups of three digits.

    Raises
    ------
    DataError
        If the file is missing or empty, a header name occurs twice, a row has more cells than the header, or the file
        does not tell whether 1,000 is one or a thousand.

    Examples
    --------
    >>> import tempfile
    >>> folder = Path(tempfile.mkdtemp())
    >>> _ = (folder / "run.csv").write_text("current [A];pressure (bar)\n1,5;2,0\n")
    >>> table = read_csv(folder / "run.csv")
    >>> table.cells["current"], table.units
    (('1.5',), {'current': 'A', 'pressure': 'bar'})
    """
    origin = path.name
    if decimal not in (None, *_GROUP):
        raise DataError(f"decimal = {decimal!r}: give '.' or ','")
    rows = _rows(read_text(path), delimiter, origin)
    # A first row with a cell that is not a number is the header.
    has_header = not _all_numbers(rows[0][1])
    header = rows[0][1] if has_header else [str(k) for k in range(len(rows[0][1]))]
    body = rows[1:] if has_header else rows
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
    for title, column in zip(header, zip(*padded, strict=True), strict=True):
        if not any(column) and (not has_header or not title):
            continue
        name, unit = split_unit(title)
        if name in cells:
            raise DataError(f"{origin}: two columns are named {name!r}; rename one in the header")
        cells[name] = column
        if unit:
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


def _all_numbers(row: list[str]) -> bool:
    return all(not cell or is_number(cell) or any(n.fullmatch(cell) for n in _NUMBER.values()) for cell in row)
