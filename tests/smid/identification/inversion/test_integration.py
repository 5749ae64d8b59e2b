"""The enclosed solution of a differential equation holds the solution that another method computes."""

import math
from functools import partial

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import quad, solve_ivp

from relaxations.algebra.affine_arithmetic import CENTRE, HIGH, LOW, RADIUS, SLOPES, between
from smid import Dataset, ModelError, OwnModel, error_bound, identify
from smid.identification.inversion.integration import _phi, _phi_of
from smid.identification.inversion.record import Record
from smid.models import Reactor, RotatingArm
from smid.theses.hybrid.arm.exact_motion import exact_motion

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
    """Return the level of a tank with a pump that is on below a level: it slides along that where pump and leak meet."""
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
    first = {f"{own}[0]": value for own, value in start.items()}
    return record, np.array([(truth | first)[own] for own in record.names]), states


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
        left = rows.centre + rows.slopes @ ((point - 0.5 * (lower + upper)) / np.maximum(0.5 * (upper - lower), 1e-300))
        assert np.all(np.abs(left) <= rows.radius + 1e-10 * (1 + np.abs(rows.slopes).sum(axis=1)))


@pytest.mark.parametrize("seed", range(2))
@pytest.mark.parametrize("name", PLANTS)
def test_at_a_point_it_is_narrow(name, seed):
    record, point, states = posed(name, seed, bound=1e-3)
    found = record._run(0, 0, point, point)
    measured = record.data.values("y")
    for form, (which, now) in zip(found.outputs, found.places, strict=True):
        if which == 0:
            assert form[RADIUS] <= 1e-3 + 2e-3, (now, states)
            assert abs(abs(form[CENTRE]) - abs(states[now, 0] - measured[now])) <= form[RADIUS] - 1e-3 + 1e-9
