"""A sensor is chosen on the selection part, tested on the third part, and what was interrupted is kept."""

import os
import signal
from dataclasses import replace

import numpy as np
import pytest

from smid.data import DataError, Dataset
from smid.models import ModelError
from smid.sensors import CFPX, CPX, PTX, PX, DeadZone, train_sensor


def record(seed, n=900, extra=0.0):
    """A static curve of a slow random input; ``extra`` bends the last fifth."""
    generator = np.random.default_rng(seed)
    u = np.interp(np.arange(n), np.arange(0, n + 15, 15), generator.uniform(-1, 1, n // 15 + 1))
    y = np.tanh(3 * u) + generator.uniform(-0.02, 0.02, n) + extra * (np.arange(n) >= 0.8 * n)
    return Dataset.from_arrays(input={"u": u}, output={"y": y}, sampling_time=0.1, units={"u": "V", "y": "mm"})


def test_the_test_part_decides_nothing():
    found, other = (train_sensor(record(1, extra=e), ["u"], "y", structures=["polynomial"]) for e in (0.0, 5.0))
    assert [(c.name, c.selection) for c in found.candidates] == [(c.name, c.selection) for c in other.candidates]
    assert found.sensor.weights.tolist() == other.sensor.weights.tolist()
    assert found.test.scores[0].coverage > 0.95
    assert other.test.scores[0].coverage == 0.0
    assert found.candidates[0].selection == min(c.selection for c in found.candidates)
    assert found.test.scores[0].samples == 180


def test_other_records_for_selection_and_test():
    found = train_sensor(
        record(1), ["u"], "y", selection=record(2), test=record(3), structures=["polynomial", "delays"], starts=1
    )
    assert found.sensor.n_samples == 810  # the first tenth is run over
    assert found.test.scores[0].samples == 900
    assert found.candidates[0].selection < 0.0125  # the noise has 0.0115
    assert found.certified.lower < -0.9 < 0.9 < found.certified.upper


def test_of_several_starts_the_best_on_the_selection_part_is_kept():
    one, several = (train_sensor(record(6), ["u"], "y", structures=["network"], starts=n) for n in (1, 4))
    assert several.candidates[0].selection < one.candidates[0].selection  # the first start is the same
    assert len(several.candidates) == len(one.candidates)


def test_a_plant_that_is_not_at_rest_where_its_record_begins():
    generator = np.random.default_rng(0)
    u = np.repeat(generator.uniform(2, 12, 40), 30) + generator.normal(0, 0.02, 1200)
    y = np.zeros(1200)
    for k in range(1, 1200):
        y[k] = 0.9 * y[k - 1] + 0.5 * np.tanh(u[k - 1] / 5)
    data = Dataset.from_arrays(
        input={"u": u}, output={"y": y + generator.uniform(-0.01, 0.01, 1200)}, sampling_time=2e-3
    )
    found = train_sensor(data, ["u"], "y", structures=["hysteresis"])
    assert found.test.scores[0].rmse < 0.05  # 1 % of the range; a fit to the start of the record, too, left 0.08


@pytest.mark.parametrize(
    "sensor",
    [
        CFPX(5, pressure="u", output="y"),
        PX((3,), pressure="u", output="y"),
        CPX((3,), inputs=("u",), output="y"),
        PTX((3,), 1, pressure="u", temperature=None, output="y"),
        DeadZone(CFPX(5, pressure="u", output="y"), "u"),
    ],
    ids=lambda sensor: type(sensor).__name__,
)
def test_no_sensor_is_fitted_to_the_warm_up(sensor):
    data = record(7, n=300).with_n_init(50)
    run = data.experiments[0]
    turned = np.concatenate([run.values["y"][:50][::-1], run.values["y"][50:]])
    other = data.with_experiments([replace(run, values={**run.values, "y": turned})])
    first, second = (sensor.fit(d, seed=1, starts=1).predict(data).position[0] for d in (data, other))
    assert first.tolist() == second.tolist()


def test_what_is_too_large_is_not_tried():
    found = train_sensor(record(4, n=60), ["u"], "y", structures=["polynomial", "network"], starts=1)
    assert found.notes == ("not tried: network of u, with 31 parameters for 33 training samples",)


def test_an_interrupt_keeps_the_structures_so_far():
    seen = []

    def interrupt(line):
        if line.startswith("4 of 5") and not seen:
            seen.append(line)
            os.kill(os.getpid(), signal.SIGINT)

    found = train_sensor(record(5), ["u"], "y", structures=["polynomial", "hysteresis"], starts=2, progress=interrupt)
    assert seen
    assert found.notes == ("interrupted at hysteresis of u, 1 play, structure 4 of 5: the others were not tried",)
    assert {c.name for c in found.candidates} >= {"polynomial of order 5 in u", "hysteresis of u, 1 play"}
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


def test_bad_input():
    with pytest.raises(ModelError, match="no structure 'netwrk'; did you mean 'network'"):
        train_sensor(record(1), ["u"], "y", structures=["netwrk"])
    with pytest.raises(ModelError, match="channels y: give an input at least, and each channel once"):
        train_sensor(record(1), [], "y")
    with pytest.raises(DataError, match="no channel 'v'"):
        train_sensor(record(1), ["v"], "y")
    with pytest.raises(DataError, match="31 parameters for 6 training samples: give more samples, or fewer inputs"):
        train_sensor(record(1, n=30).crop(0, 10), ["u"], "y", structures=["network"])
