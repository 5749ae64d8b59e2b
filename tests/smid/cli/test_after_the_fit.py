"""``smid compare`` and ``smid residuals``: tables, files, and mistakes in one line."""

import json
from pathlib import Path

import pytest


@pytest.fixture
def estimates(smid):
    """Two estimates: the plant's structure, and one without memory."""
    Path("static.toml").write_text('class = "OutputError"\nna = 0\nbounds = {b0 = [-5, 5]}\n')
    for name, model, bound in (("plant", "model", 0.1), ("static", "static", "1.2x")):
        line = f"identify run.csv --input u --output y --model {model}.toml --noise-bound {bound} --json {name}.json"
        assert smid(line).exit_code == 0


@pytest.mark.usefixtures("estimates")
def test_the_plant_is_ahead_of_the_model_without_memory(smid):
    result = smid("compare static.json plant.json other.csv --json c.json --report c.html")
    assert result.exit_code == 0, result.output
    assert [line.split()[0] for line in result.stdout.splitlines()[:3]] == ["model", "plant", "static"]
    assert "Best fit: plant" in result.stdout
    comparison = json.loads(Path("c.json").read_text())["comparison"]
    assert comparison["order"] == ["plant", "static"]
    page = Path("c.html").read_text(encoding="utf-8")
    assert "<h1>Comparison of 2 models" in page
    assert "simulated data" in page


@pytest.mark.usefixtures("estimates")
def test_residuals_of_the_model_without_memory_fail(smid):
    result = smid("residuals static.json long.csv --json r.json --report r.md")
    assert result.exit_code == 0, result.output
    assert "The residual is not white" in result.stdout
    assert json.loads(Path("r.json").read_text())["analysis"]["outputs"][0]["white"] is False
    assert "## Tests" in Path("r.md").read_text(encoding="utf-8")
    assert smid("residuals plant.json long.csv --json -").stdout.startswith("{")


@pytest.mark.usefixtures("estimates")
def test_files_of_one_name_are_named_by_their_paths(smid):
    Path("old").mkdir()
    Path("old/plant.json").write_text(Path("static.json").read_text())
    result = smid("compare plant.json old/plant.json other.csv")
    assert [line.split()[0] for line in result.stdout.splitlines()[:3]] == ["model", "plant.json", "old/plant.json"]


def in_other_unit(path, unit, factor):
    """Write long.csv with its output in another unit."""
    note, head, *rows = Path("long.csv").read_text().splitlines()
    cells = (row.rsplit(",", 1) for row in rows)
    lines = [note, head.replace("bar", unit), *(f"{a},{factor * float(b):.12g}" for a, b in cells)]
    Path(path).write_text("\n".join(lines))


@pytest.mark.usefixtures("estimates")
@pytest.mark.parametrize(
    "line", ["validate plant.json {}", "residuals plant.json {}", "compare static.json plant.json {}"]
)
def test_a_record_in_another_unit_is_converted(smid, line):
    in_other_unit("kpa.csv", "kPa", 100.0)
    told, converted = (smid(line.format(name)) for name in ("long.csv", "kpa.csv"))
    assert told.exit_code == converted.exit_code == 0, converted.output
    assert told.output.replace("long", "kpa").split() == converted.output.split()


@pytest.mark.usefixtures("estimates")
@pytest.mark.parametrize(
    "line",
    [
        "validate plant.json {}",
        "residuals plant.json {}",
        "compare plant.json {}",
        "phases run.csv --input u --output y --validate {}",
        "identify run.csv --input u --output y --model model.toml --noise-bound 0.1 --validate {}",
        "sensor train run.csv {} --input u --output y --save s.json",
    ],
)
def test_a_record_in_a_unit_of_another_kind_is_refused(smid, line):
    in_other_unit("mm.csv", "mm", 1.0)
    result = smid(line.format("mm.csv"))
    assert result.exit_code == 2
    assert "y is in mm, but" in result.stderr
    assert "in bar: convert the column, or correct its unit" in result.stderr


@pytest.mark.usefixtures("estimates")
def test_models_in_two_units_are_not_compared(smid):
    in_other_unit("kpa.csv", "kPa", 100.0)
    line = "identify kpa.csv --input u --output y --model model.toml --noise-bound 10 --json kpa.json"
    assert smid(line).exit_code == 0
    result = smid("compare plant.json kpa.json other.csv")
    assert result.exit_code == 2
    assert "model 'kpa' was estimated with y [kPa], not y [bar]: compare models in one unit" in result.stderr


MISTAKES = {
    "compare plant.json": "Missing argument 'MODEL...'",
    "compare run.csv other.csv": "run.csv is not valid JSON",
    "compare plant.json none.csv": "no file 'none.csv'",
    "compare plant.json other.csv --output z": "no column 'z'",
    "compare plant.json other.csv --report c.docx": "choose .html, .pdf, .md or .json",
    "residuals plant.json other.csv long.csv": "unexpected extra argument",
    "residuals plant.json short.csv": "its tests need 40",
    "compare plant.json slower.json other.csv": "slower.json was identified at 0.2 s and plant.json at 0.1 s",
    "compare plant.json constant.csv": "output 'y' is constant",
}


@pytest.mark.usefixtures("estimates")
def test_mistakes_are_told_in_one_line(smid):
    rows = Path("other.csv").read_text().splitlines()
    Path("short.csv").write_text("\n".join(rows[:22]) + "\n")
    constant = [row.rsplit(",", 1)[0] + ",1.0" for row in rows[2:]]
    Path("constant.csv").write_text("\n".join([*rows[:2], *constant]) + "\n")
    slower = json.loads(Path("plant.json").read_text())
    slower["estimate"]["data"]["sampling_time"] = 0.2
    Path("slower.json").write_text(json.dumps(slower))
    for line, words in MISTAKES.items():
        result = smid(line)
        assert result.exit_code == 2, line
        assert words in result.stderr, line
        assert len(result.stderr.strip().splitlines()) == 1, line


def test_a_fit_is_validated_compared_and_saved(smid):
    common = "fit run.csv --input u --output y --model"
    result = smid(f"{common} model.toml --json f.json --report f.html --save-model m.toml")
    assert result.exit_code == 0, result.output
    assert result.stdout.startswith("output error fitted to 40 samples by least squares")
    assert "<h1>Output error: fit" in Path("f.html").read_text(encoding="utf-8")
    for line in ("validate f.json other.csv", "compare f.json other.csv", "residuals f.json long.csv"):
        assert smid(line).exit_code == 0, line
    assert "violations" in smid("validate f.json other.csv").stdout
    again = smid(f"{common} m.toml --minimax")
    assert "by least largest error" in again.stdout
    assert smid("fit run.csv --model none.toml").stderr.count("\n") == 1
