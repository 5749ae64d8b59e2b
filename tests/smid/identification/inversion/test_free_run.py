"""The forms of a free run hold every simulated run whose unknowns lie in the box."""

import numpy as np
import pytest
import sympy

from relaxations.algebra.affine_arithmetic import CENTRE, HIGH, LOW, RADIUS, SLOPES
from smid import Dataset, Model, OwnModel, Parameter
from smid.identification.inversion.record import Record
from smid.models import Line, Measurement, signal, t
from smid.models.simulate import simulate
from tests.smid.identification.inversion.kept import is_kept

x, v, u = signal("x"), signal("v"), signal("u")
a, b = (sympy.Symbol(name, real=True) for name in "ab")
N = 25
POLE = sympy.Max(sympy.Rational(1, 1000), a)
PACE = (1 - POLE ** sympy.exp(b * u[t - 1])) / (1 - POLE)  # of a lag whose time constant varies
# Lines, and the boxes of a and b.
PLANTS = {
    "root": ([Line(x[t], x[t - 1] - a * sympy.sqrt(x[t - 1]) + b * u[t - 1])], (0.05, 0.2), (0.2, 0.5)),
    "arrhenius": ([Line(x[t], x[t - 1] - a * x[t - 1] * sympy.exp(-b / (1 + u[t - 1])))], (0.1, 0.5), (0.5, 2)),
    "tanh": ([Line(x[t], x[t - 1] - a * sympy.tanh(5 * x[t - 1]) + b * u[t - 1])], (0.0, 0.2), (0.1, 0.5)),
    "power": ([Line(x[t], 0.8 * x[t - 1] + b * u[t - 1] ** a)], (0.5, 2.5), (0.1, 1)),
    "dead zone": ([Line(x[t], 0.7 * x[t - 1] + b * sympy.Max(0, u[t - 1] - a))], (0, 0.5), (0.1, 2)),
    "backlash": ([Line(x[t], sympy.Max(b * u[t] - a, sympy.Min(b * u[t] + a, x[t - 1])))], (0, 0.3), (0.5, 1.5)),
    "relay": ([Line(x[t], 0.7 * x[t - 1] + b * sympy.sign(u[t - 1] - a))], (0.2, 0.7), (0.1, 1)),
    "branches": (
        [Line(x[t], 0.7 * x[t - 1] + sympy.Piecewise((b * u[t - 1], x[t - 1] > 1), (a, True)))],
        (0, 1),
        (0, 1),
    ),
    "chaos": ([Line(x[t], a * x[t - 1] * (b - x[t - 1] / 2) + u[t - 1] / 1000)], (3.6, 3.9), (0.95, 1.0)),
    "pace": ([Line(x[t], x[t - 1] + (u[t - 1] - x[t - 1]) * PACE / 10)], (0.3, 0.999), (-1, 1)),
    "two lags": ([Line(x[t], a * x[t - 1] - 0.3 * x[t - 2] + b * u[t - 2])], (0.2, 0.9), (0.1, 1)),
}


def posed(name, rng):
    """Return a record of the plant, a random point of the parameters, and the run without noise."""
    lines, *boxes = PLANTS[name]
    parameters = tuple(Parameter(own, *box) for own, box in zip("ab", boxes, strict=True))
    model = Model(name, parameters, tuple(lines), (Measurement("y", "x", "eta"),))
    low, high = np.array(boxes, dtype=float).T
    truth = dict(zip("ab", rng.uniform(low, high), strict=True))
    inputs, start = rng.uniform(0.1, 1, N), rng.uniform(0.8, 1.2, 2)
    clean = simulate(model, {"u": inputs}, truth, {"x": start})["x"]
    measured = clean + rng.uniform(-0.1, 0.1, N)
    measured[7] = np.nan
    data = Dataset.from_arrays(input={"u": inputs}, output={"y": measured}, sampling_time=1.0)
    return Record(model, data, {"y": 0.1}), truth, clean


@pytest.mark.parametrize(("seed", "symbols"), [(0, 40), (1, 40), (2, 0), (3, 1), (4, 3)])  # few: they are folded early
@pytest.mark.parametrize("name", PLANTS)
def test_a_simulated_run_keeps_every_row_and_fits(name, seed, symbols, monkeypatch):
    monkeypatch.setattr("smid.identification.inversion.record.KEPT", symbols)
    rng = np.random.default_rng([seed, 5])
    record, truth, clean = posed(name, rng)
    point = np.array([*truth.values(), *clean[: len(record.names) - 2]])
    width = record.upper - record.lower
    for share in (1.0, 0.1, 0.001):
        lower = np.maximum(record.lower, point - share * width * rng.uniform(0, 1, len(point)))
        upper = np.minimum(record.upper, point + share * width * rng.uniform(0, 1, len(point)))
        rows = record.rows(lower, upper)
        assert rows.impossible < 0
        assert is_kept(rows, point, lower, upper)
    if name not in ("relay", "branches") and symbols > 3:  # a jump may lie at a point within rounding
        assert record.fits(point)


# Jumps may lie at a point within rounding, and chaos lets roundings grow.
@pytest.mark.parametrize("name", [name for name in PLANTS if name not in ("relay", "branches", "chaos")])
def test_a_box_of_one_point_encloses_the_run_closely(name):
    record, truth, clean = posed(name, np.random.default_rng(9))
    point = np.array([*truth.values(), *clean[: len(record.names) - 2]])
    found = record._run(record.cut.wholes[0], 0, point, point)
    measured = record.data.values("y")
    for form, (_, now) in zip(found.outputs, found.places, strict=True):
        assert form[RADIUS] <= 0.1 * (1 + 1e-9)
        assert np.abs(form[SLOPES:]).sum() <= 1e-12
        assert abs(abs(form[CENTRE]) - abs(clean[now] - measured[now])) <= 1e-10
        assert form[LOW] <= 0 <= form[HIGH]


RATES = {
    "pendulum": (["d/dt h = v", "d/dt v = b*u - g*sin(h) - v"], {"b": (0.2, 2), "g": (1, 5)}, {"v": (-2, 2)}),
    "reactor": (["d/dt h = b*(u - h) - g*h*exp(-2/(h + 1))"], {"b": (0.2, 2), "g": (0.5, 3)}, {}),
    "tank": (["d/dt h = b*u - g*sqrt(h)"], {"b": (0.5, 1), "g": (0.1, 0.3)}, {}),
}


@pytest.mark.parametrize(("scheme", "symbols"), [("euler", 40), ("rk4", 40), ("rk4", 5)])
@pytest.mark.parametrize("name", RATES)
def test_a_run_of_rates_keeps_every_row_and_fits(name, scheme, symbols, monkeypatch):
    monkeypatch.setattr("smid.identification.inversion.record.KEPT", symbols)
    equations, boxes, hidden = RATES[name]
    rng = np.random.default_rng(3)
    model = OwnModel(equations, {"y": "h"}, ["u"], boxes, scheme=scheme, substeps=2, sampling_time=0.1).bound(**hidden)
    for _ in range(3):
        truth = {p.name: float(rng.uniform(p.lower, p.upper)) for p in model.parameters}
        inputs, start = rng.uniform(0.1, 1, N), {"h": 0.5, **({"v": rng.uniform(-0.5, 0.5)} if hidden else {})}
        clean = simulate(model, {"u": inputs}, truth, {own: [value] for own, value in start.items()})
        measured = clean["h"] + rng.uniform(-0.05, 0.05, N)
        data = Dataset.from_arrays(input={"u": inputs}, output={"y": measured}, sampling_time=0.1)
        record = Record(model, data, {"y": 0.05})
        states = {f"{own}[{k}]": clean[own][k] for own in start for k in range(N)}
        point = np.array([(truth | states)[own] for own in record.names])
        assert record.fits(point)
        for share in (1.0, 0.1, 0.001):
            width = record.upper - record.lower
            lower = np.maximum(record.lower, point - share * width * rng.uniform(0, 1, len(point)))
            upper = np.minimum(record.upper, point + share * width * rng.uniform(0, 1, len(point)))
            rows = record.rows(lower, upper)
            assert rows.impossible < 0
            assert is_kept(rows, point, lower, upper)


def test_a_lag_without_limit_is_enclosed():
    """At a pole of one, the sum of its powers is divided by zero as it is written."""
    record, _, _ = posed("pace", np.random.default_rng(3))
    record.lower[:2], record.upper[:2] = (0.9, 0.0), (1.0, 0.1)
    found = record.rows(record.lower, record.upper)
    assert len(found.centre) > N // 2


@pytest.mark.parametrize("moving", ["u", "x"])
def test_the_point_of_a_hysteresis_is_verified(moving):
    """The sign of what does not move, or hardly, is not known, but neither does it matter."""
    moved = signal(moving)[t] - signal(moving)[t - 1]
    memory = sympy.sign(moved) + (v[t - 1] - sympy.sign(moved)) * sympy.exp(-b * sympy.Abs(moved))
    lines = Line(x[t], a * x[t - 1] + u[t - 1]), Line(v[t], memory), Line(signal("w")[t], x[t] + v[t])
    model = Model("loop", (Parameter("a", 0, 1), Parameter("b", 1, 9)), lines, (Measurement("y", "w", "eta"),))
    inputs, truth, begin = np.repeat([0.0, 1.0, 0.3], 80), {"a": 0.5, "b": 3.0}, {"x": 0.4, "v": -0.2}
    clean = simulate(model, {"u": inputs}, truth, {name: [value] for name, value in begin.items()})["w"]
    data = Dataset.from_arrays(input={"u": inputs}, output={"y": clean}, sampling_time=1.0)
    record = Record(model.bound(x=(-9, 9), v=(-1, 1)), data, {"y": 1e-6}, whole=True)
    assert record.fits(np.array([*truth.values(), *(begin[name.split("[")[0]] for name in record.names[2:])]))


def test_a_valve_that_sticks_stays_where_it_is():
    """The sign of a pull near zero is not known; but only a valve that slips is pulled back by its friction."""
    pull = v[t - 1] + u[t] - u[t - 1]
    slips = (1 + sympy.sign(sympy.Abs(pull) - a - b)) / 2
    lines = Line(v[t], pull + slips * (b * sympy.sign(pull) - pull)), Line(signal("w")[t], u[t] - v[t])
    model = Model("valve", (Parameter("a", 0.2, 1), Parameter("b", 0.1, 1)), lines, (Measurement("y", "w", "eta"),))
    inputs = np.repeat([0.0, 0.05, -0.02], 20)
    data = Dataset.from_arrays(input={"u": inputs}, output={"y": np.zeros(60)}, sampling_time=1.0)
    record = Record(model.bound(v=(-1e-9, 1e-9)), data, {"y": 1e-6}, whole=True)
    found = record._run(record.cut.parts[0], 0, record.lower, record.upper)
    assert found.outputs[:, RADIUS].max() < 1e-5
