"""White residuals pass and keep the band; a colour, a missing dynamic and feedback are told."""

import numpy as np
import pytest
from scipy.signal import lfilter

from smid import DataError, Dataset, ModelError, OutputError, Residuals, residuals
from smid.signals import delay_estimate
from smid.validation.correlation import Correlation

MODEL = OutputError(1).with_values({"a1": -0.8, "b0": 0.4})


def record(noise: np.ndarray, seed: int = 0, pole: float = 0.8) -> Dataset:
    n = noise.size
    u = np.repeat(np.random.default_rng(1000 + seed).uniform(-1, 1, n), 3)[:n]
    w = lfilter([0, 2 * (1 - pole)], [1, -pole], u)
    return Dataset.from_arrays(input={"u": u}, output={"y": w + noise}, sampling_time=0.1, units={"y": "bar"})


def white(seed: int, n: int = 500) -> np.ndarray:
    noise = 0.1 * np.random.default_rng(seed).standard_normal(n)
    noise[0] = 0.0  # the free run starts from the first measured output
    return noise


def of(noise: np.ndarray, **settings: float) -> Residuals:
    return residuals(MODEL, record(noise, **settings))


def test_white_noise_keeps_the_bands_and_passes() -> None:
    found = [of(white(seed), seed=seed).outputs[0] for seed in range(100)]
    assert np.mean([one.own.outside.mean() for one in found]) == pytest.approx(0.01, abs=0.005)
    assert np.mean([one.with_inputs[0].outside.mean() for one in found]) == pytest.approx(0.01, abs=0.005)
    # Each test fails for one record in a hundred at most.
    assert sum(not one.is_white for one in found) <= 3
    assert sum(bool(one.depends_on) for one in found) <= 3


def test_many_small_correlations_are_not_white_either() -> None:
    """None is large, but four lags are just outside the band: chance gives that in 1 of 10,000 records."""
    values = np.full(25, 0.01)
    values[[2, 7, 11, 20]] = 0.14
    assert Correlation("", np.arange(1, 26), values, 0.13).chance < 0.001
    values[[2, 7, 11]] = 0.01
    assert Correlation("", np.arange(1, 26), values, 0.13).chance > 0.1


@pytest.mark.parametrize("seed", range(5))
def test_coloured_noise_is_not_white_but_independent_of_the_input(seed: int) -> None:
    found = of(lfilter([1], [1, -0.7], white(seed)), seed=seed)
    assert not found.is_white
    assert not found.outputs[0].is_white
    assert found.outputs[0].depends_on == ()
    assert found.outputs[0].own.values[0] == pytest.approx(0.7, abs=0.1)
    assert "The residual is not white" in str(found)


def test_a_wrong_pole_is_told_as_dependence_on_the_input() -> None:
    found = of(white(0), pole=0.9)
    assert found.outputs[0].depends_on == ("u",)
    assert "It depends on u, which the model does not explain" in str(found)
    assert found.spectrum.coherence["u", "y"][0] > found.spectrum.level


def test_an_input_that_follows_the_error_is_told_as_feedback() -> None:
    noise = white(0)
    u = 0.1 * np.random.default_rng(1).standard_normal(500) - np.concatenate([np.zeros(2), noise[:-2]])
    y = lfilter([0, 0.4], [1, -0.8], u) + noise
    data = Dataset.from_arrays(input={"u": u}, output={"y": y}, sampling_time=0.1)
    assert "It is followed by u, which is feedback" in str(residuals(MODEL, data))


def test_mean_size_and_warm_up_are_those_of_the_residual() -> None:
    noise = white(0) + 0.3
    noise[0] = 0.0
    found = residuals(MODEL, record(noise).with_n_init(20))
    one = found.outputs[0]
    assert one.samples == 480
    assert one.mean == pytest.approx(noise[20:].mean())
    assert one.rmse == pytest.approx(np.sqrt(np.mean(noise[20:] ** 2)))
    np.testing.assert_allclose(found.errors.values("y"), noise[20:], atol=1e-12)
    assert found.errors.time()[0] == pytest.approx(2.0)
    assert len(found.to_pandas()) == len(found.table.rows) == 2


def test_experiments_are_not_joined() -> None:
    parts = [record(white(seed, 60), seed).experiments[0] for seed in range(3)]
    runs = [type(run)(f"part {k}", run.values) for k, run in enumerate(parts)]
    found = residuals(MODEL, record(white(0, 60)).with_experiments(runs))
    assert found.outputs[0].samples == 177
    assert len(found.errors.experiments) == 3
    assert found.plot().axes


@pytest.mark.parametrize(
    ("data", "error", "words"),
    [
        (record(white(0, 30)), DataError, "has 29 samples after the warm-up: its tests need 40"),
        (record(np.zeros(100)), DataError, "is constant, as of a record without noise or of a constant output"),
        (Dataset.from_arrays(input={"u": np.zeros(99)}, output={"y": np.zeros(99)}, sampling_time=1), DataError,
         "is constant, as of a record without noise or of a constant output"),
        (Dataset.from_arrays(input={"a": white(0), "b": white(1)}, output={"y": white(2)}, sampling_time=1), ModelError,
         "the data lack the channel 'u': they have a, b, y"),
        (np.zeros(99), TypeError, "the data are a ndarray, not a Dataset"),
    ],
)  # fmt: skip
def test_a_mistake_is_told_in_one_line(data: Dataset, error: type[Exception], words: str) -> None:
    with pytest.raises(error, match=words) as told:
        residuals(MODEL, data)
    assert "\n" not in str(told.value)


def test_missing_outputs_are_not_scored_and_leave_the_tests_as_they_are():
    random = np.random.default_rng(4)
    u, w = random.normal(size=600), np.zeros(600)
    for k in range(1, 600):
        w[k] = 0.8 * w[k - 1] + u[k - 1]
    y = w + random.normal(size=600)
    whole = Dataset.from_arrays(input={"u": u}, output={"y": y}, sampling_time=1.0)
    y[[100, 101, 350]] = np.nan
    gappy = Dataset.from_arrays(input={"u": u}, output={"y": y}, sampling_time=1.0)
    model = OutputError().with_values({"a1": -0.8, "b0": 1.0})
    found, other = residuals(model, gappy), residuals(model, whole)
    assert found.outputs[0].samples == other.outputs[0].samples - 3
    assert found.is_white
    assert np.abs(found.outputs[0].own.values - other.outputs[0].own.values).max() < 0.05
    assert delay_estimate(gappy).samples == delay_estimate(whole).samples == 1
    level = float(np.nanmean(y))
    assert np.nanmax(np.abs(gappy.detrend().values("y") - (y - level))) < 1e-9
    with pytest.raises(DataError, match="missing, and the filter would read them"):
        gappy.filter(below=0.1)


def test_a_record_without_noise_has_nothing_to_test_also_where_samples_are_missing():
    data = record(1e-16 * white(0))
    u, y = data.values("u"), data.values("y").copy()
    y[100] = np.nan
    gappy = Dataset.from_arrays(input={"u": u}, output={"y": y}, sampling_time=0.1)
    for one in (data, gappy):
        with pytest.raises(DataError, match="there is nothing to test"):
            residuals(MODEL, one)
