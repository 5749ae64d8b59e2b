"""The bundled record of the heated tank is what data/README.md says."""

import hashlib
import runpy
from pathlib import Path

import numpy as np

from smid.data import Dataset
from smid.data.bundled import record_path

DATA = Path(__file__).resolve().parents[2] / "data"
FILE = DATA / "tank" / "heated_tank.csv"


def test_the_script_writes_the_file_and_the_readme_states_its_hash() -> None:
    raw = FILE.read_bytes()
    assert runpy.run_path(str(DATA / "make_tank.py"))["render"]().encode("cp1252") == raw
    assert f"{hashlib.sha256(raw).hexdigest()}  tank/heated_tank.csv" in (DATA / "README.md").read_text("utf-8")
    assert record_path("heated_tank") == FILE


def test_the_noise_keeps_its_bound_under_small_steps_of_the_stated_equation() -> None:
    columns = {"input": ["FI-101 Durchfluss", "JI-102 Heizung"], "output": "TI-103 Temperatur"}
    data = Dataset.from_file(FILE, **columns)
    flow, power, measured = (data.values(name) for name in data.names)
    temperature, expected = 38.0, []
    for k in range(data.n_samples):
        expected.append(temperature)
        for _ in range(3000):
            heat = max(power[k] - 4.0, 0.0) / 4.186
            temperature += 0.01 * (flow[k] / 60 * (14.0 - temperature) + heat) / 90.0
    error = np.abs(measured - expected)
    assert np.count_nonzero(np.isnan(error)) == data.missing["TI-103 Temperatur"] == 9
    assert 0.15 < np.nanmax(error) <= 0.2
