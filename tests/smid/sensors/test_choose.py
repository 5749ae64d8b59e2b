"""A sensor is chosen on the selection part, tested on the third part, and what was interrupted is kept."""

import os
import signal

import numpy as np
import pytest

from smid.data import DataError, Dataset
from smid.models import ModelError
from smid.sensors import train_sensor


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
    assert found.sensor.n_samples == found.test.scores[0].samples == 900
    assert found.candidates[0].selection < 0.0125  # the noise has 0.0115
    assert found.certified.lower < -0.9 < 0.9 < found.certified.upper


def test_what_is_too_large_is_not_tried():
    found = train_sensor(record(4, n=60), ["u"], "y", structures=["polynomial", "network"], starts=1)
    assert found.notes == ("not tried: network of u, with 31 parameters for 36 training samples",)


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
