"""Files from other tools are read right, or refused with cause and cure; none is silently wrong."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from smid.data import DataError, Dataset
from tests.smid.data.messy_files import FILES, GAP, N, U, Y

READERS = {
    ".xlsx": Dataset.from_file,
    ".xls": Dataset.from_file,
    ".parquet": Dataset.from_file,
    ".npz": Dataset.from_file,
    ".mat": Dataset.from_file,
    ".pkl": lambda path, **options: Dataset.from_pandas(pd.read_pickle(path), **options),
}
LIBRARIES = {".xlsx": "openpyxl", ".parquet": "pyarrow"}


@pytest.mark.parametrize("file", FILES, ids=lambda file: file.name)
def test_a_messy_file_is_right_or_refused(file, tmp_path):
    library = LIBRARIES.get(Path(file.name).suffix)
    if library:
        pytest.importorskip(library, reason=f"{library} is not installed: pip install smid[dev]")
    path = file.write(tmp_path)
    options = {"input": "u", "output": "y", **file.options}
    read = READERS.get(path.suffix, Dataset.from_file)
    if file.refused:
        with pytest.raises(DataError) as refusal:
            read(path, **options)
        message = str(refusal.value)
        assert all(part in message for part in file.refused), message
        assert "\n" not in message
        return
    data = read(path, **options)
    assert data.sampling_time == pytest.approx(file.interval, rel=1e-9)
    assert tuple(data.channel(name).unit for name in (data.input, data.output)) == file.units
    assert len(data.experiments) == len(file.parts)
    for k, (first, stop) in enumerate(file.parts):
        np.testing.assert_array_equal(data.values(data.input, k), U[first:stop] * (1e3 if file.scale > 1 else 1))
        expected = np.where(file.missing & np.isin(range(N), GAP), np.nan, Y)[first:stop] * file.scale
        np.testing.assert_allclose(data.values(data.output, k), expected, rtol=1e-12)
        begin = data.experiments[k].start_time - data.experiments[0].start_time
        assert begin == pytest.approx(first * file.interval)


def test_there_are_files_of_every_kind():
    assert len(FILES) >= 80
    assert len({file.name for file in FILES}) == len(FILES)
