"""The bundled clutch records are what they say: simulated, reproducible, inside their noise bound."""

import hashlib
import importlib.util
import re
import sys
import tomllib
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

from smid.data.bundled import CLUTCH_RECORDS, SHORT_RECORDS

ROOT = Path(__file__).resolve().parents[2]
DATA = ROOT / "data"
FILES = sorted(DATA.glob("clutch/hammerstein_*.csv"))
STEPS = DATA / "clutch" / "varying_pole_20C_steps.csv"  # of another plant: tests/smid/cli/test_demo.py
NOISE_BOUND = 0.3

each_file = pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)


@pytest.fixture(scope="module")
def script() -> ModuleType:
    spec = importlib.util.spec_from_file_location("make_clutch", DATA / "make_clutch.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module  # dataclasses look their module up by name
    spec.loader.exec_module(module)
    return module


def header_of(path: Path) -> str:
    return "".join(line for line in path.read_text("ascii").splitlines(True) if line.startswith("#"))


def parameters_of(path: Path) -> dict[str, float]:
    """Read the true parameters that the header states."""
    pairs = re.findall(r"(alpha|gamma[123]) = (-?[0-9.]+)", header_of(path).split("True parameters:")[1])
    return {name: float(number) for name, number in pairs}


def columns_of(path: Path) -> np.ndarray:
    lines = [line for line in path.read_text("ascii").splitlines() if not line.startswith("#")]
    assert lines[0] == "time [s],current [mA],pressure [bar],temperature [degC]"
    return np.array([[float(cell) for cell in line.split(",")] for line in lines[1:]]).T


def test_the_script_lists_exactly_the_files_in_the_folder(script: ModuleType) -> None:
    names = [path.stem for path in (DATA / "clutch").iterdir()]
    assert sorted(record.name for record in script.RECORDS) == sorted(names) == sorted(CLUTCH_RECORDS + SHORT_RECORDS)
    assert len(FILES) == 5


def test_two_records_never_share_their_noise(script: ModuleType) -> None:
    seeds = [record.seed for record in script.RECORDS]
    assert len(set(seeds)) == len(seeds)


def test_the_script_writes_the_files_byte_for_byte(script: ModuleType) -> None:
    for record in script.RECORDS:
        content = (DATA / "clutch" / f"{record.name}.csv").read_bytes()
        assert record.render().encode("ascii") == content, record.name


def test_importing_the_script_writes_nothing(script: ModuleType, tmp_path: Path) -> None:
    copy = tmp_path / "make_clutch.py"
    copy.write_bytes(Path(str(script.__file__)).read_bytes())
    spec = importlib.util.spec_from_file_location("copied_script", copy)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    assert not list(tmp_path.rglob("*.csv"))
    module.main()
    names = sorted(path.name for path in (DATA / "clutch").iterdir())
    assert sorted(path.name for path in tmp_path.glob("clutch/*.csv")) == names


@each_file
def test_the_first_line_says_simulated(path: Path) -> None:
    assert path.read_text("ascii").startswith("# SIMULATED")
    assert re.search(r"seed \d+", header_of(path))
    assert "|eta| <= 0.3 bar" in header_of(path)


@each_file
def test_the_noise_is_inside_its_bound_for_the_true_parameters(path: Path) -> None:
    truth = parameters_of(path)
    time, current, pressure, _ = columns_of(path)
    w, previous_x, worst = 0.0, 0.0, 0.0
    for t in range(len(time)):
        if t > 0:
            w = -truth["alpha"] * w + (1 + truth["alpha"]) * previous_x
        v = 0.01 * current[t]
        previous_x = truth["gamma1"] * v**5 + truth["gamma2"] * v**4 + truth["gamma3"] * v**3
        worst = max(worst, abs(pressure[t] - w))
    assert worst <= NOISE_BOUND
    assert worst > 0.95 * NOISE_BOUND  # 600 uniform samples come close: the bound is not idle


@each_file
def test_sampling_is_uniform_and_the_current_stays_where_the_curve_rises(path: Path) -> None:
    time, current, pressure, temperature = columns_of(path)
    np.testing.assert_allclose(time, 0.002 * np.arange(600), rtol=0, atol=1e-12)
    assert current.min() == 0.0
    assert 800.0 <= current.max() <= 950.0
    assert pressure.max() > 30.0
    stated = int(path.stem.split("_")[1].replace("m", "-").removesuffix("C"))
    assert set(temperature) == {float(stated)}


@each_file
def test_a_wrong_pole_breaks_the_noise_bound(path: Path) -> None:
    """The record determines the pole: with the true curve, a pole 0.02 off cannot explain the pressure."""
    truth = parameters_of(path)
    _, current, pressure, _ = columns_of(path)
    v = 0.01 * current
    x = truth["gamma1"] * v**5 + truth["gamma2"] * v**4 + truth["gamma3"] * v**3
    for alpha in (truth["alpha"] - 0.02, truth["alpha"] + 0.02):
        # The impulse response of (1 + alpha) q^-1 / (1 + alpha q^-1), as a sum instead of a recursion.
        impulse = np.concatenate([[0.0], (1 + alpha) * (-alpha) ** np.arange(len(x) - 1)])
        assert np.max(np.abs(pressure - np.convolve(impulse, x)[: len(x)])) > NOISE_BOUND


def test_cold_is_slower_and_stronger() -> None:
    cold, room, warm = (
        parameters_of(DATA / "clutch" / f"hammerstein_{name}_ramp_a.csv") for name in ("m20C", "20C", "60C")
    )
    assert room == {"alpha": -0.65142, "gamma1": -0.00272, "gamma2": 0.03903, "gamma3": -0.08172}
    assert -1 < cold["alpha"] < room["alpha"] < warm["alpha"] < 0
    for name in ("gamma1", "gamma2", "gamma3"):
        assert abs(cold[name]) > abs(room[name]) > abs(warm[name])


@each_file
def test_the_readme_states_hash_seed_and_parameters(path: Path) -> None:
    readme = (DATA / "README.md").read_text("utf-8")
    assert f"{hashlib.sha256(path.read_bytes()).hexdigest()}  clutch/{path.name}" in readme
    row = next(line for line in readme.splitlines() if line.startswith(f"| `{path.name}`"))
    cells = [cell.strip() for cell in row.strip("|").split("|")]
    seed = re.search(r"seed (\d+)", header_of(path))
    assert seed is not None
    assert cells[2] == seed[1]
    assert [float(cell) for cell in cells[3:]] == list(parameters_of(path).values())


def test_the_wheel_ships_every_record() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))
    shipped = project["tool"]["hatch"]["build"]["targets"]["wheel"]["force-include"]
    assert shipped == {f"data/{name}": f"smid/_records/{name}" for name in ("clutch", "tank")}


def test_the_readme_states_the_hash_of_the_steps() -> None:
    line = f"{hashlib.sha256(STEPS.read_bytes()).hexdigest()}  clutch/{STEPS.name}"
    assert line in (DATA / "README.md").read_text("utf-8")
