from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner, Result

from smid.cli import main


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    """A working folder with a record of a first-order plant (a1 = -0.7, b0 = 0.5) and its model."""
    monkeypatch.chdir(tmp_path)
    write_record(tmp_path / "run.csv", seed=1)
    write_record(tmp_path / "other.csv", seed=2)
    write_record(tmp_path / "long.csv", seed=3, count=200)
    Path("model.toml").write_text('class = "OutputError"\nna = 1\nstable = true\n')
    return tmp_path


def write_record(path, seed, count=40):
    random = np.random.default_rng(seed)
    u = random.choice([-1.0, 1.0], count)
    w = np.zeros(count)
    for k in range(1, count):
        w[k] = 0.7 * w[k - 1] + 0.5 * u[k - 1]
    y = w + random.uniform(-0.1, 0.1, count)
    rows = [f"{0.1 * k:.1f},{u[k]},{y[k]:.6f}" for k in range(count)]
    path.write_text("\n".join(["# SIMULATED record, not a measurement.", "time [s],u [V],y [bar]", *rows]) + "\n")


@pytest.fixture
def smid():
    """Run a command line; arguments are split at blanks."""

    def run(line: str) -> Result:
        return CliRunner().invoke(main, line.split(), prog_name="smid")

    return run
