"""``smid doctor`` tells what is there, and what is broken with a cure."""

import json
import tomllib
from pathlib import Path

import pytest

from smid.cli import doctor

ROOT = Path(__file__).parents[3]


def test_a_sound_installation(smid, monkeypatch):
    monkeypatch.setenv("OMP_NUM_THREADS", "3")
    result = smid("doctor")
    assert result.exit_code == 0, result.stderr
    assert result.stderr == ""
    lines = {line[:14].strip(): line[14:] for line in result.stdout.splitlines()}
    assert set(doctor.versions()) < set(lines)
    assert lines["solvers"].startswith("clarabel")
    assert "OMP_NUM_THREADS=3" in lines["BLAS"]
    assert "certified in" in lines["small problem"]


def test_as_json(smid):
    result = smid("doctor --json -")
    found = json.loads(result.stdout)
    assert found["schema"] == "smid.doctor/1"
    assert found["troubles"] == []
    small = found["small_problem"]
    assert small["certified"]
    assert small["lower"] < doctor.TRUE_POLE < small["upper"]


@pytest.mark.parametrize(
    ("name", "has", "cause", "cure"),
    [
        ("numpy", "1.9.3", "numpy 1.9.3 is older than 1.26", 'pip install --upgrade "numpy>=1.26"'),
        ("scipy", None, "scipy is not installed", 'pip install "scipy>=1.15.2"'),
    ],
)
def test_old_and_missing_packages(smid, monkeypatch, name, has, cause, cure):
    installed = doctor.version

    def version(package):
        if package != name:
            return installed(package)
        if has is None:
            raise doctor.PackageNotFoundError(package)
        return has

    monkeypatch.setattr(doctor, "version", version)
    result = smid("doctor")
    assert result.exit_code == 2
    assert result.stderr == f"error: {cause}; {cure}\n"


def test_a_solver_that_fails(smid, monkeypatch):
    def broken(*_arguments, **_settings):
        raise ImportError("libclarabel is missing")

    monkeypatch.setattr(doctor, "identify", broken)
    result = smid("doctor")
    assert result.exit_code == 2
    assert result.stderr.startswith("error: the small problem was not certified")
    assert "libclarabel is missing" in result.stderr
    assert "certified in" not in result.stdout


def test_missing_extras_and_browser_are_no_error(smid, monkeypatch):
    monkeypatch.setattr(doctor, "find_spec", lambda name: None if name == "control" else doctor)
    monkeypatch.setenv("PATH", "")
    result = smid("doctor")
    assert result.exit_code == 0
    assert 'missing control: pip install "smid[control]" (Estimate.to_control' in result.stdout
    assert "no Chromium" in result.stdout


def test_every_extra_is_told():
    extras = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]["optional-dependencies"]
    assert set(doctor.EXTRAS) == set(extras) - {"dev"}
