"""Laws that are read from measured records, beside what is known of the rigs."""

from pathlib import Path

import numpy as np
import pytest

from benchmarks.unknown_laws import measured
from smid.data import load_record
from smid.hybrid import estimate, learned_law
from smid.signals import ModulatingFilter

SHARED = Path(__file__).resolve().parents[4] / "shared" / "data"
pytestmark = pytest.mark.skipif(
    not SHARED.is_dir(), reason="shared/data is absent: the measured sets are not distributed with the package"
)


def read(name):
    """Return a measured case, and the law that its network learned from the trained part."""
    case = next(case for case in measured(str(SHARED)) if case.name == name)
    used = [np.arange(case.data.n_samples) < case.trained * case.data.n_samples]
    found = estimate(case.hybrid, case.data, used, starts=3, seed=1)
    return case, found, learned_law(found)


def test_the_friction_of_a_drive_is_dry_and_drags_otherwise_in_each_direction():
    _, found, law = read("emps")
    # Published: 95.11 kg, 20.39 N, 203.5 N s/m.
    assert found.model.values["M"] == pytest.approx(95.11, rel=0.04)
    # Likelier by far is a friction that must be overcome first, by a little: sliding, it is the same.
    assert "stribeck_friction" in law.names
    assert law.best.values["N_sliding"] == pytest.approx(20.39, rel=0.07)
    assert 0 < law.best.values["N_extra"] < 0.1 * law.best.values["N_sliding"]
    assert law.ratio < 1.1
    ends = law.best(np.array([-0.12, -0.05, 0.05, 0.12]))
    onwards = (ends[3] - ends[2]) / 0.07, (ends[1] - ends[0]) / 0.07
    assert np.mean(onwards) == pytest.approx(203.5, rel=0.1)
    assert onwards[0] < onwards[1]
    # A method that integrates nothing finds the same: linear least squares of modulated signals.
    record = load_record("emps", SHARED)
    modulating = ModulatingFilter(3, 20)
    v, a = (modulating.derivative(record.values("position"), record.sampling_time, k) for k in (1, 2))
    force = 35.15 * modulating.derivative(record.values("controller_voltage"), record.sampling_time, 0)
    moving = np.abs(v) > 5e-3
    columns = np.column_stack([a, v, np.sign(v), np.ones(v.size), np.abs(v)])[moving]
    drag, turned = np.linalg.lstsq(columns, force[moving], rcond=None)[0][[1, 4]]
    assert onwards == pytest.approx((drag + turned, drag - turned), rel=0.1)


def test_two_laws_of_a_heat_exchanger_give_the_same_free_run():
    _, found, law = read("heat_exchanger")
    other = law.tried[1]
    assert law.best.merit - other.merit < 3.0
    assert "hardly tells" in law.notes[0]
    runs = [one.fit.simulated[0]["temperature"] for one in (law.best, other)]
    assert np.sqrt(np.mean((runs[0] - runs[1]) ** 2)) < 0.1 * found.rmse["temperature"]
