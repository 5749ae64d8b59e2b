"""The enclosed solution of a differential equation holds the solution that another method computes."""

import math
from functools import partial

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import quad, solve_ivp

from relaxations.algebra.affine_arithmetic import CENTRE, HIGH, LOW, RADIUS, SLOPES, between
from relaxations.search.enclosure import Reason
from smid import Dataset, ModelError, NotProvenError, OwnModel, error_bound, identify, verify
from smid.identification.inversion.phi import phi, phi_of
from smid.identification.inversion.record import Record
from smid.models import Reactor, RotatingArm
from smid.models.simulate import simulate
from smid.signals import prbs
from smid.theses.hybrid import simulate_reactor
from smid.theses.hybrid.arm.exact_motion import exact_motion
from tests.smid.identification.inversion.kept import is_kept

N, BOUND = 25, 0.01


def by_scipy(f, u, start, dt):
    """Return the states at the samples, with steps far below the sampling time."""
    states = [np.array(start, dtype=float)]
    for held in u[:-1]:
        solved = solve_ivp(
            lambda _, x, held=held: f(x, held), (0, dt), states[-1], method="DOP853", rtol=1e-12, atol=1e-13
        )
        states.append(solved.y[:, -1])
    return np.array(states)


def braked(speed, drive, friction, drag, dt):
    """Return the speed after d/dt v = drive - friction sign(v) - drag v, which has a closed solution on either side."""
    for _ in range(3):
        side = math.copysign(1.0, speed or drive)
        if speed == 0.0 and abs(drive) <= friction:
            return 0.0
        final = (drive - side * friction) / drag
        ratio = final / (final - speed) if speed and final * side < 0 else 0.0
        stop = -math.log(ratio) / drag if 0 < ratio < 1 else math.inf
        if stop >= dt:
            return final + (speed - final) * math.exp(-drag * dt)
        speed, dt = 0.0, dt - stop
    raise AssertionError


def rubbing(u, p, start, dt):
    v = [start[0]]
    for held in u[:-1]:
        v.append(braked(v[-1], p["b"] * held, p["f"], 0.5, dt))
    return np.array(v)[:, None]


def arm(u, p, start, dt):
    return exact_motion(u, dt, values={name: p[name] for name in ("theta", "Ws", "Wd", "b")}, start=tuple(start))


def switched(u, p, start, dt):
    """Return the level of a tank with a pump that is on below a level, and slides along that."""
    h = [start[0]]
    for held in u[:-1]:
        x, left = h[-1], dt
        for _ in range(3):
            below = x < p["s"] or (x == p["s"] and p["b"] + 0.1 * held < x)
            if x == p["s"] and 0.1 * held <= x <= p["b"] + 0.1 * held:
                break
            final = 0.1 * held + (p["b"] if below else 0.0)
            ratio = (final - p["s"]) / (final - x) if final != x and x != p["s"] else 0.0
            time = -math.log(ratio) if 0 < ratio < 1 else math.inf
            if time >= left:
                x = final + (x - final) * math.exp(-left)
                break
            x, left = p["s"], left - time
        h.append(x)
    return np.array(h)[:, None]


# Model, its sampling time, the inputs' range, the first states, and the solution from inputs, parameters and start.
def plant(equations, boxes, hidden, dt, inputs, start, f):
    model = OwnModel(equations, {"y": "h"}, ["u"], boxes, scheme="enclosed", substeps=5, sampling_time=dt)
    solved = f if not isinstance(f, partial) else None
    return (
        model.bound(**hidden),
        inputs,
        start,
        solved or (lambda u, p, x0, dt: by_scipy(partial(f.func, p), u, x0, dt)),
    )


PLANTS = {
    "pendulum": plant(
        ["d/dt h = v", "d/dt v = b*u - g*sin(h) - v"],
        {"b": (0.2, 2), "g": (1, 5)},
        {"v": (-5, 5)},
        0.2,
        (-1, 1),
        {"h": 0.5, "v": 0.3},
        partial(lambda p, x, u: [x[1], p["b"] * u - p["g"] * math.sin(x[0]) - x[1]]),
    ),
    "arrhenius": plant(
        ["d/dt h = b*(u - h) - g*h*exp(-2/(h + 1))"],
        {"b": (0.2, 2), "g": (0.5, 3)},
        {},
        0.3,
        (0.5, 1),
        {"h": 0.6},
        partial(lambda p, x, u: [p["b"] * (u - x[0]) - p["g"] * x[0] * math.exp(-2 / (x[0] + 1))]),
    ),
    "stiff": plant(
        ["d/dt h = b*v - h", "d/dt v = 500*(g*u - v + 0.1*tanh(h))"],
        {"b": (0.02, 0.06), "g": (0.5, 1)},
        {"v": (-5, 5)},
        0.2,
        (-1, 1),
        {"h": 0.6, "v": 0.0},
        partial(lambda p, x, u: [p["b"] * x[1] - x[0], 500 * (p["g"] * u - x[1] + 0.1 * math.tanh(x[0]))]),
    ),
    "tank": plant(
        ["d/dt h = b*u - g*sqrt(h) - 0.2*Max(h - 0.5, 0)"],
        {"b": (0.5, 1), "g": (0.1, 0.3)},
        {},
        0.5,
        (0.2, 1),
        {"h": 0.6},
        partial(lambda p, x, u: [p["b"] * u - p["g"] * math.sqrt(x[0]) - 0.2 * max(x[0] - 0.5, 0)]),
    ),
    "drag": plant(
        ["d/dt h = v", "d/dt v = b*u - g*v*Abs(v) - Min(h, 0.2)"],
        {"b": (0.2, 2), "g": (1, 5)},
        {"v": (-5, 5)},
        0.2,
        (-1, 1),
        {"h": 0.0, "v": 0.3},
        partial(lambda p, x, u: [x[1], p["b"] * u - p["g"] * x[1] * abs(x[1]) - min(x[0], 0.2)]),
    ),
    "rubbing": plant(
        ["d/dt h = b*u - f*sign(h) - 0.5*h"], {"b": (0.5, 2), "f": (0.2, 1)}, {}, 0.2, (-1, 1), {"h": 0.2}, rubbing
    ),
    "switched": plant(
        ["d/dt h = 0.1*u + Piecewise((b, h < s), (0, True)) - h"],
        {"b": (0.6, 1.5), "s": (0.3, 0.5)},
        {},
        0.3,
        (0, 1),
        {"h": 0.1},
        switched,
    ),
    "arm": (
        RotatingArm(friction=True, drag=True, scheme="enclosed", substeps=2, sampling_time=0.02).bound(
            theta=(20, 24), Wd=(0.35, 0.5), Ws=(1.0, 1.4), b=(0.002, 0.004), speed=(-30, 30)
        ),
        (-0.2, 0.2),
        {"angle": 0.0, "speed": 0.0},
        arm,
    ),
}


def posed(name, seed, bound=BOUND):
    """Return a record of the plant, and the unknowns that made it."""
    model, (low, high), start, solved = PLANTS[name]
    rng = np.random.default_rng([seed, len(name)])
    truth = {p.name: float(rng.uniform(p.lower, p.upper)) for p in model.parameters}
    u = np.repeat(rng.uniform(low, high, N), 3)[:N]
    states = solved(u, truth, list(start.values()), model.sampling_time)
    y = states[:, 0] + rng.uniform(-0.7 * bound, 0.7 * bound, N)
    data = Dataset.from_arrays(input={"u": u}, output={"y": y}, sampling_time=model.sampling_time)
    record = Record(model, data, {"y": bound})
    samples = {f"{own}[{k}]": states[k, place] for place, own in enumerate(start) for k in range(N)}
    return record, np.array([(truth | samples)[own] for own in record.names]), states


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("name", PLANTS)
def test_the_solution_lies_inside(name, seed):
    record, point, _ = posed(name, seed)
    rng = np.random.default_rng(seed)
    width = np.where(np.isfinite(record.upper - record.lower), record.upper - record.lower, 0.0)
    assert record.fits(point)
    for share in (1.0, 0.1, 0.01, 0.0001, 0.0):
        lower = np.maximum(record.lower, point - share * width * rng.uniform(0, 1, len(point)))
        upper = np.minimum(record.upper, point + share * width * rng.uniform(0, 1, len(point)))
        rows = record.rows(lower, upper)
        assert rows.impossible < 0
        assert is_kept(rows, point, lower, upper, 1e-10)


@pytest.mark.parametrize("seed", range(2))
@pytest.mark.parametrize("name", PLANTS)
def test_at_a_point_it_is_narrow(name, seed):
    record, point, states = posed(name, seed, bound=1e-3)
    found = record._run(record.cut.wholes[0], 0, point, point)
    measured = record.data.values("y")
    for form, (which, now) in zip(found.outputs, found.places, strict=True):
        if which == 0:
            assert form[RADIUS] <= 1e-3 + 2e-3, (now, states)
            assert abs(abs(form[CENTRE]) - abs(states[now, 0] - measured[now])) <= form[RADIUS] - 1e-3 + 1e-9


def integral(z, k):
    return quad(lambda s: math.exp(z * (1 - s)) * s ** (k - 1) / math.factorial(k - 1), 0, 1, epsabs=0, epsrel=1e-12)[0]


@settings(deadline=None)
@given(st.floats(-60, 20), st.floats(0, 8), st.floats(0, 1), st.sampled_from([1, 2, 3]))
def test_phi_of_a_form_holds_its_values(low, width, share, k):
    w = np.zeros((2, 5))
    between(w, 0, low, low + width)
    w[0, SLOPES], w[0, RADIUS] = w[0, RADIUS], 0.0
    phi_of(w, 1, 0, k)
    z = low + share * width
    value = integral(z, k)
    assert phi(z, k) == pytest.approx(value, rel=1e-10)
    e = (z - w[0, CENTRE]) / w[0, SLOPES] if w[0, SLOPES] else 0.0
    slack = 1e-10 * (value + abs(w[1, SLOPES]))
    assert abs(w[1, CENTRE] + w[1, SLOPES] * e - value) <= w[1, RADIUS] + slack
    assert w[1, LOW] - slack <= value <= w[1, HIGH] + slack


LINEAR = OwnModel(
    ["d/dt h = a*h + b*u"], {"y": "h"}, ["u"], {"a": (-2e3, 2), "b": (-9, 9)}, scheme="enclosed", substeps=3
)


@settings(deadline=None, max_examples=60)
@given(st.floats(-7, 0.7), st.floats(-5, 5), st.floats(0, 1), st.sampled_from([0.0, 1e-6, 0.01, 0.3]))
def test_a_linear_rate_is_enclosed_as_its_closed_solution(size, b, share, width):
    a = -math.exp(-size) if size < 0 else size
    dt, u, h = 0.5, [1.0, -1.0, 0.5, 2.0], [0.4]
    for held in u[:-1]:
        grown = math.expm1(a * dt) / a if abs(a) > 1e-9 else dt
        h.append(h[-1] * math.exp(a * dt) + b * held * grown)
    data = Dataset.from_arrays(input={"u": u}, output={"y": h}, sampling_time=dt)
    record = Record(LINEAR, data, {"y": 1e-6})
    point, reach = np.array([a, b, 0.4]), width * np.array([abs(a), 0.1 + abs(b), 0.0])
    lower, upper = (
        np.maximum(point - share * reach, record.lower),
        np.minimum(point + (1 - share) * reach, record.upper),
    )
    rows = record.rows(lower, upper)
    assert rows.impossible < 0
    assert is_kept(rows, point, lower, upper)
    assert record.fits(point)  # however stiff: the enclosure is that of the exponential


def test_the_intervals_hold_for_the_equation():
    equations, boxes = ["d/dt h = b*u - g*sqrt(h)"], {"b": (0.5, 1), "g": (0.1, 0.5)}
    make = partial(OwnModel, equations, {"y": "h"}, ["u"], boxes, sampling_time=2.0)
    rng = np.random.default_rng(2)
    u = np.repeat(rng.uniform(0.1, 1, 6), 4)
    truth = {"b": 0.8, "g": 0.4}
    h = by_scipy(lambda x, u: [truth["b"] * u - truth["g"] * math.sqrt(x[0])], u, [0.3], 2.0)[:, 0]
    y = h + rng.uniform(-1e-3, 1e-3, len(u))
    data = Dataset.from_arrays(input={"u": u}, output={"y": y}, sampling_time=2.0)
    found = identify(make(scheme="enclosed", substeps=20), data, 1e-3, tolerance=0.2, nodes=1000)
    assert found.reason.name == "TIGHT"
    assert all(i.lower <= truth[i.name] <= i.upper for i in found)


def test_boxes_are_not_cut_where_only_the_remainder_of_the_steps_is_left_open():
    u = prbs(20, seed=1, amplitude=0.4, offset=0.5, clock_period=4.0)
    y = simulate_reactor("power", u, 1.0) + np.random.default_rng(1).uniform(-0.005, 0.005, len(u))
    data = Dataset.from_arrays(input=u, output=y, sampling_time=1.0)
    coarse, fine = (
        identify(Reactor(None, None, 3, scheme="enclosed", substeps=n), data, 0.005, tolerance=0.2) for n in (2, 20)
    )
    assert (coarse.reason, fine.reason) == (Reason.SMALLEST, Reason.TIGHT)
    for name, truth in (("tau", 2.0), ("a", 1.0)):
        assert coarse[name].lower < fine[name].lower <= truth <= fine[name].upper < coarse[name].upper


def test_what_needs_polynomials_refuses_a_differential_equation(tmp_path):
    make = partial(OwnModel, ["d/dt h = b*u - h"], {"y": "h"}, ["u"], {"b": (0, 2)}, sampling_time=0.5)
    model, u = make(scheme="enclosed"), np.array([1.0, 0, 1, 1, 0, 0, 1, 0])
    assert "integrated by rk4, the remainder enclosed, 1 step per sample" in str(model)
    y = simulate(model, {"u": u}, {"b": 1.0})["y"]
    data = Dataset.from_arrays(input={"u": u}, output={"y": y}, sampling_time=0.5)
    with pytest.raises(ModelError, match=r"is about its differential equation.*method='inversion'"):
        identify(model, data, 0.1, method="lift")
    with pytest.raises(ModelError, match="for polynomials only"):
        error_bound(model, data)
    identify(make(), data, 0.1, method="inversion", certificate=tmp_path / "proof.json")
    verify(tmp_path / "proof.json", data, make())
    with pytest.raises(NotProvenError, match="the proof is about lines of samples"):
        verify(tmp_path / "proof.json", data, model)
