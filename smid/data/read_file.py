"""A file of columns, read by its suffix."""

from __future__ import annotations

from pathlib import Path

from smid.data.columns import Table
from smid.data.errors import DataError
from smid.data.read_arrays import read_mat, read_npz
from smid.data.read_csv import read_csv
from smid.data.read_tables import read_excel, read_parquet

_WORKBOOKS = (".xlsx", ".xlsm", ".xls")
_OF_ARRAYS = {".npz": read_npz, ".mat": read_mat, ".parquet": read_parquet}


def is_text(path: Path) -> bool:
    """Return whether a file is read as text.

    Examples
    --------
    >>> is_text(Path("run.CSV")), is_text(Path("run.mat"))
    (True, False)
    """
    return path.suffix.lower() not in (*_OF_ARRAYS, *_WORKBOOKS)


def read_file(
    path: Path, delimiter: str | None = None, decimal: str | None = None, encoding: str | None = None
) -> Table:
    """Return the columns of a text file, a NumPy archive, a MATLAB file, an Excel workbook or a Parquet file.

    Raises
    ------
    DataError
        If the file cannot be read, or its kind does not have an option that is given.
    """
    kind = path.suffix.lower()
    if is_text(path):
        return read_csv(path, delimiter, decimal, encoding)
    given = {"delimiter": delimiter, "encoding": encoding, "decimal": None if kind in _WORKBOOKS else decimal}
    for option, value in given.items():
        if value is not None:
            raise DataError(f"{path.name} is no text, and has no {option}: leave out the {option}")
    return read_excel(path, decimal) if kind in _WORKBOOKS else _OF_ARRAYS[kind](path)
