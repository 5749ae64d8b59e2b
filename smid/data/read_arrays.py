"""Columns from NumPy archives, MATLAB files and pandas frames."""

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any
from zipfile import BadZipFile

import numpy as np
from numpy.typing import NDArray
from scipy.io import loadmat

from smid.data.columns import Table, split_unit
from smid.data.dates import utc
from smid.data.errors import DataError

if TYPE_CHECKING:
    import pandas


def _columns(arrays: Mapping[str, Any]) -> dict[str, NDArray[np.generic]]:
    """Return vectors by name; a matrix `u` of two columns gives `u0` and `u1`, other arrays are left out."""
    cells: dict[str, NDArray[np.generic]] = {}
    for name, value in arrays.items():
        array = np.asarray(value)
        if array.ndim == 1 or (array.ndim == 2 and 1 in array.shape):
            cells[name] = array.reshape(-1)
        elif array.ndim == 2:
            tall = array if array.shape[0] >= array.shape[1] else array.T
            cells.update({f"{name}{k}": tall[:, k] for k in range(tall.shape[1])})
    return cells


def require_file(path: Path) -> None:
    """Raise a DataError if there is no such file."""
    if not path.is_file():
        raise DataError(f"no file {str(path)!r}; check the path (the current folder is {str(Path.cwd())!r})")


def read_npz(path: Path) -> Table:
    """Return the vectors of a NumPy archive; the columns of a matrix `u` are named `u0`, `u1`, ...

    DataError if the file is missing, or is not an archive of plain numbers.
    """
    require_file(path)
    try:
        # Pickled objects could run code on loading, so they are refused.
        with path.open("rb") as file, np.load(file, allow_pickle=False) as archive:
            arrays = {name: archive[name] for name in archive.files}
    except (ValueError, OSError, AttributeError, TypeError, EOFError, BadZipFile):
        raise DataError(f"{path.name} is not an archive of plain arrays; write it with numpy.savez") from None
    return Table(path.stem, path.name, _columns(arrays))


def read_mat(path: Path) -> Table:
    """Return the vectors of a MATLAB file up to version 7; structures are left out.

    DataError if the file is missing, damaged, or of version 7.3 (which is HDF5).
    """
    require_file(path)
    try:
        content = loadmat(path)
    except NotImplementedError:
        raise DataError(
            f"{path.name} is a MATLAB file of version 7.3; save it in MATLAB with save(..., '-v7')"
        ) from None
    # scipy raises many kinds of exceptions for damaged files.
    except Exception as error:
        raise DataError(f"{path.name} cannot be read as a MATLAB file ({error}); save it again") from None
    arrays = {
        name: value
        for name, value in content.items()
        if not name.startswith("__") and np.asarray(value).dtype.kind in "buifc"
    }
    return Table(path.stem, path.name, _columns(arrays))


def table_of_frame(frame: "pandas.DataFrame", name: str, origin: str = "frame") -> Table:
    """Return the columns of a pandas frame; a named index counts as a column, dates become seconds since the first.

    DataError if two columns have the same name or the index has several levels.
    """
    if frame.index.nlevels > 1:
        raise DataError("the frame has an index of several levels; give one frame per experiment and merge")
    stamped = frame.index.dtype.kind in "Mm"
    whole = frame.reset_index(names=frame.index.name or "time") if stamped or frame.index.name is not None else frame
    cells: dict[str, NDArray[np.generic]] = {}
    units: dict[str, str] = {}
    for position, title in enumerate(whole.columns):
        column, unit = split_unit(str(title))
        if column in cells:
            raise DataError(f"two columns of the frame are named {column!r}; rename one")
        series = whole.iloc[:, position]
        values: NDArray[np.generic]
        # A missing value is NaN for any dtype of the frame.
        if series.dtype.kind == "M":
            values = utc(series)
        elif series.dtype.kind == "m":
            values = series.to_numpy() / np.timedelta64(1, "s")
        elif series.dtype.kind in "iuf":
            values = series.to_numpy(np.float64, na_value=np.nan)
        else:
            values = series.to_numpy()
        cells[column] = values
        if unit:
            units[column] = unit
    return Table(name, origin, cells, units)
