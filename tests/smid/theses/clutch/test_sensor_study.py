"""The tables and figures of chapter 5 say on our records what the thesis says of its own."""

import numpy as np
import pytest

from smid.data.bundled import load_clutch
from smid.models import ModelError
from smid.sensors import CFPX, PTX
from smid.theses.clutch.sensor_study import (
    HELD_OUT,
    THESIS_FIGURES,
    THESIS_SENSORS,
    TRAINING,
    ErrorTable,
    cross_errors,
    interval_study,
    sensor_traces,
    single_sensor_study,
    table_5_1,
    table_5_2,
    table_5_3,
    table_5_4,
    train_thesis_sensors,
)


def test_training_and_held_out_records_are_apart():
    assert not set(TRAINING) & set(HELD_OUT)
    assert (
        {name.split("C_")[0] for name in TRAINING} == {name.split("C_")[0] for name in HELD_OUT} == {"20", "60", "m20"}
    )
    assert {"20C_step_b", "60C_step_c", "m20C_step_c"} <= set(HELD_OUT)


def test_more_neurons_serve_cpx_and_not_px():
    cpx, px = table_5_1(structures=[(2,), (10,)]), table_5_2(structures=[(2,), (10,)])
    assert cpx.rows[1].mse < 0.6 * cpx.rows[0].mse
    assert px.rows[1].mse > 0.9 * px.rows[0].mse
    assert [row.printed for row in cpx.rows] == [0.098, 0.016]
    assert str(cpx).splitlines()[0] == "Table 5.1: neurons of CPX, on m20C_step_a (simulated)."
    assert cpx.to_dict()["rows"][1]["parameters"] == 61


def test_tables_5_3_and_5_4():
    orders = table_5_3()
    errors = [row.mse for row in orders.rows]
    assert errors == sorted(errors, reverse=True)
    final = {row.name: row.mse for row in table_5_4().rows}
    assert final["CPX20"] < 0.1 * final["PX20"]
    assert final["CFPX20 without median"] == pytest.approx(final["PX20"], rel=0.1)


@pytest.fixture(scope="module")
def sensors():
    return train_thesis_sensors(("CPX20", "CPX60", "CPXm20"))


def test_a_cpx_fails_at_other_temperatures_and_with_hysteresis(sensors):
    records = ("20C_step_a", "60C_step_a", "m20C_step_a", "20C_step_b")
    errors = cross_errors(sensors, load_clutch(records)).rmse
    own = np.diag(errors[:3])
    assert (errors[:3][~np.eye(3, dtype=bool)] > 2 * own.max()).all()
    assert errors[3, 0] > 4 * own[0]
    with pytest.raises(ModelError, match="no sensor is given"):
        cross_errors({})


def test_every_figure_names_known_sensors_and_records(sensors):
    for number, (names, records) in THESIS_FIGURES.items():
        assert set(names) <= set(THESIS_SENSORS)
        assert load_clutch(records).n_samples == 5001 * len(records), number
    traces = sensor_traces("5.9", sensors)
    assert traces.measured.shape == traces.time.shape == traces.simulated["CPX20"].shape == (10002,)
    assert traces.rmse["CPX20"] > sensor_traces("5.2", sensors).rmse["CPX20"]
    with pytest.raises(ModelError, match=r"no figure '5\.1'"):
        sensor_traces("5.1")
    with pytest.raises(ModelError, match="no sensor 'CPX40'"):
        train_thesis_sensors(("CPX40",))


@pytest.mark.parametrize("number", ["5.9", "5.14"])
def test_figures_are_drawn(sensors, number):
    axes = sensor_traces(number, sensors).plot().axes
    assert axes[0].get_ylabel() == "position [mm]"


def test_what_is_more_runs_down():
    errors = ErrorTable("Errors.", ("A", "B"), ("first",), np.array([[0.1, 0.2]]))
    assert str(errors).splitlines() == ["Errors.", "sensor  first", "A       0.100", "B       0.200"]
    assert [label.get_text() for label in errors.plot().axes[0].get_yticklabels()] == ["A", "B"]


def test_a_drawn_line_has_few_points_and_every_peak(sensors):
    traces = sensor_traces("5.9", sensors)
    (line,) = traces.plot().axes[1].lines
    error = traces.measured - traces.simulated["CPX20"]
    time, drawn = line.get_data()
    assert drawn.size < 600 < error.size
    assert (drawn.min(), drawn.max()) == (error.min(), error.max())
    np.testing.assert_array_equal(drawn, error[np.searchsorted(traces.time, time)])


def test_one_sensor_beside_its_rivals(monkeypatch):
    # Small rivals suffice to see that the table is made as it says; its numbers are for the benchmark.
    from smid.sensors import CPX
    from smid.theses.clutch.sensor_study import single_sensor

    monkeypatch.setattr(single_sensor, "CPX", lambda: CPX(hidden=(2,)))
    sensor = PTX(hidden=(2,), plays=1).fit(load_clutch(TRAINING).crop(1000, 2000), seed=1, starts=1)
    study = single_sensor_study(sensor)
    assert study.held_out.records == HELD_OUT
    assert study.held_out.sensors[-1] == "PTX"
    for name, row in zip(HELD_OUT, study.held_out.rmse, strict=True):
        data = load_clutch(name)
        assert row[-1] == pytest.approx(sensor.predict(data).rmse(data)[name])
        assert study.advantage[name] == pytest.approx(row[:-1].min() / row[-1])
    assert "14 parameters" in study.conclusion
    assert study.plot().axes


def test_intervals_of_left_out_records():
    sensor = CFPX(10).fit(load_clutch("20C_ramp_a"), seed=1)
    study = interval_study(sensor, ["20C_ramp_b", "20C_step_b"])
    widths = [row.mean_width for row in study.rows if row.record == "20C_step_b"]
    covered = [row.coverage for row in study.rows if row.record == "20C_step_b"]
    assert widths == sorted(widths)
    assert covered == sorted(covered)
    assert study.plot().axes
    assert "left out" in str(study)
    assert study.to_dict()["margin"] == study.sensor.margin
