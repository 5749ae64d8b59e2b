"""ARMAX models: the truth lies inside, scans with linear programs agree, and every path knows that y is read, too."""

import numpy as np
import pytest
from scipy.optimize import linprog
from scipy.signal import lfilter

from smid import (
    Armax,
    DataError,
    Dataset,
    ModelError,
    bind,
    fit,
    identify,
    load_model,
    residuals,
    save_model,
    validate,
    verify,
)

BOUND = 0.05
TRUTH = {"a1": -0.7, "b0": 1.0, "c1": 0.5}


def record(
    n: int, seed: int = 0, a: tuple[float, ...] = (-0.7,), b: tuple[float, ...] = (1.0,), c: tuple[float, ...] = (0.5,)
) -> Dataset:
    rng = np.random.default_rng(seed)
    u, e = rng.uniform(-1, 1, n), rng.uniform(-BOUND, BOUND, n)
    y = lfilter([0.0, *b], [1.0, *a], u) + lfilter([1.0, *c], [1.0, *a], e)
    return Dataset.from_arrays(input={"u": u}, output={"y": y}, sampling_time=1.0)


@pytest.mark.parametrize(
    ("a", "b", "c"),
    [
        ((-0.7,), (1.0,), (0.5,)),
        ((-1.1, 0.4), (1.0, 0.5), (-0.4,)),
        ((-0.7,), (1.0,), ()),
        ((0.3,), (0.4,), (0.5, 0.2)),
    ],
)
@pytest.mark.parametrize("seed", range(2))
def test_the_truth_lies_inside(seed: int, a: tuple[float, ...], b: tuple[float, ...], c: tuple[float, ...]) -> None:
    found = identify(Armax(len(a), len(b) - 1, len(c)), record(40, seed, a, b, c), BOUND, order=1, rounds=1)
    assert found.unbounded == ()
    for interval, true in zip(found.intervals, (*a, *b, *c), strict=True):
        assert interval.lower <= true <= interval.upper, interval.name
        assert interval.width < 0.6 or interval.name.startswith("c")


def ends_at(c: float, data: Dataset) -> np.ndarray:
    """Return the ranges of a1 and b0 at one c1, shape (2, 2): noises are affine in a1, b0 and e[0]. NaN if empty."""
    u, y = data.values("u"), data.values("y")
    past = lambda x: np.r_[0.0, x[:-1]]  # noqa: E731
    begin = np.eye(1, len(y))[0]
    drive = np.where(begin, 0.0, y)
    constant = lfilter([1.0], [1.0, c], drive)
    columns = np.stack([lfilter([1.0], [1.0, c], column) for column in (past(y), -past(u), begin)], axis=1)
    rows, limit = np.r_[columns, -columns], np.r_[BOUND - constant, BOUND + constant]
    found = np.full((2, 2), np.nan)
    for k in range(2):
        for side, sign in enumerate((1, -1)):
            end = linprog(sign * np.eye(3)[k], A_ub=rows, b_ub=limit, bounds=(None, None))
            if end.status == 0:
                found[k, side] = sign * end.fun
    return found


def test_a_scan_with_linear_programs_agrees() -> None:
    data = record(40)
    found = identify(Armax(), data, BOUND, tolerance=1e-3)
    c = found["c1"]
    scanned = np.array([ends_at(value, data) for value in np.linspace(c.lower, c.upper, 60)])
    for k, name in enumerate(("a1", "b0")):
        low, high = np.nanmin(scanned[:, k, 0]), np.nanmax(scanned[:, k, 1])
        assert found[name].lower <= low + 1e-9
        assert high - 1e-9 <= found[name].upper
        assert high - low > 0.99 * found[name].width
    # Just outside of the interval of c1 no a1 and b0 fit.
    for value in (c.lower - 0.02 * c.width, c.upper + 0.02 * c.width):
        assert np.isnan(ends_at(value, data)).all()


def test_a_long_record_goes_by_windows() -> None:
    found = identify(Armax(), record(2000), BOUND, tolerance=1e-2)
    assert found.windows
    assert sum(map(len, found.windows)) < 500
    for interval in found.intervals:
        assert interval.lower <= TRUTH[interval.name] <= interval.upper
        assert interval.gap <= 1e-2 * interval.width


def test_a_proof_is_verified(tmp_path) -> None:
    data, file = record(20), tmp_path / "proof.json"
    found = identify(Armax(), data, BOUND, order=1, rounds=1, certificate=file)
    assert verify(file, data, Armax(), BOUND).intervals == {i.name: (i.lower, i.upper) for i in found.intervals}


def test_fits_and_residuals_are_those_of_the_prediction() -> None:
    data = record(400)
    fitted = fit(Armax(), data)
    for name, true in TRUTH.items():
        assert fitted.model.values[name] == pytest.approx(true, abs=0.1)
    noise = BOUND / np.sqrt(3)
    assert validate(fitted.model, data).scores[0].rmse == pytest.approx(noise, rel=0.1)
    assert "white" in str(residuals(fitted.model, data))


def test_channels_of_other_names_and_model_files(tmp_path) -> None:
    data = record(30).rename({"u": "current", "y": "pressure"})
    bound = bind(Armax(), data)
    assert (bound.exogenous_channels, bound.output_channels) == (("current",), ("pressure",))
    assert bound == Armax(input="current", output="pressure")
    file = tmp_path / "model.toml"
    file.write_text('class = "Armax"\nna = 2\nnc = 2\nstable = true')
    assert load_model(file) == Armax(2, 0, 2, stable=True)
    assert load_model(save_model(Armax(), tmp_path / "own.toml")) == Armax()


def test_bad_orders_and_missing_outputs_are_refused() -> None:
    with pytest.raises(ModelError, match="nc = -1 is not a valid order"):
        Armax(nc=-1)
    data = record(30)
    y = data.values("y").copy()
    y[10] = np.nan
    gap = Dataset.from_arrays(input={"u": data.values("u")}, output={"y": y}, sampling_time=1.0)
    with pytest.raises(DataError, match="the model reads 'y' as an input, and 1 of its samples are missing"):
        identify(Armax(), gap, BOUND)
