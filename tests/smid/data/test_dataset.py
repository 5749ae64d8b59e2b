import json
import pickle
import sys
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from smid.data import Channel, DataError, Dataset, Experiment, Resampling

finite = st.floats(-1e6, 1e6, allow_subnormal=False)


def two_runs(n_init=0):
    t = np.arange(40.0)
    return Dataset(
        experiments=(
            Experiment("a", {"u": np.sin(t), "y": np.cos(t), "T": 20 + t}),
            Experiment("b", {"u": -np.sin(t[:30]), "y": t[:30], "T": 30 - t[:30]}, start_time=2.0),
        ),
        channels=(Channel("u", "A"), Channel("y", "bar"), Channel("T", "degC")),
        inputs=("u",),
        outputs=("y",),
        sampling_time=0.5,
        n_init=n_init,
    )


def test_shape_and_roles():
    data = two_runs()
    assert (data.input, data.output, data.n_samples) == ("u", "y", 70)
    assert [data.role(name) for name in data.names] == ["input", "output", ""]
    assert data.time(1)[:2].tolist() == [2.0, 2.5]
    assert data.channel("T").unit == "degC"


def test_samples_cannot_be_changed_and_are_copied():
    u = np.zeros(3)
    data = Dataset.from_arrays(input=u, output=[1, 2, 3], sampling_time=1)
    u[0] = 7
    assert data.values("input")[0] == 0
    with pytest.raises(ValueError, match="read-only"):
        data.values("input")[0] = 1
    with pytest.raises(TypeError):
        data.experiments[0].values["input"] = u


@pytest.mark.parametrize("copy", [lambda d: pickle.loads(pickle.dumps(d)), lambda d: d.from_dict(d.to_dict())])
def test_copies_are_equal_and_read_only(copy):
    data = two_runs(n_init=3).normalise()
    again = copy(data)
    assert again == data
    assert hash(again) == hash(data)
    assert not again.values("u").flags.writeable


def test_dictionary_survives_json_and_refuses_changed_numbers():
    record = json.loads(json.dumps(two_runs().to_dict()))
    assert Dataset.from_dict(record) == two_runs()
    record["experiments"][0]["values"]["u"][0] += 1e-9
    with pytest.raises(DataError, match="checksum"):
        Dataset.from_dict(record)


def test_checksum_depends_on_numbers_names_and_sampling_time_only():
    data = two_runs()
    assert data.checksum == replace(data, source="elsewhere", n_init=2).checksum
    assert data.checksum == replace(data, channels=data.channels[::-1]).checksum
    assert data.checksum != replace(data, sampling_time=0.25).checksum
    assert data.checksum != data.crop(0, 29).checksum
    renamed = (replace(data.experiments[0], name="c"), data.experiments[1])
    assert data.checksum != data.with_experiments(renamed).checksum
    assert len(data.checksum) == 64


@pytest.mark.parametrize("bad", [np.inf, -np.inf])
def test_sample_that_is_not_finite_is_located(bad):
    with pytest.raises(DataError, match=r"'output' of experiment 'run' is .* at sample 2 \(t = 0.2 s\)"):
        Dataset.from_arrays(input=[0, 1, 2, 3], output=[0, 1, bad, 3], sampling_time=0.1, name="run")


@pytest.mark.parametrize("sampling_time", [0, -1, np.nan, np.inf])
def test_sampling_time_must_be_positive(sampling_time):
    with pytest.raises(DataError, match="not positive"):
        Dataset.from_arrays(input=[0, 1], output=[0, 1], sampling_time=sampling_time)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"inputs": ("v",)}, "'v' is not a channel; choose among 'u', 'y', 'T'"),
        ({"outputs": ()}, "no output is named"),
        ({"outputs": ("u",)}, "'u' occurs 2 times"),
        ({"channels": (Channel("u"), Channel("u"), Channel("y"))}, "channel 'u' occurs 2 times"),
        ({"channels": (Channel("u"), Channel("y"))}, "'T' that the data set does not list"),
        (
            {"channels": (Channel("u"), Channel("y"), Channel("T"), Channel("Y2"))},
            "has no channel 'Y2'; did you mean",
        ),
        ({"experiments": ()}, "no experiments"),
        ({"n_init": 30}, "leaves no sample of experiment 'b'"),
        ({"n_init": -1}, "leaves no sample"),
        ({"resampling": (Resampling("none", 1, 0, 0, 9),)}, "1 resampling records for 2"),
    ],
)
def test_inconsistent_parts_are_refused(change, message):
    with pytest.raises(DataError, match=message):
        replace(two_runs(), **change)


def test_equal_experiment_names_are_refused():
    run = two_runs().experiments[0]
    with pytest.raises(DataError, match="experiment 'a' occurs 2 times"):
        two_runs().with_experiments([run, run])


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"u": [1, 2], "y": [1]}, "differ in length"),
        ({"u": [[1, 2]]}, "shape"),
        ({"u": ["a"]}, "not a vector of real numbers"),
        ({"u": []}, "has no samples"),
        ({}, "has no samples"),
    ],
)
def test_bad_experiments_are_refused(values, message):
    with pytest.raises(DataError, match=message):
        Experiment("run", values)


def test_arrays_with_names_units_and_several_inputs():
    data = Dataset.from_arrays(
        input={"u1": [0, 1], "u2": [1, 0]},
        output={"y": [2, 3]},
        sampling_time=1,
        units={"y": "bar"},
        T=[4, 5],
    )
    assert data.inputs == ("u1", "u2")
    assert data.channel("y").unit == "bar"
    with pytest.raises(DataError, match=r"2 inputs \(u1, u2\)"):
        _ = data.input
    with pytest.raises(DataError, match="a unit is given for 'z'"):
        Dataset.from_arrays(input=[0], output=[0], sampling_time=1, units={"z": "m"})
    with pytest.raises(DataError, match="'y' occurs 2 times"):
        Dataset.from_arrays(input={"y": [0]}, output={"y": [0]}, sampling_time=1)


@settings(deadline=None, max_examples=50)
@given(st.integers(2, 60), st.floats(0.01, 0.99))
def test_split_sizes_add_up(n, fraction):
    data = Dataset.from_arrays(input=np.arange(n), output=np.arange(n), sampling_time=0.1)
    if not 0 < round(fraction * n) < n:
        with pytest.raises(DataError, match="empty"):
            data.split(fraction)
        return
    head, tail = data.split(fraction)
    assert head.n_samples + tail.n_samples == n
    assert np.array_equal(np.r_[head.values("input"), tail.values("input")], data.values("input"))
    assert tail.time()[0] == pytest.approx(head.time()[-1] + 0.1)


@pytest.mark.parametrize("fraction", [0, 1, -0.5, 2, np.nan])
def test_split_refuses_fractions_outside(fraction):
    with pytest.raises(DataError, match="strictly between 0 and 1"):
        two_runs().split(fraction)


def test_crop_counts_samples_and_crop_time_seconds():
    data = two_runs()
    assert np.array_equal(data.crop(2, -1).values("u", 1), data.values("u", 1)[2:-1])
    timed = data.crop_time(3.0, 5.0)
    assert timed.time(0).tolist() == timed.time(1).tolist() == [3.0, 3.5, 4.0, 4.5]
    assert np.array_equal(timed.values("T", 0), data.values("T", 0)[6:10])
    with pytest.raises(DataError, match="use crop_time for seconds"):
        data.crop(1.5)
    with pytest.raises(DataError, match="has no samples"):
        data.crop_time(1e6)


def test_crop_time_is_not_fooled_by_rounding():
    data = Dataset.from_arrays(input=np.arange(20), output=np.arange(20), sampling_time=0.1)
    assert data.crop_time(0.3, 0.7).values("input").tolist() == [3, 4, 5, 6]


@settings(deadline=None, max_examples=50)
@given(arrays(float, st.integers(1, 40), elements=finite), st.sampled_from(["unit", "share", "standard"]))
def test_normalise_and_back(y, method):
    data = Dataset.from_arrays(input=np.arange(y.size), output=y, sampling_time=1, units={"output": "bar"})
    normalised = data.normalise(method)
    assert normalised.channel("output").unit == ""
    assert np.max(np.abs(normalised.values("output"))) <= max(1.0, np.sqrt(y.size)) * (1 + 1e-9) + (
        0 if np.ptp(y) else 1e-9
    )
    back = normalised.denormalise()
    assert back.channels == data.channels
    assert back.normalisation is None
    np.testing.assert_allclose(back.values("output"), y, rtol=0, atol=1e-12 * max(1, np.max(np.abs(y))))


def test_standard_normalisation_takes_all_experiments_together():
    data = two_runs().normalise("standard")
    assert data.stacked("T").mean() == pytest.approx(0, abs=1e-12)
    assert data.stacked("T").std() == pytest.approx(1)


def test_validation_data_take_the_normalisation_of_the_identification_data():
    head, tail = two_runs().split(0.5)
    record = head.normalise().normalisation
    assert tail.normalise(record).normalisation == record
    np.testing.assert_allclose(tail.normalise(record).denormalise().stacked("u"), tail.stacked("u"))


def test_normalisation_misuse():
    data = two_runs()
    with pytest.raises(DataError, match="normalised already"):
        data.normalise().normalise()
    with pytest.raises(DataError, match="not normalised"):
        data.denormalise()
    with pytest.raises(DataError, match="choose 'unit', 'share' or 'standard'"):
        data.normalise("minmax")


def test_decimate_without_filter_keeps_samples():
    data = two_runs(n_init=5)
    thin = data.decimate(3, antialias=False)
    assert np.array_equal(thin.values("u"), data.values("u")[::3])
    assert (thin.sampling_time, thin.n_init) == (1.5, 2)
    assert data.decimate(1) is data


@pytest.mark.parametrize("n", [1, 2, 7, 100, 101])
def test_antialias_filter_keeps_straight_lines_up_to_the_ends(n):
    line = 3.0 + 0.25 * np.arange(n)
    thin = Dataset.from_arrays(input=line, output=line, sampling_time=1).decimate(4)
    np.testing.assert_allclose(thin.values("input"), line[::4], rtol=1e-9)


def test_antialias_filter_removes_what_would_fold():
    t = np.arange(400)
    fast, slow = np.cos(0.9 * np.pi * t), np.cos(0.02 * np.pi * t)
    thin = Dataset.from_arrays(input=fast, output=slow, sampling_time=1).decimate(5)
    inner = slice(8, -8)
    assert np.max(np.abs(thin.values("input")[inner])) < 1e-2
    np.testing.assert_allclose(thin.values("output")[inner], slow[::5][inner], atol=1e-2)


def test_a_held_channel_acts_by_as_much_when_thinned():
    rng = np.random.default_rng(4)
    force = rng.standard_normal(47)
    speed = np.concatenate([[0.0], np.cumsum(force)[:-1]])
    thin = Dataset.from_arrays(input=force, output=speed, sampling_time=0.5).decimate(5, antialias=False, held="input")
    # A thinned force, held five times as long, takes the speed from one kept sample to the next.
    np.testing.assert_allclose(np.diff(thin.values("output")), 5 * thin.values("input")[:-1], atol=1e-12)
    assert thin.values("input")[-1] == pytest.approx(force[45:].mean())
    assert thin.source == "decimated by 5 (no filter, means of input)"


def test_decimate_refuses_a_held_channel_that_is_not_there():
    with pytest.raises(DataError, match="steer"):
        two_runs().decimate(2, held=["steer"])


@pytest.mark.parametrize("factor", [0, -2, 1.5])
def test_decimate_refuses_bad_factors(factor):
    with pytest.raises(DataError, match="an integer from 1 on"):
        two_runs().decimate(factor)


def test_select_and_merge():
    data = two_runs()
    assert Dataset.merge([data.select("a"), data.select(["b"])]) == data
    assert [run.name for run in data.select(["b", "a"]).experiments] == ["b", "a"]
    with pytest.raises(DataError, match="no experiment 'c'"):
        data.select("c")
    with pytest.raises(DataError, match="differ in their sampling time"):
        Dataset.merge([data, replace(data, sampling_time=1.0)])
    with pytest.raises(DataError, match="at least one"):
        Dataset.merge([])


def test_merge_fills_missing_resampling_records():
    a, b = two_runs().select("a"), two_runs().select("b")
    resampled = replace(a, resampling=(Resampling("linear", 0.5, 0.1, 0.05, 44, {"u": 0.1}),))
    merged = Dataset.merge([resampled, b])
    assert [record.method for record in merged.resampling] == ["linear", "none"]
    assert merged.select("a") == resampled
    assert "interpolation error: u 0.1" in str(merged)


def test_listing_shows_units_roles_and_escapes_html():
    data = Dataset.from_arrays(
        input={"<u>": [0, 1]}, output={"y": [2, 4]}, sampling_time=0.1, units={"y": "bar"}
    ).with_n_init(1)
    text = str(data)
    assert "sampling time 0.1 s, 1 warm-up samples" in text
    assert "y        bar   output    2    4     3" in text
    assert "&lt;u&gt;" in data._repr_html_()
    assert "<u>" not in data._repr_html_()
    assert repr(data).startswith("<Dataset: 1 experiment")
    assert "normalised (unit)" in str(data.normalise())


def test_plot_has_an_axis_with_unit_per_channel():
    figure = two_runs(n_init=2).plot()
    assert [axis.get_ylabel() for axis in figure.axes] == ["y [bar]", "u [A]", "T [degC]"]
    assert figure.axes[-1].get_xlabel() == "time [s]"
    figure.canvas.draw()
    assert "matplotlib.pyplot" not in sys.modules or not sys.modules["matplotlib.pyplot"].get_fignums()


def test_pandas_round_trip():
    data = two_runs()
    assert data.to_pandas().loc["b"]["T"].iloc[1] == 29
    one = data.select("b")
    units = {channel.name: channel.unit for channel in one.channels}
    again = Dataset.from_pandas(one.to_pandas(), "u", "y", units=units, name="b")
    assert replace(again, resampling=(), source="") == one
