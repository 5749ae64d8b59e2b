"""Columns from Excel workbooks and Parquet files, through pandas and a library that an extra installs."""

from datetime import date, datetime
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from smid.data.columns import Table
from smid.data.errors import DataError
from smid.data.read_arrays import require_file, table_of_frame
from smid.data.read_csv import table_of_rows


def read_excel(path: Path, decimal: str | None = None) -> Table:
    """Return the columns of the only sheet with cells of an Excel workbook; titles and units as in a text file.

    DataError if the file is missing or damaged, several sheets hold cells, or openpyxl is not installed.
    """
    require_file(path)
    if path.suffix.lower() == ".xls":
        raise DataError(f"{path.name} is a workbook of Excel 2003 or before; save it as .xlsx, or as CSV")
    _require("openpyxl", "excel", path)
    import pandas as pd

    try:
        book = pd.read_excel(path, sheet_name=None, header=None, engine="openpyxl")
    # The libraries below raise many kinds of exceptions for damaged files.
    except Exception as error:
        raise DataError(f"{path.name} cannot be read as an Excel workbook ({error}); save it again as .xlsx") from None
    sheets = {str(name): sheet for name, sheet in book.items() if sheet.notna().to_numpy().any()}
    if len(sheets) != 1:
        held = f"several sheets with cells ({', '.join(sheets)})" if sheets else "no cell"
        raise DataError(f"{path.name} holds {held}; save the sheet of the record as a workbook of its own, or as CSV")
    (sheet,) = sheets.values()
    rows = [(k + 1, [_text(cell) for cell in row]) for k, row in enumerate(sheet.to_numpy(dtype=object))]
    return table_of_rows([(number, row) for number, row in rows if any(row)], path, decimal)


def read_parquet(path: Path) -> Table:
    """Return the columns of a Parquet file.

    DataError if the file is missing or damaged, or pyarrow is not installed.
    """
    require_file(path)
    _require("pyarrow", "parquet", path)
    import pandas as pd

    try:
        frame = pd.read_parquet(path, engine="pyarrow")
    except Exception as error:
        raise DataError(f"{path.name} cannot be read as a Parquet file ({error}); write it again") from None
    return table_of_frame(frame, path.stem, path.name)


def _require(module: str, extra: str, path: Path) -> None:
    if find_spec(module) is None:
        raise DataError(f'{path.name}: smid reads {path.suffix} files with {module}; pip install "smid[{extra}]"')


def _text(cell: Any) -> str:
    """Return a cell as a text file would hold it; a number keeps all its digits."""
    if cell is None or cell != cell:  # NaN and NaT
        return ""
    if isinstance(cell, datetime | date):
        return cell.isoformat()
    return repr(float(cell)).removesuffix(".0") if isinstance(cell, float) else str(cell).strip()
