"""The error bound holds on the records it was found from, and promises what theory promises of others."""

from dataclasses import replace

import numpy as np
import pytest

from smid.data import DataError, Dataset
from smid.data.bundled import load_clutch
from smid.models import ModelError
from smid.sensors import CFPX, bound_error


def scattered(seed, n):
    """Independent samples of a curve whose noise grows with the position, some of it wild."""
    generator = np.random.default_rng(seed)
    pressure = generator.uniform(0, 10, n)
    noise = generator.standard_t(3, n) * (0.05 + 0.03 * pressure)
    return Dataset.from_arrays(input={"pressure": pressure}, output={"position": pressure + noise}, sampling_time=0.002)


@pytest.fixture(scope="module")
def sensor():
    return CFPX(2).fit(scattered(1, 500), seed=1)


@pytest.mark.parametrize("seed", range(5))
def test_the_bound_holds_on_its_own_records(sensor, seed):
    data = scattered(10 + seed, 400)
    assert bound_error(sensor, data, margin=0.0).predict(data).coverage(data) == {"experiment": 1.0}


def test_the_promise_of_the_scenario_bound(sensor):
    # 40 bounds of 300 samples each: on average at most m / (N + 1) of fresh samples may leave them.
    fresh = scattered(999, 20_000)
    bounds = [bound_error(sensor, scattered(100 + seed, 300), margin=0.0) for seed in range(40)]
    left = np.mean([1.0 - bound.predict(fresh).coverage(fresh)["experiment"] for bound in bounds])
    assert bounds[0].violation == pytest.approx(8 / 301)
    assert 0.001 < left < bounds[0].violation


def test_the_bound_is_narrow_where_the_noise_is_small(sensor):
    bound = bound_error(sensor, scattered(7, 3000), margin=0.0)
    said = bound.predict(scattered(8, 3000))
    width, position = said.upper[0] - said.lower[0], said.position[0]
    assert width[position < 2].mean() < 0.6 * width[position > 8].mean()


def test_no_constant_bound_is_narrower(sensor):
    data = scattered(9, 500)
    said = bound_error(sensor, data, margin=0.0).predict(data)
    constant = 2 * np.abs(np.concatenate(sensor.predict(data).residuals(data))).max()
    assert said.mean_width < constant


def test_a_margin_widens_in_proportion(sensor):
    data = scattered(9, 500)
    bound = bound_error(sensor, data, margin=0.0)
    wider = replace(bound, margin=0.5).predict(data)
    assert wider.mean_width == pytest.approx(1.5 * bound.predict(data).mean_width)


def test_warm_up_samples_do_not_count(sensor):
    data = scattered(11, 400)
    run = data.experiments[0]
    wild = run.values["position"].copy()
    wild[:50] += 100.0
    spoiled = data.with_experiments([replace(run, values={**run.values, "position": wild})]).with_n_init(50)
    bound = bound_error(sensor, spoiled, margin=0.0)
    assert bound.predict(spoiled).coverage(spoiled) == {"experiment": 1.0}
    assert bound.predict(spoiled).mean_width < 10
    assert bound.n_samples == 350


def test_bad_input(sensor):
    with pytest.raises(ModelError, match="margin = -1"):
        bound_error(sensor, scattered(1, 100), margin=-1)
    with pytest.raises(DataError, match="8 samples for a bound of 8 weights"):
        bound_error(sensor, scattered(1, 8))
    said = bound_error(sensor, scattered(1, 100)).predict(scattered(2, 100))
    with pytest.raises(DataError, match="not those of the prediction"):
        said.coverage(load_clutch("20C_step_a"))
