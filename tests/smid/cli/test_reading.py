"""Options on how a file is read, on every command that reads one, and `smid show`."""

import json
from pathlib import Path

import numpy as np
import pytest

from smid.data import Dataset

COMMON = "--input u --output y --model model.toml"
OPTIONS = {"delimiter": ";", "decimal": ",", "missing": -9999, "units": {"u": "mV", "y": "Pa"}}
WORDS = "--delimiter ; --decimal , --missing -9999 --units u=mV,y=Pa"


def disguise(name="run.csv"):
    """Rewrite the record with semicolons, decimal commas, and two samples marked as missing."""
    lines = Path(name).read_text().splitlines()
    rows = [line.split(",") for line in lines[2:]]
    for k in (15, 16):
        rows[k][2] = "-9999"
    text = "\n".join([";".join(lines[1].split(",")), *(";".join(row).replace(".", ",") for row in rows)])
    Path(name).write_text(text + "\n")


def test_each_option_is_a_keyword_of_the_loader(smid):
    disguise()
    document = json.loads(smid(f"error-bound run.csv {COMMON} {WORDS} --json -").stdout)
    data = Dataset.from_file("run.csv", "u", "y", **OPTIONS)
    assert document["data"]["checksum"] == data.checksum
    assert document["data"]["samples"] == data.n_samples == 40
    assert data.missing == {"u": 0, "y": 2}
    assert data.channel("y").unit == "Pa"


@pytest.mark.parametrize(
    "line",
    [
        f"identify run.csv {COMMON} --noise-bound 0.1 --validate other.csv",
        f"error-bound run.csv {COMMON}",
        f"study run.csv {COMMON} --noise-bounds 0.1 --orders 1",
        "validate estimate.json run.csv",
        "verify proof.json run.csv --input u --output y",
        "show run.csv",
    ],
)
def test_every_command_takes_them_and_asks_for_the_mark(smid, line):
    disguise()
    disguise("other.csv")
    if "json" in line:
        made = smid(
            f"identify run.csv {COMMON} --noise-bound 0.1 --json estimate.json --certificate proof.json {WORDS}"
        )
        assert made.exit_code == 0, made.stderr
    asked = smid(f"{line} --delimiter ; --decimal ,")
    if "show" in line:
        assert "left out: y: column 'y' is -9999 2 times" in asked.stdout
    else:
        assert asked.exit_code == 2
        assert "is -9999 2 times, first in row 16 (line 17)" in asked.stderr
        assert "--missing -9999" in asked.stderr
    told = smid(f"{line} {WORDS}")
    assert told.exit_code == 0, told.stderr
    if "show" not in line:
        assert "note: 2 of 40 samples of y are missing; they constrain nothing" in told.stderr


def test_start_and_stop_count_the_missing_samples(smid):
    disguise()
    document = json.loads(smid(f"error-bound run.csv {COMMON} {WORDS} --start 2 --stop 30 --json -").stdout)
    assert document["data"]["samples"] == 30 - 2
    assert "samples 2:30" in document["data"]["source"]


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ("--units u", "'u' gives no units: write them as in u=V,y=bar"),
        ("--units z=V", "no column 'z'"),
        ("--decimal x", "'--decimal'"),
        ("--delimiter ::", "not one character"),
        ("--column z", "no column 'z'"),
    ],
)
def test_bad_options_are_refused(smid, words, message):
    found = smid(f"show run.csv {words}")
    assert found.exit_code == 2
    assert message in found.stderr
    assert found.stderr.count("\n") == 1


def test_show_prints_what_was_understood_before_any_model(smid):
    disguise()
    found = smid(f"show run.csv {WORDS} --report page.html --json out.json")
    assert found.exit_code == 0, found.stderr
    overview = json.loads(Path("out.json").read_text())["overview"]
    frame = np.array([row.replace(",", ".").split(";") for row in Path("run.csv").read_text().splitlines()[1:]], float)
    y = frame[frame[:, 2] != -9999, 2]
    assert overview["sampling_time"] == 0.1
    assert overview["gaps"] == [{"first": 15, "samples": 2}]
    (shown,) = [channel for channel in overview["channels"] if channel["channel"] == "y"]
    assert (shown["unit"], shown["samples"], shown["missing"]) == ("Pa", 38, 2)
    assert (shown["min"], shown["max"]) == (y.min(), y.max())
    assert shown["mean"] == pytest.approx(y.mean())
    assert "gap: 2 samples are missing from t = 1.5 s" in found.stdout
    assert "<svg" in Path("page.html").read_text(encoding="utf-8")


def test_show_tells_faults_and_what_it_left_out(smid):
    lines = Path("run.csv").read_text().splitlines()[1:]
    text = [f"{lines[0]},valve,status", *(f"{line},7,Good" for line in lines[1:])]
    Path("run.csv").write_text("\n".join(text) + "\n")
    found = smid("show run.csv").stdout
    assert "fault: valve is constant" in found
    assert "left out: status: text, such as 'Good'" in found


def test_show_tells_the_name_of_a_column_in_a_model_file(smid):
    Path("run.csv").write_text(Path("run.csv").read_text().replace(",u [V],", ",FI-101 Flow [V],"))
    found = smid("show run.csv").stdout
    assert "in model files: FI-101 Flow is FI_101_Flow" in found
    assert "in model files: y" not in found
    Path("model.toml").write_text('class = "OutputError"\ninput = "FI-101 Flow"\n')
    assert "write 'FI_101_Flow'" in smid("error-bound run.csv --model model.toml --output y").stderr


@pytest.mark.parametrize("suffix", ["npz", "mat"])
def test_archives_are_read_too(smid, suffix):
    from scipy.io import savemat

    table = np.loadtxt("run.csv", delimiter=",", skiprows=2)
    values = {"time": table[:, 0], "u": table[:, 1], "y": table[:, 2]}
    if suffix == "npz":
        np.savez("run.npz", **values)
    else:
        savemat("run.mat", values)
    found = smid(f"error-bound run.{suffix} {COMMON}")
    assert found.exit_code == 0, found.stderr
    assert found.stdout.split(" bar")[0].startswith(smid(f"error-bound run.csv {COMMON}").stdout.split(" bar")[0][:40])


def test_a_diagnosis_without_a_cause_names_the_columns_that_it_did_not_read(smid):
    lines = Path("long.csv").read_text().splitlines()[1:]
    rows = [f"{lines[0]},TI-104 Ambient,status", *(f"{line},{k % 7},Good" for k, line in enumerate(lines[1:]))]
    Path("run.csv").write_text("\n".join(rows) + "\n")
    command = "diagnose run.csv --input u --output y --model model.toml --effects input_delay --workers 1 --no-certify"
    found = smid(command)
    assert found.exit_code == 0, found.stderr
    assert "Columns that were not read: TI_104_Ambient. Give one" in found.stdout
    assert "not read" not in smid(f"{command} --channel TI_104_Ambient").stdout
