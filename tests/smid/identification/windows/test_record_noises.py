"""Noises of a whole record at fixed parameters: they solve the equations, and are within the bounds where any are."""

import numpy as np
import pytest
from scipy import sparse
from scipy.optimize import linprog

from smid import Dataset, OwnModel
from smid.feasible.template import Templates
from smid.fitting.binding import bind
from smid.identification.windows.record_noises import RecordNoises
from smid.identification.windows.whole_record import WholeRecord

N = 300
BOUNDS = {"zeta_u1": 0.05, "zeta_u2": 0.1, "eta_y1": 0.04, "eta_y2": 0.2}
TRUTH = {"a": -0.8, "b": 0.5, "c": 0.4, "d": 1.0}
MODEL = OwnModel(
    ["w1[t] = -a*w1[t-1] + b*u1[t] + 0.3*u2[t]", "w2[t] = -c*w2[t-2] + d*u2[t-1] - 0.2*w1[t-1]"],
    {"y1": {"signal": "w1", "noise": "eta_y1"}, "y2": {"signal": "w2", "noise": "eta_y2"}},
    {"u1": {"noise": "zeta_u1"}, "u2": {"noise": "zeta_u2"}},
    {name: [-2, 2] for name in TRUTH},
)


@pytest.fixture(scope="module")
def data() -> Dataset:
    rng = np.random.default_rng(3)
    u = np.repeat(rng.uniform(-1, 1, (2, N // 4)), 4, axis=1)
    w = np.zeros((2, N))
    for k in range(1, N):
        w[0, k] = 0.8 * w[0, k - 1] + 0.5 * u[0, k] + 0.3 * u[1, k]
        w[1, k] = -0.4 * w[1, k - 2] + u[1, k - 1] - 0.2 * w[0, k - 1]
    bounds = np.array([*BOUNDS.values()])[:, None]
    u1, u2, y1, y2 = np.concatenate([u, w]) + bounds * rng.uniform(-1, 1, (4, N))
    return Dataset.from_arrays(input={"u1": u1, "u2": u2}, output={"y1": y1, "y2": y2}, sampling_time=1.0)


def left(data: Dataset, values: dict[str, float], shares: np.ndarray) -> np.ndarray:
    """Return what both equations leave, written out once more by hand."""
    measured = np.array([data.values(channel) for channel in ("u1", "u2", "y1", "y2")])
    u1, u2, w1, w2 = measured - np.array([*BOUNDS.values()])[:, None] * shares
    a, b, c, d = values.values()
    return np.concatenate(
        [
            w1[1:] + a * w1[:-1] - b * u1[1:] - 0.3 * u2[1:],
            w2[2:] + c * w2[:-2] - d * u2[1:-1] + 0.2 * w1[1:-1],
        ]
    )


def least_stretch(data: Dataset, values: dict[str, float]) -> float:
    """Return by how much the noise bounds must be stretched, by one linear program."""
    constant = left(data, values, np.zeros((4, N)))
    units = np.eye(4 * N).reshape(4 * N, 4, N)
    matrix = np.array([left(data, values, unit) - constant for unit in units]).T
    within = sparse.hstack([sparse.vstack([sparse.eye(4 * N), -sparse.eye(4 * N)]), -np.ones((8 * N, 1))])
    equal = np.column_stack([matrix, np.zeros(len(matrix))])
    cost = np.eye(4 * N + 1)[-1]
    return linprog(cost, within.toarray(), np.zeros(8 * N), equal, -constant, (None, None), method="highs").fun


def last_pass(data: Dataset, values: dict[str, float]) -> np.ndarray:
    whole = WholeRecord(Templates.of(bind(MODEL, data)), data)
    return [*RecordNoises(whole.equations[0], values, BOUNDS, N).passes(200)][-1]


@pytest.mark.parametrize("moved", [0.0, 0.01, 0.06])
def test_noises_fit_where_a_linear_program_finds_any(data, moved):
    values = {name: value + moved for name, value in TRUTH.items()}
    shares, least = last_pass(data, values), least_stretch(data, values)
    assert np.abs(left(data, values, shares)).max() < 1e-12
    assert (np.abs(shares).max() <= 1) == (least <= 1)


def test_noises_stay_beyond_their_bounds_where_a_sample_objects(data):
    values = {channel: data.values(channel).copy() for channel in ("u1", "u2", "y1", "y2")}
    values["y2"][123] += 8 * BOUNDS["eta_y2"]
    changed = Dataset.from_arrays(
        input={c: values[c] for c in ("u1", "u2")}, output={c: values[c] for c in ("y1", "y2")}, sampling_time=1.0
    )
    largest = np.abs(last_pass(changed, TRUTH)).max(axis=0)
    assert largest.max() > 1
    assert abs(int(np.argmax(largest)) - 123) <= 4
