"""Columns of a file, before they become numbers."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from smid.data.channel import name_hint
from smid.data.errors import DataError

Names = str | int | Sequence[str | int]
"""One or several column names; a column without a header is named by its number from 0."""

_NAME_AND_UNIT = re.compile(r"^(?P<name>.*?\S)\s*[\[(](?P<unit>[^\[\]()]*)[\])]$")
_TAG = re.compile(r"^[A-Z]{1,5}[- ]?\d{2,}[A-Z]?$")
_PRINTED_NUMBER = re.compile(r"^[+-]?(\d*)\.?(\d*)(?:[eE]([+-]?\d+))?$")


def split_unit(header: str) -> tuple[str, str]:
    """Return name and unit of a header such as `pressure [bar]` or `pressure (bar)`.

    The tag of an instrument in brackets, as in `pressure (Y-101)`, is no unit and stays in the name.
    """
    match = _NAME_AND_UNIT.match(header.strip())
    if match is None or _TAG.match(match["unit"].strip()):
        return header.strip(), ""
    return match["name"], match["unit"].strip()


def as_names(names: Names) -> tuple[str, ...]:
    """Return one name or several as a tuple of strings."""
    if isinstance(names, (str, int)):
        return (str(names),)
    return tuple(str(name) for name in names)


@dataclass(frozen=True)
class Table:
    """Columns of one file: text from a CSV file, arrays from the other formats.

    ``origin`` is the file name for messages; ``lines`` are the line numbers of the rows, empty if the file has no
    lines.
    """

    name: str
    origin: str
    cells: Mapping[str, Sequence[str] | NDArray[np.generic]]
    units: Mapping[str, str] = field(default_factory=dict)
    lines: tuple[int, ...] = ()

    def find(self, wanted: str) -> str:
        """Return the name of a column that is given with or without its unit; DataError if there is none."""
        for name in (wanted, split_unit(wanted)[0]):
            if name in self.cells:
                return name
        raise DataError(f"{self.origin}: no column {wanted!r}; {name_hint(wanted, self.cells)}")

    def numbers(self, name: str) -> NDArray[np.float64]:
        """Return the numbers of a column, shape (N,).

        Raises
        ------
        DataError
            If a cell is not a real number. The message names its row (counted from 1 after the header) and line.
        """
        cells = self.cells[name]
        if isinstance(cells, np.ndarray):
            if cells.dtype.kind not in "buif":
                raise DataError(
                    f"{self.origin}: column {name!r} holds {cells.dtype} values; convert it to real numbers first"
                )
            return cells.astype(np.float64)
        try:
            return np.fromiter(map(float, cells), dtype=np.float64, count=len(cells))
        except ValueError:
            row = next(index for index, cell in enumerate(cells) if not is_number(cell))
        where = f"row {row + 1}" + (f" (line {self.lines[row]})" if self.lines else "")
        what = f"{cells[row]!r} is not a number" if cells[row] else "the cell is empty"
        raise DataError(
            f"{self.origin}: {where}, column {name!r}: {what}; write a number with a decimal point or drop the row"
        )

    def resolution(self, name: str) -> float:
        """Return the unit of the last printed digit of a text column; 0 for arrays, which carry all digits.

        The file may omit trailing zeros, and large numbers may have fewer decimals. So the finest decimal and the
        largest number of digits in the whole column decide.
        """
        cells = self.cells[name]
        if isinstance(cells, np.ndarray):
            return 0.0
        finest, most_digits, largest = 400, 0, -400
        for cell in cells:
            match = _PRINTED_NUMBER.match(cell)
            if match is None:
                continue
            whole, decimals, exponent = match[1].lstrip("0"), match[2], int(match[3] or 0)
            digits = len((whole + decimals).lstrip("0"))
            finest = min(finest, exponent - len(decimals))
            most_digits = max(most_digits, digits)
            if digits:
                largest = max(largest, exponent - len(decimals) + digits)
        return 0.0 if finest == 400 else float(10.0 ** max(finest, largest - most_digits))


def is_number(cell: str) -> bool:
    """Tell whether a cell reads as a number."""
    try:
        float(cell)
    except ValueError:
        return False
    return True
