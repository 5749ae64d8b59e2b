"""Frames and arrays give the results of the data set that they stand for, or an error that lists what is needed."""

import numpy as np
import pandas as pd
import pytest

import smid
from smid import DataError, Dataset, OutputError
from smid.data import as_dataset

RNG = np.random.default_rng(0)
N = 60
U = RNG.choice([-1.0, 1.0], N)
Y = np.zeros(N)
for k in range(1, N):
    Y[k] = 0.7 * Y[k - 1] + 0.5 * U[k - 1]
Y += RNG.uniform(-0.1, 0.1, N)
DATA = Dataset.from_arrays(input={"u": U}, output={"y": Y}, sampling_time=0.1)
MODEL = OutputError(1, stable=True)
SECONDS = 0.1 * np.arange(N)
TANK = smid.OwnModel(["d/dt h = (k*u - h)/T"], {"y": "h"}, ["u"], {"k": (0, 9), "T": (0.1, 9)})


def frame(index):
    return pd.DataFrame({"y": Y, "u": U}, index=index)


FORMS = {
    "arrays": (U, Y, 0.1),
    "columns": (U[:, None], Y[:, None], np.float64(0.1)),
    "seconds": frame(SECONDS),
    "dates": frame(pd.date_range("2024-05-01", periods=N, freq="100ms", tz="Europe/Rome")),
    "durations": frame(pd.to_timedelta(SECONDS, unit="s")),
    "own times": frame(None).assign(time=SECONDS),
    "unit in the index": frame(pd.Index(1000 * SECONDS, name="t [ms]")),
    "its own frame": DATA.to_pandas(),
}


@pytest.mark.parametrize("form", FORMS)
def test_every_form_is_the_same_record(form):
    made = as_dataset(FORMS[form], MODEL)
    assert (made.inputs, made.outputs, made.sampling_time) == (("u",), ("y",), pytest.approx(0.1))
    np.testing.assert_array_equal(made.values("y"), Y)
    np.testing.assert_array_equal(made.values("u"), U)


def test_every_function_takes_it():
    model, given, data = MODEL.with_values({"a1": -0.7, "b0": 0.5}), FORMS["seconds"], DATA
    assert smid.fit(MODEL, given).parameters == smid.fit(MODEL, data).parameters
    assert smid.validate(model, given).scores == smid.validate(model, data).scores
    assert smid.compare([model], given).to_pandas().equals(smid.compare([model], data).to_pandas())
    assert smid.residuals(model, given).is_white == smid.residuals(model, data).is_white
    given, data = given[:12], DATA.crop(0, 12)
    assert smid.identify(MODEL, given, 0.12).intervals == smid.identify(MODEL, data, 0.12).intervals
    assert smid.error_bound(MODEL, given).upper == smid.error_bound(MODEL, data).upper
    assert smid.lowest_order([MODEL], given, 0.12).estimate.intervals == smid.identify(MODEL, data, 0.12).intervals
    loose = {"orders": [1], "tolerance": 0.5, "rounds": 1}
    known = smid.order_study(MODEL, data, 0.12, **loose)
    for one in (given, {"a": given}):
        found = smid.order_study(MODEL, one, 0.12, **loose)
        assert [o.intervals for o in found.outcomes] == [o.intervals for o in known.outcomes]
    with pytest.raises(DataError, match="too short for its parts"):
        smid.diagnose(MODEL, given)


def test_a_sampling_time_is_that_of_the_estimate_or_a_sample_counts_as_one_second():
    fitted = smid.fit(MODEL, DATA)
    for given in ((U, Y), frame(None)):
        assert smid.validate(fitted, given).data.sampling_time == 0.1
    alone = as_dataset((U, Y), MODEL)
    assert (alone.sampling_time, alone.source) == (1.0, "arrays without a sampling time: a sample counts as 1 s")


def test_several_channels_are_told_by_name_only():
    model = smid.OwnModel(["w[t] = a*u1[t-1] + b*u2[t-1]"], {"y": "w"}, ["u2", "u1"], {"a": (0, 9), "b": (0, 9)})
    made = as_dataset(({"u2": 2 * U, "u1": U}, Y, 1), model)
    np.testing.assert_array_equal(made.values("u2"), 2 * U)
    for given, words in (
        (np.stack([U, U], 1), "the model has 2 inputs, and u is an array without names: give u as {'u1': array, 'u2'"),
        ({"u1": U}, "u has the channels u1: give {'u1': array, 'u2': array}"),
    ):
        with pytest.raises(DataError, match=words):
            as_dataset((given, Y, 1), model)


@pytest.mark.parametrize(
    ("given", "model", "error", "words"),
    [
        (frame(None), MODEL, DataError, "has no times: give it a DatetimeIndex, an index of seconds or a column time"),
        (frame(np.arange(N)[::-1]), MODEL, DataError, "has no times"),
        (frame(SECONDS).rename(columns={"u": "valve"}), MODEL, DataError,
         "the model reads u, y, and the frame has no column 'u' .*'valve'.*from_pandas"),
        (frame(SECONDS), None, TypeError, "a DataFrame, not a Dataset: make one by Dataset.from_pandas"),
        ((U, Y), TANK, DataError, "has rates, and the arrays no sampling time"),
        ((U,), MODEL, DataError, "a tuple of 1: give"),
        ((U, Y, "0.1"), MODEL, DataError, "no sampling time in seconds"),
        ((U, Y[:-1], 0.1), MODEL, DataError, "differ in length"),
        ((np.stack([U, U]), Y, 0.1), MODEL, DataError, r"u has the shape \(2, 60\), and the model one input: give"),
        ((U, ["a"] * N), MODEL, DataError, "y is no array of numbers"),
        ((U, Y, -1), MODEL, DataError, "sampling_time = -1.0 is not positive"),
        ([U, Y], MODEL, TypeError, "the data are a list, not a Dataset"),
    ],
)  # fmt: skip
def test_what_cannot_be_told_is_refused_in_one_line(given, model, error, words):
    with pytest.raises(error, match=words) as told:
        as_dataset(given, model)
    assert "\n" not in str(told.value)


def test_xarray_has_the_samples_and_units():
    short = Dataset.from_arrays(input={"u": U[:40]}, output={"y": Y[:40]}, sampling_time=0.1, name="short")
    two = Dataset.merge([DATA, short])
    found = two.to_xarray()
    assert found.y.dims == ("experiment", "time")
    np.testing.assert_array_equal(found.y.sel(experiment="experiment"), Y)
    assert int(np.isnan(found.y).sum()) == 20
    assert found.time.units == "s"
