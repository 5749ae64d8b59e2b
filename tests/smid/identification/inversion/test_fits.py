"""A point is never said to fit where its exact run breaks a bound, is undefined, or leaves what is known beforehand."""

import mpmath
import numpy as np
import pytest
import sympy

from smid import Dataset, Model, OwnModel, Parameter
from smid.identification.inversion.record import Record
from smid.models import VALUE, Line, Measurement, signal, t

x, v, u, w = signal("x"), signal("v"), signal("u"), signal("w")
a, b = (sympy.Symbol(name, real=True) for name in "ab")
N = 12
# The line, the same in numbers of many digits, and boxes of a and b.
PLANTS = {
    "root": (
        x[t - 1] - a * sympy.sqrt(x[t - 1]) + b * u[t - 1],
        lambda x, u, a, b: x - a * mpmath.sqrt(x) + b * u,
        (0.05, 0.2),
        (0.2, 0.5),
    ),
    "sine": (
        sympy.Rational(9, 10) * x[t - 1] - a * sympy.sin(3 * x[t - 1]) + b * u[t - 1],
        lambda x, u, a, b: mpmath.mpf(9) / 10 * x - a * mpmath.sin(3 * x) + b * u,
        (0.05, 0.2),
        (0.2, 0.5),
    ),
    "exponential": (
        x[t - 1] - a * x[t - 1] * sympy.exp(-b / (1 + u[t - 1])),
        lambda x, u, a, b: x - a * x * mpmath.exp(-b / (1 + u)),
        (0.1, 0.5),
        (0.5, 2.0),
    ),
    "power": (
        x[t - 1] / 2 + b * u[t - 1] ** a,
        lambda x, u, a, b: x / 2 + b * mpmath.power(u, a),
        (0.5, 2.5),
        (0.1, 1.0),
    ),
    "play": (
        sympy.Max(b * u[t] - a, sympy.Min(b * u[t] + a, x[t - 1])),
        None,
        (0.0, 0.3),
        (0.5, 1.5),
    ),
}


def exact_run(name, inputs, start, truth):
    """Return the run in 50 digits."""
    step, states = PLANTS[name][1], [mpmath.mpf(start)]
    with mpmath.workdps(50):
        for k in range(1, N):
            if step is None:
                middle, gap = mpmath.mpf(truth[1]) * mpmath.mpf(inputs[k]), mpmath.mpf(truth[0])
                states.append(max(middle - gap, min(middle + gap, states[-1])))
            else:
                states.append(step(states[-1], mpmath.mpf(inputs[k - 1]), *map(mpmath.mpf, truth)))
    return states


@pytest.mark.parametrize("name", PLANTS)
def test_no_point_fits_whose_exact_run_breaks_the_bound_by_a_rounding(name) -> None:
    """The bound of one sample is moved by a few roundings, inwards or outwards."""
    line, _, *boxes = PLANTS[name]
    rng, verdicts = np.random.default_rng(4), []
    parameters = tuple(Parameter(own, *box) for own, box in zip("ab", boxes, strict=True))
    model = Model(name, parameters, (Line(x[t], line),), (Measurement("y", "x", "eta"),))
    bound = 0.1
    for k in range(60):
        inputs, truth = rng.uniform(0, 1, N), rng.uniform(*np.transpose(boxes))
        inputs[3] = 0.0
        states = exact_run(name, inputs, 1.0, truth)
        y = np.array([float(state) for state in states]) + rng.uniform(-0.9, 0.9, N) * bound
        at, side = int(rng.integers(1, N)), int(rng.choice([-1, 1]))
        edge = 0 if k % 3 else int(rng.choice([-1, 1]))
        y[at] = float(states[at]) + side * bound + edge * 10.0 ** rng.uniform(-17, -12)
        data = Dataset.from_arrays(input={"u": inputs}, output={"y": y}, sampling_time=1.0)
        with mpmath.workdps(50):
            holds = all(abs(mpmath.mpf(m) - s) <= mpmath.mpf(bound) for m, s in zip(y, states, strict=True))
        fits = Record(model, data, {"y": bound}).fits(np.array([*truth, 1.0]))
        verdicts.append((holds, fits))
        assert holds or not fits
    assert (True, True) in verdicts
    assert (False, False) in verdicts


@pytest.mark.parametrize(
    "line",
    [
        a + sympy.atan(1 / (u[t] - a)),
        a + sympy.sin(sympy.log(u[t] - a)),
        a + sympy.sin(sympy.log(sympy.Max(0, u[t] - a))),
        a + sympy.Min(0, sympy.log(u[t] - a - sympy.Rational(1, 10))),
        a + sympy.sqrt(u[t] - a - sympy.Rational(1, 10**30)),
        a + (u[t] - a - sympy.Rational(1, 10**30)) ** b,
        a + sympy.Piecewise((1, 1 / (u[t] - a) > 0), (0, True)),
    ],
    ids=str,
)
def test_no_point_fits_whose_run_is_no_number(line) -> None:
    model = Model(
        "m", (Parameter("a", 0, 1), Parameter("b", 0.5, 2)), (Line(x[t], line),), (Measurement("y", "x", "e"),)
    )
    data = Dataset.from_arrays(input={"u": [0.5, 0.9]}, output={"y": [0.5, 0.5]}, sampling_time=1.0)
    record = Record(model, data, {"y": 10.0})
    assert not record.fits(np.array([0.5, 1.0]))
    assert record.fits(np.array([0.25, 1.0]))
    # Around it there are points that fit.
    assert record.rows(np.array([0.3, 0.9]), np.array([0.6, 1.1])).impossible < 0


def test_a_branch_that_is_not_taken_may_be_undefined() -> None:
    line = Line(x[t], a * sympy.Piecewise((sympy.sqrt(u[t]), u[t] > 0), (0, True)))
    model = Model("m", (Parameter("a", 0, 2),), (line,), (Measurement("y", "x", "e"),))
    data = Dataset.from_arrays(input={"u": [-1.0, 0.0, 4.0]}, output={"y": [0, 0, 2]}, sampling_time=1.0)
    assert Record(model, data, {"y": 0.1}).fits(np.array([1.0]))


@pytest.mark.parametrize("empty", [sympy.Max(0, u[t] - 1), sympy.Abs(u[t] - 1), (u[t] - 1) ** 2], ids=str)
@pytest.mark.parametrize("function", [sympy.sqrt, lambda e: e**a, lambda e: e ** sympy.Rational(3, 2)])
def test_a_root_or_power_of_exactly_zero_is_zero(empty, function) -> None:
    model = Model("m", (Parameter("a", 0.5, 2),), (Line(x[t], a + function(empty)),), (Measurement("y", "x", "e"),))
    data = Dataset.from_arrays(input={"u": [1.0, 2.0]}, output={"y": [1.0, 2.0]}, sampling_time=1.0)
    record = Record(model, data, {"y": 0.1})
    assert record.fits(np.array([1.0]))
    rows = record.rows(np.array([0.5]), np.array([2.0]))
    assert {sample for *_, sample in rows.sources.tolist()} == {0, 1}


def test_no_point_fits_outside_the_priors() -> None:
    model = Model("m", (Parameter("a", 0, 1),), (Line(x[t], a * u[t]),), (Measurement("y", "x", "e"),))
    data = Dataset.from_arrays(input={"u": [1.0]}, output={"y": [1.0]}, sampling_time=1.0)
    record = Record(model, data, {"y": 0.5})
    assert record.fits(np.array([1.0]))
    assert not record.fits(np.array([1.0 + 2**-52]))


def test_no_point_fits_whose_hidden_state_leaves_its_bounds_at_any_sample() -> None:
    model = OwnModel(["h[t] = b*h[t-1]", "x[t] = a*h[t-1] + u[t]"], ["x"], ["u"], {"a": [0, 2], "b": [1, 3]}).bound(
        h=(-8.5, 8.5)
    )
    for n, fits in ((4, True), (5, False)):  # h = 1, 2, 4, 8, 16
        y = np.concatenate([[0.5], 2.0 ** np.arange(n - 1)])
        data = Dataset.from_arrays(input={"u": 0 * y}, output={"x": y}, sampling_time=1.0)
        record = Record(model, data, {"x": 0.1})
        assert record.names == ("a", "b", "h[0]")
        assert record.fits(np.array([1.0, 2.0, 1.0])) is fits


@pytest.mark.parametrize("lag", [1, 3])
def test_an_output_is_not_judged_where_the_model_says_nothing_of_it(lag: int) -> None:
    """A signal without memory that reads an input before the record."""
    model = Model("m", (Parameter("a", 0, 2),), (Line(x[t], a * u[t - lag]),), (Measurement("y", "x", "e"),))
    inputs = np.arange(1.0, 7.0)
    y = np.concatenate([np.full(lag, 99.0), inputs[:-lag]])
    data = Dataset.from_arrays(input={"u": inputs}, output={"y": y}, sampling_time=1.0)
    record = Record(model, data, {"y": 0.1})
    assert record.fits(np.array([1.0]))
    assert not record.fits(np.array([1.2]))


def test_a_sensor_whose_curve_falls() -> None:
    shown = Measurement("y", "x", "e", sympy.exp(-VALUE))
    model = Model("m", (Parameter("a", 0, 2),), (Line(x[t], a * u[t]),), (shown,))
    inputs = np.array([1.0, 0.5])
    for bend, fits in ((0.05, True), (0.2, False), (-0.05, True), (-0.2, False)):
        data = Dataset.from_arrays(input={"u": inputs}, output={"y": -np.log(inputs) + bend}, sampling_time=1.0)
        assert Record(model, data, {"y": 0.1}).fits(np.array([1.0])) is fits


def test_both_channels_of_an_input_count() -> None:
    shown = (Measurement("p", "u", "d"), Measurement("q", "u", "e"), Measurement("y", "x", "f"))
    model = Model("m", (Parameter("a", 0, 2),), (Line(x[t], a * u[t]),), shown)
    for apart, fits in ((0.05, True), (0.15, False), (0.25, False)):  # 0.15 needs noises other than zero
        data = Dataset.from_arrays(input={"p": [1.0], "q": [1.0 + apart]}, output={"y": [1.0]}, sampling_time=1.0)
        record = Record(model, data, {"p": 0.1, "q": 0.1, "y": 0.1})
        assert record.fits(np.array([1.0])) is fits
        assert (record.rows(record.lower, record.upper).impossible >= 0) is (apart > 0.2)


def test_a_channel_may_show_one_signal_exactly_and_another_with_noise() -> None:
    lines = (Line(x[t], a * u[t]), Line(v[t], b * u[t]))
    boxes = (Parameter("a", 0, 2), Parameter("b", 0, 2))
    model = Model("m", boxes, lines, (Measurement("y", "x", "e"), Measurement("y", "v", None)))
    data = Dataset.from_arrays(input={"u": [1.0, 1.0]}, output={"y": [1.0, 1.0]}, sampling_time=1.0)
    record = Record(model, data, {"y": 0.1})
    assert not record.fits(np.array([1.05, 1.05]))
    lower, upper = np.array([0.5, 1.01]), np.array([1.5, 1.09])
    assert record.rows(lower, upper).impossible >= 0
    assert record.rows(lower, np.array([1.5, 1.0])).impossible < 0
