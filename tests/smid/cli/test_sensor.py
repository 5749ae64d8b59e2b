"""``smid sensor``: from CSV files to a sensor, its check, its runs and its C, and one line for each mistake."""

import json
from contextlib import chdir
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from smid.cli import main


def write_records(folder, name, seed, unit="bar", factor=1.0, gaps=(), header=None):
    """Write a record of a curve with backlash: columns of any names, the pressure in any unit."""
    generator = np.random.default_rng(seed)
    knots = generator.uniform(0, 10, 60)
    p = np.interp(np.arange(1200), 20 * np.arange(60), knots)
    h, pushed = p[0], []
    for x in p:
        h = max(x - 0.5, min(x + 0.5, h))
        pushed.append(h)
    x = np.sqrt(np.maximum(0.0, np.array(pushed) - 2.0)) + generator.uniform(-0.02, 0.02, 1200)
    rows = [f"{0.01 * k:.2f},{float(factor * p[k])!r},{float(x[k])!r}" for k in range(1200) if k not in gaps]
    head = header or f"time [s],supply pressure [{unit}],travel [mm]"
    Path(folder / name).write_text("\n".join([head, *rows]) + "\n")


@pytest.fixture(scope="module")
def records(tmp_path_factory):
    folder = tmp_path_factory.mktemp("records")
    write_records(folder, "one.csv", 1)
    write_records(folder, "two.csv", 2)
    write_records(folder, "kpa.csv", 2, "kPa", 100.0)
    write_records(folder, "amps.csv", 2, "A")
    write_records(folder, "gaps.csv", 2, gaps=(50, 51, 200))
    write_records(folder, "none.csv", 2, header="time,supply pressure,travel")
    line = (
        "sensor train one.csv --input supply_pressure --output travel --structure polynomial --structure hysteresis "
        "--starts 1 --save s.json --json out.json --report out.html"
    )
    with chdir(folder):
        result = CliRunner().invoke(main, line.split(), prog_name="smid")
    return folder, result


@pytest.fixture
def trained(records, folder):
    """Copy the records, the sensor and what was written with it into the working folder."""
    for file in records[0].iterdir():
        (folder / file.name).write_bytes(file.read_bytes())
    return records[1]


def test_from_a_record_to_c(trained, smid):
    assert trained.exit_code == 0, trained.output
    # One play or two make a difference of 1 % here; a curve without hysteresis errs ten times as much.
    assert "Chosen: hysteresis of supply_pressure" in trained.stdout
    document = json.loads(Path("out.json").read_text())
    assert document["schema"] == "smid.sensor-train/1"
    assert document["test"]["scores"][0]["rmse"] < 0.05
    assert Path("out.html").stat().st_size > 10_000

    # The same errors in another unit.
    bar, kpa = (smid(f"sensor check s.json {name}.csv --json {name}.json") for name in ("two", "kpa"))
    assert bar.exit_code == kpa.exit_code == 0, kpa.output
    one, other = (json.loads(Path(f"{name}.json").read_text())["scores"][0] for name in ("two", "kpa"))
    assert one["rmse"] == pytest.approx(other["rmse"], rel=1e-9)
    assert one["coverage"] > 0.95
    lossy = smid("sensor check s.json two.csv --lose 0.1 --json lossy.json")
    assert lossy.exit_code == 0
    assert json.loads(Path("lossy.json").read_text())["scores"][0]["coverage"] >= one["coverage"]

    # Rows that are missing are bridged; a run continues where another ended.
    found = smid("sensor run s.json gaps.csv --csv run.csv --save-state state.json")
    assert found.exit_code == 0, found.output
    assert "2 samples are lost before 0.52 s: bridged" in found.stdout
    table = np.genfromtxt("run.csv", delimiter=",", skip_header=1)
    assert table.shape == (1197, 5)
    text = Path("two.csv").read_text().splitlines()
    Path("first.csv").write_text("\n".join(text[:301]) + "\n")
    Path("second.csv").write_text("\n".join([text[0], *text[301:]]) + "\n")
    for line in (
        "two.csv --csv whole.csv",
        "first.csv --csv a.csv --save-state a.json",
        "second.csv --csv b.csv --state a.json",
    ):
        assert smid(f"sensor run s.json {line}").exit_code == 0
    whole, a, b = (Path(f"{name}.csv").read_text().splitlines() for name in ("whole", "a", "b"))
    assert whole == [*a, *b[1:]]

    rows = [f"{0.01 * k:.2f},{0.008 * k!r},{max(0.0, 0.008 * k - 2.5) + 0.01 * (-1) ** k!r}" for k in range(800)]
    Path("slow.csv").write_text("\n".join(["time [s],supply pressure [bar],travel [mm]", *rows]) + "\n")
    zones = smid("sensor dead-zones slow.csv --pair supply_pressure:travel --json zones.json")
    assert zones.exit_code == 0, zones.output
    zone = json.loads(Path("zones.json").read_text())["zones"][0]
    assert zone["threshold_lower"] < 2.5 < zone["threshold_upper"]

    assert smid("sensor export s.json travel.c").exit_code == 0
    assert "supply_pressure [bar]" in Path("travel.h").read_text()


def refused(result):
    assert result.exit_code == 2, (result.output, result.exception)
    assert result.stderr.startswith("error: ")
    assert result.stderr.count("\n") == 1
    return result.stderr


def test_mistakes_are_told_in_one_line(trained, smid):
    assert trained.exit_code == 0
    older = json.loads(Path("s.json").read_text())
    Path("older.json").write_text(json.dumps({**older, "schema": "smid.sensor/1"}))
    Path("back.csv").write_text("time [s],supply pressure [bar]\n0,1\n0.01,2\n0.005,3\n")
    Path("short.csv").write_text("time [s],u,y\n" + "".join(f"{0.01 * k:.2f},{k},{k}\n" for k in range(9)))
    Path("odd.json").write_text("{}")
    common = "--input supply_pressure --output travel --save x.json"
    for line, words in (
        ("check s.json amps.csv", "supply_pressure is in A, but the sensor was trained on records in bar: convert"),
        ("run s.json amps.csv", "supply_pressure is in A, but the sensor was trained on records in bar: convert"),
        ("run s.json back.csv", "row 3 (0.005 s) lies before that of row 2 (0.01 s); sort"),
        ("run older.json two.csv", "reads smid.sensor/3: use the version of smid that wrote it"),
        ("run s.json two.csv --state odd.json", "is no state of this sensor"),
        ("run s.json run.csv", "no column 'supply_pressure'"),
        ("export s.json 2nd.c", "cannot begin the name of a C function"),
        ("export s.json s.txt", "give one that ends in .c"),
        ("export out.json s.c", "holds no result that can be loaded"),
        ("train one.csv --input supply_pressure --output travel --save missing/x.json", "there is no folder missing"),
        (
            "train short.csv --input u --output y --structure network --save x.json",
            "give more samples, or fewer inputs",
        ),
        ("dead-zones one.csv --pair supply_pressure", "'supply_pressure' is no pair: write input:output"),
        ("dead-zones one.csv --pair a:travel", "no column 'a'"),
        ("dead-zones one.csv --pair supply_pressure:travel --noise-bound 1 --noise-bound 2", "give one for each"),
        ("train one.csv --output travel --save x.json", "Missing option '--input'"),
        (f"train one.csv {common} --structure magic", "magic"),
        (f"train one.csv {common} --temperature warmth", "no column 'warmth'"),
        ("train one.csv --input travel --output travel --save x.json", "occurs 2 times; give each its own name"),
        (f"train one.csv {common} --test amps.csv", "supply_pressure is in A"),
    ):
        assert words in refused(smid(f"sensor {line}")), line
    assert not Path("x.json").exists()
    assert not Path("s.c").exists()


def test_a_record_without_units_is_said(trained, smid):
    assert trained.exit_code == 0
    said = smid("sensor check s.json none.csv --time time")
    assert "the record states no unit of supply_pressure: taken to be in bar" in said.stdout
    ran = smid("sensor run s.json none.csv --time time")
    assert "warning: the record states no unit of supply_pressure" in ran.stderr


def test_the_help_of_each_command(smid):
    assert "export" in smid("sensor").stdout
    for name in ("train", "run", "check", "export", "dead-zones"):
        assert smid(f"sensor {name} --help").exit_code == 0
