"""Intervals by inversion: the truth lies inside, other methods agree, and an empty set is proven."""

import numpy as np
import pytest

from smid import Dataset, EmptyFeasibleSetError, ModelError, OutputError, OwnModel, identify
from smid.data.window import Window
from smid.diagnosis.proof.decide import Status, decide
from smid.identification.inversion.contraction import Program
from smid.identification.inversion.frame import Frame, static_curves
from smid.identification.inversion.record import Record
from smid.models.running import at_sampling_time
from smid.models.simulate import simulate

N = 60
# Equations, boxes and truth, and the box of a hidden state.
PLANTS = {
    "tank": (["d/dt h = k*u - c*sqrt(h)"], {"k": (0, 2), "c": (0, 3)}, {"k": 0.3, "c": 0.4}, {}),
    "power": (
        ["h[t] = a*h[t-1] + b*u[t-1]**p"],
        {"a": (0, 1), "b": (0, 5), "p": (0.2, 3)},
        {"a": 0.7, "b": 0.5, "p": 1.4},
        {},
    ),
    "pendulum": (
        ["d/dt h = v", "d/dt v = b*u - g*sin(h) - d*v"],
        {"b": (0, 5), "g": (0, 10), "d": (0, 3)},
        {"b": 1.0, "g": 4.0, "d": 0.5},
        {"v": (-5, 5)},
    ),
    "friction": (["d/dt h = b*u - f*tanh(h/0.1)"], {"b": (0, 5), "f": (0, 2)}, {"b": 1.0, "f": 0.3}, {}),
    "dead zone": (
        ["h[t] = a*h[t-1] + b*Max(u[t-1] - s, 0)"],
        {"a": (0, 1), "b": (0, 5), "s": (0, 3)},
        {"a": 0.7, "b": 0.5, "s": 1.0},
        {},
    ),
}


def record(model, truth, bound, seed, spoilt=0.0):
    rng = np.random.default_rng(seed)
    u = np.repeat(rng.uniform(0.5, 3, N // 5), 5)
    clean = simulate(at_sampling_time(model, 0.2), {"u": u}, truth, {"h": np.ones(3)})["y"]
    y = clean + rng.uniform(-bound, bound, N)
    y[33] += spoilt
    return Dataset.from_arrays(input={"u": u}, output={"y": y}, sampling_time=0.2)


@pytest.mark.parametrize("name", PLANTS)
def test_the_truth_lies_inside_and_every_end_is_met(name):
    equations, boxes, truth, hidden = PLANTS[name]
    model = OwnModel(equations, {"y": "h"}, ["u"], boxes).bound(**hidden)
    data = record(model, truth, 0.02, 3)
    found = identify(model, data, 0.02, method="inversion", tolerance=0.05)
    assert found.reason.name == "TIGHT"
    for interval in found:
        assert interval.lower <= truth[interval.name] <= interval.upper
        assert interval.lower <= interval.inner_lower <= interval.inner_upper <= interval.upper


HIDDEN = {
    "tanks": (
        ["g[t] = g[t-1] + b*u[t-1] - c*sqrt(g[t-1])", "h[t] = h[t-1] + c*sqrt(g[t-1]) - 0.3*sqrt(h[t-1])"],
        {"b": (0.05, 0.4), "c": (0.1, 0.6)},
        {"b": 0.2, "c": 0.25},
        {"g": (0, 20)},
    ),
    "arm": (
        ["h[t] = h[t-1] + 0.1*v[t-1]", "v[t] = v[t-1] + 0.1*(b*u[t-1] - 3*h[t-1] - d*v[t-1] - c*sign(v[t-1]))"],
        {"b": (0.1, 10), "c": (0, 2), "d": (0, 2)},
        {"b": 2.0, "c": 0.3, "d": 0.5},
        {"v": (-20, 20)},
    ),
}


@pytest.mark.parametrize("name", HIDDEN)
def test_what_a_piece_says_of_a_hidden_state_reaches_the_next(name):
    equations, boxes, truth, hidden = HIDDEN[name]
    model = OwnModel(equations, {"y": "h"}, ["u"], boxes).bound(**hidden)
    rng = np.random.default_rng(1)
    u = np.repeat(rng.uniform(0.5, 3, 12), 5)
    start = {own: [2.0] for own in ("h", *hidden)}
    y = simulate(model, {"u": u}, truth, start)["y"] + rng.uniform(-0.01, 0.01, 60)
    data = Dataset.from_arrays(input={"u": u}, output={"y": y}, sampling_time=0.2)
    found = identify(model, data, 0.01, method="inversion", tolerance=0.3, nodes=300)
    for interval in found:
        assert interval.lower <= truth[interval.name] <= interval.upper
        low, high = boxes[interval.name]
        assert interval.width < 0.15 * (high - low)


def test_a_hidden_state_that_is_known_too_badly_for_any_row_is_shaved():
    """Over all speeds the drag is too strong to say anything; at most of them it contradicts the samples."""
    equations, boxes, truth = (
        ["d/dt h = v", "d/dt v = b*u - d*v*Abs(v)"],
        {"b": (1, 4), "d": (0.1, 0.5)},
        {"b": 2, "d": 0.3},
    )
    model = OwnModel(equations, {"y": "h"}, ["u"], boxes, scheme="euler", substeps=5, sampling_time=0.1)
    model = model.bound(v=(-100, 100))
    rng = np.random.default_rng(1)
    u = np.repeat(rng.uniform(-3, 3, 6), 5)
    y = simulate(model, {"u": u}, truth, {"h": [0.0], "v": [1.0]})["y"] + rng.uniform(-0.01, 0.01, 30)
    data = Dataset.from_arrays(input={"u": u}, output={"y": y}, sampling_time=0.1)
    found = identify(model, data, 0.01, method="inversion", tolerance=0.3, nodes=100)
    for interval in found:
        assert interval.lower <= truth[interval.name] <= interval.upper
        assert interval.width < 0.1 * truth[interval.name]


def test_it_agrees_with_the_lift():
    model = OutputError(1, stable=True).bound(b0=(-5, 5))
    rng = np.random.default_rng(0)
    u = rng.uniform(-1, 1, 80)
    y = simulate(model, {"u": u}, {"a1": -0.8, "b0": 0.4})["y"] + rng.uniform(-0.05, 0.05, 80)
    data = Dataset.from_arrays(input={"u": u}, output={"y": y}, sampling_time=1.0)
    lift, inverted = (identify(model, data, 0.05, method=how, tolerance=1e-4) for how in ("lift", "inversion"))
    for one, other in zip(lift, inverted, strict=True):
        assert other.lower == pytest.approx(one.lower, abs=5e-4 * one.width)
        assert other.upper == pytest.approx(one.upper, abs=5e-4 * one.width)
        assert other.lower <= one.inner_lower
        assert one.inner_upper <= other.upper


def test_one_spoilt_sample_empties_the_set_and_is_named():
    equations, boxes, truth, _ = PLANTS["tank"]
    model = OwnModel(equations, {"y": "h"}, ["u"], boxes)
    data = record(model, truth, 0.02, 1, spoilt=0.1)
    with pytest.raises(EmptyFeasibleSetError, match="no parameters within their boxes") as proof:
        identify(model, data, 0.02)
    assert 33 in [sample for _, sample, _ in proof.value.samples]


@pytest.mark.parametrize(
    ("equations", "boxes", "message"),
    [
        (["h[t] = h[t-1] - c*sqrt(h[t-1])"], {}, r"a box of every parameter. Give ends to c, as in model.bound\(c="),
        (["v[t] = c*v[t-1] + u[t]", "h[t] = sqrt(v[t-1])"], {"c": (0, 0.9)}, r"no channel measures v.*model.bound\(v="),
        (["h[t] = asin(c*u[t])"], {"c": (0, 1)}, "no enclosure of asin"),
        (["v[t] = c*v[t-1] + u[t]", "h[t] = v[t-1]**2"], {"c": (0, 0.9)}, r"no channel measures v.*model.bound\(v="),
        (
            ["h[t] = 0.5*h[t-1] + u[t]/c"],
            {"c": (0, 0)},
            "divides by 'c', .* wherever in the boxes .* without divisions",
        ),
        (["h[t] = sqrt(c - u[t])"], {"c": (-2, -1)}, "^the free run is undefined .* roots and logarithms of negative"),
    ],
)
def test_what_cannot_be_inverted_is_refused_in_words(equations, boxes, message):
    model = OwnModel(equations, {"y": "h"}, ["u"] if "u" in "".join(equations) else [], boxes or {"c": (0, np.inf)})
    values = np.linspace(1, 2, 20)
    data = Dataset.from_arrays(input={"u": values}, output={"y": values + 0.1 * values**2}, sampling_time=1.0)
    with pytest.raises(ModelError, match=message):
        identify(model, data, 0.1, method="inversion")


def test_any_multipliers_give_a_true_bound():
    equations, boxes, truth, _ = PLANTS["dead zone"]
    model = OwnModel(equations, {"y": "h"}, ["u"], boxes)
    data = record(model, truth, 0.02, 2)
    held = Record(model, data, {"y": 0.02})
    point = np.array([*truth.values(), 1.0])
    rng = np.random.default_rng(0)
    lower, upper = point - np.array([0.1, 0.1, 0.2, 0]), point + np.array([0.05, 0.2, 0.1, 0])
    lower[3], upper[3] = held.lower[3], held.upper[3]
    rows = held.rows(lower, upper)
    program = Program(rows)
    place = (point - 0.5 * (lower + upper)) / (0.5 * (upper - lower))
    for k in range(4):
        for sign in (1, -1):
            best, *_ = program.end(k, sign)
            assert best <= sign * place[k] + 1e-9
            for size in (1e-3, 1e-1, 1.0):
                some = size * rng.normal(size=len(rows.centre))
                bound, _ = program._proven(some, k, sign)
                assert bound <= best + 1e-9
    assert program.emptiness() is None


def test_turned_coordinates_hold_the_same_points():
    rng = np.random.default_rng(4)
    lower, upper = np.array([-1.0, 2.0, -300.0, 0.0]), np.array([3.0, 2.5, 100.0, 1e-3])
    samples = rng.normal(size=(10, 2)) @ rng.normal(size=(2, 3))  # one sum of the three has no effect
    frame = Frame.of(lower, upper, [(np.array([0, 2, 3]), samples)])
    for _ in range(200):
        point = rng.uniform(lower, upper)
        turned = frame.inverse @ (point - frame.origin)
        assert np.all(frame.lower <= turned)
        assert np.all(turned <= frame.upper)
        forms = np.zeros((4, 8))
        frame.write(forms, turned, np.zeros(4), np.arange(4))
        assert np.all(np.abs(forms[:, 0] - point) <= forms[:, 1] + 1e-12 * np.abs(point))


def test_a_box_may_hold_a_point_where_the_model_divides_by_zero():
    model = OwnModel(["h[t] = 0.5*h[t-1] + u[t]/c"], {"y": "h"}, ["u"], {"c": (-1, 3)})
    data = record(model, {"c": 2.0}, 0.05, 0)
    found = identify(model, data, 0.05, method="inversion", tolerance=0.05)["c"]
    assert 1.9 < found.lower <= 2.0 <= found.upper < 2.1


def test_the_first_measurements_may_be_missing():
    equations, boxes, truth, _ = PLANTS["tank"]
    model = OwnModel(equations, {"y": "h"}, ["u"], boxes)
    data = record(model, truth, 0.02, 1)
    y = data.values("y").copy()
    y[:2] = np.nan
    data = Dataset.from_arrays(input={"u": data.values("u")}, output={"y": y}, sampling_time=0.2)
    assert Record(model, data, {"y": 0.02}).loose == ()
    found = identify(model, data, 0.02, method="inversion", tolerance=0.5)
    assert all(interval.lower <= truth[interval.name] <= interval.upper < 1 for interval in found)
    decided = decide(at_sampling_time(model, 0.2).with_values(truth), data, Window(0, 0, N - 1), {"y": 0.02}, 5.0)
    assert decided.status is Status.FEASIBLE


def test_coefficients_of_a_curve_may_read_samples_of_different_lags():
    model = OwnModel(["h[t] = a*u[t] + b*u[t-1] + c*u[t-3]**2"], {"y": "h"}, ["u"], {k: (-1, 1) for k in "abc"})
    data = record(model, {"a": 0.5, "b": 0.2, "c": -0.3}, 0.02, 0)
    held, u = Record(model, data, {"y": 0.02}), data.values("u")
    turned = held.turned({"u": u})
    assert turned.frame is not None
    assert turned.rows(*turned.box).impossible < 0
    ((unknowns, samples),) = static_curves(held.model, {"u": u})
    np.testing.assert_array_equal(unknowns, range(3))
    np.testing.assert_array_equal(samples, np.column_stack([u[3:], u[2:-1], u[:-3] ** 2]))
