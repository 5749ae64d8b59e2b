"""Records of another package, by what they have: a stand-in with the same attributes, unpacking and slicing."""

import numpy as np
import pytest

from smid.data import DataError, Dataset


class Record:
    """As `nonlinear_benchmarks.utilities.Input_output_data` of version 1.0.1."""

    def __init__(self, u, y, sampling_time=None, name=None, state_initialization_window_length=None):
        self.u, self.y, self.sampling_time = u, y, sampling_time
        self.name = "" if name is None else name
        self.state_initialization_window_length = state_initialization_window_length

    def __iter__(self):
        yield self.u
        yield self.y

    def __len__(self):
        return len(self.y)

    def __getitem__(self, part):
        return (self.u, self.y)[part] if isinstance(part, int) else Record(self.u[part], self.y[part])


RNG = np.random.default_rng(3)
U, Y = RNG.normal(size=20), RNG.normal(size=20)


def test_one_record():
    data = Dataset.from_nonlinear_benchmarks(Record(U, Y, 0.1, "Cascaded tanks", 4))
    assert (data.inputs, data.outputs, data.sampling_time, data.n_init) == (("u",), ("y",), 0.1, 4)
    np.testing.assert_array_equal(data.values("u"), U)
    np.testing.assert_array_equal(data.values("y"), Y)
    assert "Cascaded tanks" in data.source


def test_columns_become_channels_and_a_column_of_one_does_not():
    data = Dataset.from_nonlinear_benchmarks(Record(np.stack([U, 2 * U], axis=1), Y[:, None], 0.1))
    assert data.names == ("u1", "u2", "y")
    np.testing.assert_array_equal(data.values("u2"), 2 * U)


def test_several_records_are_experiments():
    tests = (Record(U, Y, 1.0, "a", 5), Record(U[:12], Y[:12], 1.0, "b", 9), Record(U, Y, 1.0, "b"))
    data = Dataset.from_nonlinear_benchmarks([tests[0], tests[1:]])
    assert [run.name for run in data.experiments] == ["a", "b_2", "b_3"]
    assert [run.n_samples for run in data.experiments] == [20, 12, 20]
    assert data.n_init == 9


def test_a_sampling_time_may_be_given():
    part = Record(U, Y, None)[:10]
    assert Dataset.from_nonlinear_benchmarks(part, sampling_time=2.0).sampling_time == 2.0


@pytest.mark.parametrize(
    ("records", "message"),
    [
        (U, "ndarray is not a record of nonlinear_benchmarks: give an Input_output_data"),
        ((), "tuple is not a record"),
        ([Record(U, Y, 1.0), 3], "int is not a record"),
        (Record(U, Y), "sampling time is None: give one number"),
        ([Record(U, Y, 1.0), Record(U, Y, 2.0)], r"sampling time is 1\.0, 2\.0"),
        ([Record(U, Y, 1.0), Record(U, np.stack([Y, Y], axis=1), 1.0)], "different channels"),
        (Record(U, "nothing", 1.0), "y of the record is not an array of numbers"),
        (Record(U, np.zeros((0,)), 1.0), "y of the record has shape"),
        (Record(U, Y[:5], 1.0), "differ in length"),
    ],
)
def test_anything_else_is_refused(records, message):
    with pytest.raises(DataError, match=message):
        Dataset.from_nonlinear_benchmarks(records)
