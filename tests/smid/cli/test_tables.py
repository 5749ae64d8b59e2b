"""Excel workbooks and Parquet files on the command line, and text in other encodings."""

from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from smid.data import DataError, Dataset

KINDS = {"xlsx": ("openpyxl", "excel"), "parquet": ("pyarrow", "parquet")}


@pytest.mark.parametrize("suffix", KINDS)
def test_a_table_gives_what_the_text_gives(smid, suffix):
    pytest.importorskip(KINDS[suffix][0], reason=f"{KINDS[suffix][0]} is not installed: pip install smid[dev]")
    frame = pd.read_csv("run.csv", skiprows=1)
    if suffix == "xlsx":
        frame.to_excel("run.xlsx", index=False)
    else:
        frame.to_parquet("run.parquet")
    command = "error-bound run.{} --model model.toml --input u --output y"
    found = smid(command.format(suffix))
    assert found.exit_code == 0, found.stderr
    assert found.stdout.splitlines()[0] == smid(command.format("csv")).stdout.splitlines()[0]


@pytest.mark.parametrize("suffix", KINDS)
def test_a_missing_library_is_named_with_its_extra(smid, suffix, monkeypatch):
    library, extra = KINDS[suffix]
    monkeypatch.setattr("smid.data.read_tables.find_spec", lambda name: None if name == library else find_spec(name))
    Path(f"run.{suffix}").write_bytes(b"")
    told = smid(f"show run.{suffix}").stderr
    assert library in told
    assert f'pip install "smid[{extra}]"' in told
    with pytest.raises(DataError, match="no file"):
        Dataset.from_file(f"none.{suffix}", "u", "y")


@pytest.mark.parametrize("option", ["delimiter ;", "encoding utf-8", "decimal ,"])
def test_an_option_of_text_is_refused_for_another_kind_of_file(smid, option):
    np.savez("run.npz", u=[1.0, 2.0], y=[1.0, 3.0])
    told = smid(f"show run.npz --{option}")
    assert told.exit_code == 2
    assert f"run.npz is no text, and has no {option.split()[0]}" in told.stderr


def test_an_encoding_that_the_bytes_do_not_tell_is_asked_for(smid):
    text = Path("run.csv").read_text().replace("y [bar]", "y [°C]")
    Path("run.csv").write_bytes(text.encode("cp437"))
    asked = smid("show run.csv")
    assert asked.exit_code == 2
    assert "line 2" in asked.stderr
    assert "--encoding" in asked.stderr
    assert "°C" in smid("show run.csv --encoding cp437").stdout
    assert "another encoding" in smid("show run.csv --encoding utf-8").stderr
