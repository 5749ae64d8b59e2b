from pathlib import Path

import numpy as np
import pytest

from smid.data import RECORDS, DataError, Dataset, load_record

SHARED = Path(__file__).resolve().parents[4] / "shared" / "data"
needs_shared = pytest.mark.skipif(
    not SHARED.is_dir(),
    reason="shared/data is absent: the measured sets are not distributed with the package",
)
SIZES = {
    "daisy_hairdryer": [1000],
    "box_jenkins_gas_furnace": [296],
    "daisy_heating_system": [801],
    "daisy_cstr": [7500],
    "daisy_robot_arm": [1024],
    "ced_prbs": [500] * 3,
    "emps": [24841],
    "cascaded_tanks": [1024] * 2,
    "hydraulic_actuator": [1024],
    "mr_damper_labcontrol": [1501] * 10,
    "quarter_drone": [10000, 13001],
    "silverbox": [127400 - 40650, 40575 - 100],
}


def test_every_set_has_a_loader():
    assert set(RECORDS) == {*SIZES, "servo_rate_limit"}


@needs_shared
@pytest.mark.parametrize("name", SIZES)
def test_measured_set_loads(name):
    data = load_record(name, SHARED)
    assert [run.n_samples for run in data.experiments] == SIZES[name]
    assert data.source
    assert all(np.ptp(data.stacked(channel)) > 0 for channel in data.names)


@needs_shared
def test_servo_runs_end_where_the_command_ends():
    data = load_record("servo_rate_limit", SHARED)
    assert len(data.experiments) == 100
    assert {run.n_samples for run in data.experiments if run.name.startswith("drop")} == {10}


@needs_shared
def test_velocity_of_the_damper_is_the_derivative_of_its_displacement():
    run = load_record("mr_damper_labcontrol", SHARED).experiments[0].values
    slope = np.gradient(run["displacement"], 0.01)
    assert np.corrcoef(slope[1:-1], run["velocity"][1:-1])[0, 1] > 0.95


@needs_shared
def test_parts_of_the_silverbox_keep_the_time_of_the_record():
    data = load_record("silverbox", SHARED)
    assert data.n_init == 50
    assert data.time(0)[0] == pytest.approx(40650 * data.sampling_time)


@needs_shared
def test_jittered_stamps_in_milliseconds_are_resampled():
    data = Dataset.from_file(
        SHARED / "quarter_drone" / "dados_14_drone.csv",
        input="u_pct",
        output="angulo_deg",
        time="tempo_ms",
        units={"tempo_ms": "ms"},
    )
    (record,) = data.resampling
    assert record.method == "linear"
    assert data.sampling_time == pytest.approx(0.01)
    assert record.jitter_max == pytest.approx(0.004)
    assert set(record.curvature_error) == {"u_pct", "angulo_deg", "referencia"}


@needs_shared
def test_the_folder_of_the_set_itself_is_understood():
    assert load_record("daisy_hairdryer", SHARED / "daisy_hairdryer").n_samples == 1000


def test_a_changed_file_is_refused(tmp_path):
    (tmp_path / "dryer.dat").write_text("1 2\n3 4\n")
    with pytest.raises(DataError, match=r"dryer.dat has md5 .* download it again"):
        load_record("daisy_hairdryer", tmp_path)


def test_missing_file_and_unknown_set(tmp_path):
    with pytest.raises(DataError, match=r"give the folder that holds 'dryer.dat'"):
        load_record("daisy_hairdryer", tmp_path)
    with pytest.raises(DataError, match="did you mean 'silverbox'"):
        load_record("silver_box", tmp_path)
