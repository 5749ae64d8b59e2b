"""Columns of a file, before they become numbers."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from smid.data.channel import name_hint
from smid.data.dates import is_date
from smid.data.errors import DataError

Names = str | int | Sequence[str | int]
"""One or several column names; a column without a header is named by its number from 0."""

_NAME_AND_UNIT = re.compile(r"^(?P<name>.*?\S)\s*[\[(](?P<unit>[^\[\]()]*)[\])]$")
_TAG = re.compile(r"^[A-Z]{1,5}[- ]?\d{2,}[A-Z]?$")
_PRINTED_NUMBER = re.compile(r"^[+-]?(\d*)\.?(\d*)(?:[eE]([+-]?\d+))?$")

Missing = float | str | Sequence[float | str]
"""One or several values that stand for a missing sample; "none" says that the file has no such value."""

_EMPTY = frozenset(
    ("", "nan", "NaN", "NAN", "NA", "N/A", "n/a", "#N/A", "<NA>", "NULL", "null", "None", "-nan", "1.#QNAN", "-1.#IND")
)
# Values with which loggers mark a missing sample; each is asked about, because each may be a measured value too.
_SENTINELS = (-99.0, -999.25, -999.9, *(s * v for s in (-1, 1) for v in (999, 9999, 99999, 999999, 32767, 32768)))
_HUGE = 1e20
_FAR = 3.0  # ranges of the other samples


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
    lines. ``missing`` are the texts that stand for a missing sample. ``comment`` is the first comment of the file: it
    may hold what the numbers cannot say, such as that the record is simulated.
    """

    name: str
    origin: str
    cells: Mapping[str, Sequence[str] | NDArray[np.generic]]
    units: Mapping[str, str] = field(default_factory=dict)
    lines: tuple[int, ...] = ()
    missing: tuple[str, ...] = ()
    comment: str = ""

    @property
    def source(self) -> str:
        """Return the file and its comment, for reports."""
        return f"{self.origin} ({self.comment})" if self.comment else self.origin

    def find(self, wanted: str) -> str:
        """Return the name of a column that is given with or without its unit; DataError if there is none."""
        for name in (wanted, split_unit(wanted)[0]):
            if name in self.cells:
                return name
        raise DataError(f"{self.origin}: no column {wanted!r}; {name_hint(wanted, self.cells)}")

    def numbers(self, name: str) -> NDArray[np.float64]:
        """Return the numbers of a column, shape (N,); a missing sample is NaN.

        Raises
        ------
        DataError
            If a cell is not a real number, or a value looks like the mark of a missing sample. The message names its
            row (counted from 1 after the header) and line.
        """
        cells = self.cells[name]
        if isinstance(cells, np.ndarray):
            if cells.dtype.kind not in "buif":
                raise DataError(
                    f"{self.origin}: column {name!r} holds {cells.dtype} values; convert it to real numbers first"
                )
            found = cells.astype(np.float64)
        else:
            words = {*_EMPTY, *self.missing}
            try:
                found = np.array([np.nan if cell in words else float(cell) for cell in cells], dtype=np.float64)
            except ValueError:
                row = next(k for k, cell in enumerate(cells) if cell not in words and not is_number(cell))
                raise DataError(
                    f"{self.origin}: {self.place(row)}, column {name!r}: {cells[row]!r} is not a number; write a "
                    f"number with a decimal point, or give missing={cells[row]!r} if it marks a missing sample"
                ) from None
        marks = [float(text) for text in self.missing if is_number(text)]
        found[np.isin(found, marks)] = np.nan
        if "none" not in self.missing:
            self._refuse_marks(name, found)
        return found

    def place(self, row: int) -> str:
        """Return a row, counted from 1 after the header, and its line if the file has lines."""
        return f"row {row + 1}" + (f" (line {self.lines[row]})" if self.lines else "")

    def _refuse_marks(self, name: str, samples: NDArray[np.float64]) -> None:
        """Refuse a column with values, far from all others, that usually mark missing samples."""
        marks = np.isin(samples, _SENTINELS) | (np.isfinite(samples) & (np.abs(samples) >= _HUGE))
        rest = samples[np.isfinite(samples) & ~marks]
        if not marks.any() or not rest.size:
            return
        low, high = float(rest.min()), float(rest.max())
        away = np.maximum(samples - high, low - samples)
        # A step from rest to 999 is no mark; a negative one among positive samples is.
        far = marks & (away > _FAR * (high - low)) & ((high > low) | ((samples < 0) & (low >= 0)))
        if far.any():
            row = int(np.flatnonzero(far)[0])
            value = samples[row]
            count = int(np.count_nonzero(samples == value))
            often = "once" if count == 1 else f"{count} times"
            raise DataError(
                f"{self.origin}: column {name!r} is {value:.15g} {often}, first in {self.place(row)}, and otherwise "
                f"from {low:g} to {high:g}: it looks like the mark of a missing sample; give missing={value:.15g} "
                f"(--missing {value:.15g}), or missing='none' if it was measured"
            )

    def is_of_dates(self, name: str) -> bool:
        """Tell whether a column holds dates or times of day."""
        cells = self.cells[name]
        if isinstance(cells, np.ndarray):
            return cells.dtype.kind == "M"
        return bool(cells) and is_date(cells[0])

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


def as_words(missing: Missing) -> tuple[str, ...]:
    """Return the values that stand for a missing sample as texts."""
    return (str(missing),) if isinstance(missing, (str, int, float)) else tuple(map(str, missing))


def is_missing(cell: str) -> bool:
    """Tell whether a cell is empty, or holds a word that every tool writes for a missing sample."""
    return cell in _EMPTY


def is_number(cell: str) -> bool:
    """Tell whether a cell reads as a number."""
    try:
        float(cell)
    except ValueError:
        return False
    return True
