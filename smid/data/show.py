"""What was understood of a file of columns."""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

from smid.data.columns import Missing, Names, as_names, as_words
from smid.data.overview import Overview, overview
from smid.data.read_file import read_file

__all__ = ["show"]


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
    columns
        The columns to keep; by default every column of numbers.
    path, sampling_time, time, units, delimiter, decimal, missing, encoding
        As for :meth:`smid.Dataset.from_file`.

    Raises
    ------
    DataError
        As for :meth:`smid.Dataset.from_file`, and if no column holds numbers.

    Examples
    --------
    >>> import tempfile
    >>> file = Path(tempfile.mkdtemp()) / "run.csv"
    >>> _ = file.write_text("time,pressure [bar]\n0.0,1\n0.1,\n0.2,3\n")
    >>> found = show(file)
    >>> found.samples, found.channels[0].unit, found.notes[-1]
    (3, 'bar', 'gap: 1 sample is missing from t = 0.1 s')
    """
    table = replace(read_file(Path(path), delimiter, decimal, encoding), missing=as_words(missing))
    return overview(table, as_names(columns), sampling_time, time, units)
