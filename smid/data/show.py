"""Any file of columns, and what was understood of it."""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

from smid.data.columns import Missing, Names, Table, as_names, as_words
from smid.data.overview import Overview, overview
from smid.data.read_arrays import read_mat, read_npz
from smid.data.read_csv import read_csv
from smid.data.read_tables import read_excel, read_parquet

__all__ = ["READERS", "read_table", "show"]

_READ = {".npz": read_npz, ".mat": read_mat, ".parquet": read_parquet}
_WORKBOOKS = (".xlsx", ".xlsm", ".xls")
READERS: Mapping[str, str] = {
    **{".npz": "from_npz", ".mat": "from_mat", ".parquet": "from_parquet"},
    **dict.fromkeys(_WORKBOOKS, "from_excel"),
}
"""Suffix -> the function of `smid.Dataset` that reads such a file; `from_csv` reads text files."""


def read_table(
    path: Path, delimiter: str | None = None, decimal: str | None = None, encoding: str | None = None
) -> Table:
    """Return the columns of a text file, a NumPy archive, a MATLAB file, an Excel workbook or a Parquet file.

    Options that the kind of file does not have are ignored.
    """
    kind = path.suffix.lower()
    if kind in _READ:
        return _READ[kind](path)
    if kind in _WORKBOOKS:
        return read_excel(path, decimal)
    return read_csv(path, delimiter, decimal, encoding)


def show(
    path: str | Path,
    columns: Names = (),
    sampling_time: float | None = None,
    time: str | None = None,
    units: Mapping[str, str] | None = None,
    delimiter: str | None = None,
    decimal: str | None = None,
    missing: Missing = (),
    encoding: str | None = None,
) -> Overview:
    r"""Return what is understood of a file, before any model, as ``smid show`` prints it.

    Parameters
    ----------
    path
        The suffix tells the kind of file: .npz, .mat, .parquet, .xlsx, or else text.
    columns
        The columns to keep; by default every column of numbers.
    sampling_time, time, units, delimiter, decimal, missing, encoding
        As for :meth:`smid.Dataset.from_csv`.

    Raises
    ------
    DataError
        As for :meth:`smid.Dataset.from_csv`, and if no column holds numbers.

    Examples
    --------
    >>> import tempfile
    >>> file = Path(tempfile.mkdtemp()) / "run.csv"
    >>> _ = file.write_text("time,pressure [bar]\n0.0,1\n0.1,\n0.2,3\n")
    >>> found = show(file)
    >>> found.samples, found.channels[0].unit, found.notes[-1]
    (3, 'bar', 'gap: 1 sample is missing from t = 0.1 s')
    """
    table = replace(read_table(Path(path), delimiter, decimal, encoding), missing=as_words(missing))
    return overview(table, as_names(columns), sampling_time, time, units)
