"""An effect is hidden in a plant that is walked in small steps, and a try on the plain model recovers its law."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
import sympy
from scipy.signal import lfilter

from smid import Dataset, OutputError
from smid.diagnosis.effects import EFFECTS
from smid.diagnosis.effects.effect import Site
from smid.diagnosis.search.trial import Trial, fitted_base, try_effect
from smid.models import Line, Measurement, Model, Parameter, signal, t

BY_NAME = {effect.name: effect for effect in EFFECTS}
FINE, STEP = 50, 0.1  # small steps per sample, and seconds per sample


def held(seed: int, n: int = 600, hold: int = 8, low: float = -1.0) -> np.ndarray:
    return np.repeat(np.random.default_rng(seed).uniform(low, 1, -(-n // hold)), hold)[:n]


def swept(n: int = 600) -> np.ndarray:
    return 0.6 * np.sin(0.11 * np.arange(n)) + 0.4 * np.sin(0.031 * np.arange(n) + 1)


def walked(
    u: np.ndarray, rate: Callable[[np.ndarray, float], np.ndarray], states: int = 1, start: float = 0.0
) -> np.ndarray:
    """Walk ``dx/dt = rate(x, u)`` with u held, by the midpoint rule; all states at the samples, shape (n, states)."""
    h, x, seen = STEP / FINE, np.full(states, start), []
    for now in u:
        seen.append(x)
        for _ in range(FINE):
            x = x + h * rate(x + h / 2 * rate(x, now), now)
    return np.array(seen)


def tried(
    name: str, model: Model, u: np.ndarray, y: np.ndarray, noise: float, **others: Any
) -> tuple[Trial, float, float]:
    """Try an effect; return the trial, and the RMS errors of the base and of the extended model over the noise's."""
    eta = noise * np.std(y) * np.random.default_rng(9).uniform(-1, 1, len(y))
    data = Dataset.from_arrays(input={"u": u}, output={"y": y + eta}, sampling_time=STEP, **others)
    used = (np.ones(len(u), bool),)
    base = fitted_base(model, data, used, "u", "y")
    trial = try_effect(BY_NAME[name], base)
    assert trial is not None
    before, after = (
        float(np.sqrt(np.mean(f.residual(data, "y")[0] ** 2) / np.mean(eta**2))) for f in (base.fit, trial.fit)
    )
    return trial, before, after


@pytest.mark.parametrize("u", [held(0), swept()], ids=["held", "swept"])
def test_a_valve_that_sticks(u: np.ndarray) -> None:
    """A stem without mass, pulled by a spring: it breaks away at 0.3 and slides until the pull is 0.1."""
    stem, stems, moves = u[0], [], False
    for now in u:
        for _ in range(FINE):
            pull = now - stem
            moves = abs(pull) > (0.1001 if moves else 0.3)
            if moves:
                stem += 0.5 * (pull - np.sign(pull) * 0.1)
        stems.append(stem)
    y = walked(np.array(stems), lambda x, v: 2 * v - x / 0.7)[:, 0]
    trial, before, after = tried("valve_stiction", OutputError(stable=True), u, y, 0.03)
    assert before > 3
    assert after < 1.2
    assert trial.values["slip_jump"] == pytest.approx(0.2, abs=0.04)
    assert trial.values["sliding_friction"] == pytest.approx(0.1, abs=0.01)


def test_a_valve_that_sticks_little_beside_how_far_its_command_drifts_and_begins_pulled() -> None:
    generator = np.random.default_rng(1)
    u = np.cumsum(generator.choice([-1.0, 0.0, 1.0], 300)) + generator.uniform(-0.5, 0.5, 300)
    pulled, stem = 0.9, []
    for step in np.diff(u, prepend=u[0]):
        pull = pulled + step
        pulled = pull if abs(pull) <= 1.2 else 0.4 * np.sign(pull)
        stem.append(pulled)
    y = lfilter([0, 0.3], [1, -0.7], u - stem)
    trial, before, after = tried("valve_stiction", OutputError(stable=True), u, y, 0.005)
    assert np.ptp(u) > 50 * 0.4
    assert before > 5
    assert after < 1.2
    assert trial.values["slip_jump"] == pytest.approx(0.8, abs=0.04)
    assert trial.values["sliding_friction"] == pytest.approx(0.4, abs=0.02)


@pytest.mark.parametrize("cube", [6.0, -1.0], ids=["hardens", "softens"])
def test_a_cubic_spring(cube: float) -> None:
    """x'' = 4 u - 4 x - 0.8 x' - cube x^3: the factor of x^3 is the law's, per sample squared."""

    def rate(x: np.ndarray, v: float) -> np.ndarray:
        return np.array([x[1], 4 * v - 4 * x[0] - 0.8 * x[1] - cube * x[0] ** 3])

    u = held(1, low=-0.6) * 0.6
    trial, before, after = tried("stiffness", OutputError(2, 1, stable=True), u, walked(u, rate, 2)[:, 0], 0.02)
    assert before > 3
    assert after < 1.2
    assert trial.label == "cubic on w"
    assert trial.values["spring_cube"] / STEP**2 == pytest.approx(cube, rel=0.05)


def test_a_spring_that_is_not_the_same_on_both_sides() -> None:
    def rate(x: np.ndarray, v: float) -> np.ndarray:
        return np.array([x[1], 4 * v - 4 * x[0] - 0.8 * x[1] - 3 * x[0] ** 2 - 6 * x[0] ** 3])

    u = held(1, low=-0.6) * 0.6
    trial, before, after = tried("stiffness", OutputError(2, 1, stable=True), u, walked(u, rate, 2)[:, 0], 0.02)
    assert before > 3
    assert after < 1.2
    assert trial.label == "square and cube on w"
    assert trial.values["spring_square"] / STEP**2 == pytest.approx(3, rel=0.05)
    assert trial.values["spring_cube"] / STEP**2 == pytest.approx(6, rel=0.05)


@pytest.mark.parametrize("power", [0.55, 1.8])
def test_an_input_that_acts_with_a_power(power: float) -> None:
    def rate(x: np.ndarray, v: float) -> np.ndarray:
        return 2 * np.sign(v) * abs(v) ** power - x / 0.9

    u = held(3)
    trial, before, after = tried("input_curve", OutputError(stable=True), u, walked(u, rate)[:, 0], 0.02)
    assert before > 3
    assert after < 1.2
    assert trial.label == "power"
    assert trial.values["input_curve_exponent"] == pytest.approx(power, rel=0.03)


def test_a_spring_behind_a_gap() -> None:
    def rate(x: np.ndarray, v: float) -> np.ndarray:
        return np.array([x[1], 6 * v - 2 * x[0] - 1.5 * x[1] - 20 * (x[0] - np.clip(x[0], -0.4, 0.4))])

    u = held(2)
    trial, before, after = tried("stiffness", OutputError(2, 1, stable=True), u, walked(u, rate, 2)[:, 0], 0.03)
    assert before > 3
    assert after < 1.2
    assert trial.label == "gap on w"
    assert trial.values["spring_gap"] == pytest.approx(0.4, rel=0.1)
    assert trial.values["spring_beyond"] / STEP**2 == pytest.approx(20, rel=0.25)


def arm() -> Model:
    """Newton's law of an arm with viscous friction, its angle measured."""
    gain, damping = Parameter("k", 0.0, 5000.0), Parameter("d", 0.0, 50.0)
    u, v, x = signal("u"), signal("v"), signal("x")
    lines = (Line(v[t], gain.symbol * u[t] - damping.symbol * v[t], rate=True), Line(x[t], v[t], rate=True))
    return Model("arm", (gain, damping), lines, (Measurement("y", "x", "eta"),), sampling_time=STEP)


@pytest.mark.parametrize(("unit", "size"), [("rad", 1.0), ("deg", 180 / np.pi), ("V", 3.0)])
def test_an_arm_that_gravity_pulls_down(unit: str, size: float) -> None:
    """x'' = 8 u - x' - 5 sin(x), and the sensor shows radians, degrees or volts."""

    def rate(x: np.ndarray, v: float) -> np.ndarray:
        return np.array([x[1], 8 * v - x[1] - 5 * np.sin(x[0])])

    u = 0.6 * held(3, hold=12)
    y = size * walked(u, rate, 2)[:, 0]
    trial, before, after = tried("gravity", arm(), u, y, 0.03, units={"u": "V", "y": unit})
    assert before > 3
    assert after < 1.2
    assert trial.label == "pendulum on x"
    assert trial.values["gravity_sine"] == pytest.approx(5 * size, rel=0.05)
    assert trial.values.get("gravity_turn", 1 / size) == pytest.approx(1 / size, rel=0.05)


def test_an_arm_whose_sensor_has_another_zero() -> None:
    def rate(x: np.ndarray, v: float) -> np.ndarray:
        return np.array([x[1], 8 * v - x[1] - 5 * np.sin(x[0] - 0.7)])

    u = 0.6 * held(3, hold=12)
    trial, before, after = tried("gravity", arm(), u, walked(u, rate, 2)[:, 0], 0.03, units={"u": "V", "y": "rad"})
    sine, cosine = trial.values["gravity_sine"], trial.values["gravity_cosine"]
    assert before > 3
    assert after < 1.2
    assert np.hypot(sine, cosine) == pytest.approx(5, rel=0.05)
    assert np.arctan2(-cosine, sine) == pytest.approx(0.7, abs=0.03)


def test_a_load_that_hangs() -> None:
    u = 0.3 * held(4, hold=12)
    y = walked(u, lambda x, v: np.array([x[1], 8 * v - x[1] - 0.5]), 2)[:, 0]
    trial, before, after = tried("gravity", arm(), u, y, 0.005)
    assert before > 3
    assert after < 1.2
    assert trial.label == "constant on x"
    assert trial.values["gravity_force"] == pytest.approx(-0.5, rel=0.05)


def tank() -> Model:
    """A tank that empties in proportion to its level."""
    pump, outflow = Parameter("pump", 0.0, 50.0), Parameter("k", 0.0, 50.0)
    w = signal("w")
    line = Line(w[t], pump.symbol * signal("u")[t] - outflow.symbol * w[t], rate=True)
    return Model("tank", (pump, outflow), (line,), (Measurement("y", "w", "eta"),), sampling_time=STEP)


def tanks() -> Model:
    """Two of them, one above the other."""
    pump, first, second = (Parameter(name, 0.0, 50.0) for name in ("pump", "k1", "k2"))
    u, x, w = signal("u"), signal("x"), signal("w")
    lines = (
        Line(x[t], pump.symbol * u[t] - first.symbol * x[t], rate=True),
        Line(w[t], first.symbol * x[t] - second.symbol * w[t], rate=True),
    )
    return Model("tanks", (pump, first, second), lines, (Measurement("y", "w", "eta"),), sampling_time=STEP)


@pytest.mark.parametrize("model", [tank(), OutputError(stable=True)], ids=["in rates", "in steps"])
@pytest.mark.parametrize("below", [0.0, 0.2])
def test_a_tank_that_empties_with_the_root(model: Model, below: float) -> None:
    u = held(5, hold=15, low=0.2)
    y = walked(u, lambda x, v: 3 * v - 1.5 * np.sqrt(np.maximum(x + below, 0.0)))[:, 0]
    trial, before, after = tried("square_root_outflow", model, u, y, 0.02)
    assert before > 3
    assert after < 1.2
    assert trial.values["root_share"] > 0.9
    assert trial.values.get("root_outlet", 0.0) == pytest.approx(-below, abs=0.05)


def test_a_pump_whose_zero_is_off_is_told_where_the_tank_shows_it() -> None:
    """Behind the root law it changes how fast the level moves; a linear tank shows it as a bias of its sensor."""
    u, w = held(5, hold=15, low=0.2), signal("w")
    pump, outflow = Parameter("pump", 0.0, 50.0), Parameter("k", 0.0, 50.0)
    root = sympy.sqrt(sympy.Max(0, w[t]))
    line = Line(w[t], pump.symbol * signal("u")[t] - outflow.symbol * root, rate=True)
    model = Model("root", (pump, outflow), (line,), (Measurement("y", "w", "eta"),), sampling_time=STEP)
    y = walked(u, lambda x, v: 3 * (v + 0.15) - 1.5 * np.sqrt(x), start=2.0)[:, 0]
    trial, before, after = tried("input_bias", model, u, y, 0.02)
    assert before > 3
    assert after < 1.2
    assert trial.values["input_bias"] == pytest.approx(0.15, rel=0.1)
    site = Site(Dataset.from_arrays(input={"u": u}, output={"y": y}, sampling_time=STEP), "u", "y")
    assert not any(BY_NAME["input_bias"].extensions(tank(), site))


def test_a_constant_force_on_a_mass_is_a_bias_of_its_drive() -> None:
    gain, w = Parameter("gain", 0.1, 10.0), signal("w")
    line = Line(w[t], gain.symbol * signal("u")[t], rate=True)
    mass = Model("mass", (gain,), (line,), (Measurement("y", "w", "eta"),), sampling_time=STEP)
    u = held(7)
    y = walked(u, lambda x, v: 2 * (v - 0.05) + 0 * x)[:, 0]
    trial, before, after = tried("input_bias", mass, u, y, 0.02)
    assert before > 3
    assert after < 1.2
    assert trial.values["input_bias"] == pytest.approx(-0.05, rel=0.1)


def test_a_cascade_that_empties_with_the_root() -> None:
    def rate(x: np.ndarray, v: float) -> np.ndarray:
        upper, lower = np.sqrt(np.maximum(x, 0.0))
        return np.array([3 * v - 2 * upper, 2 * upper - 1.6 * lower])

    u = held(6, hold=15, low=0.2)
    trial, before, after = tried("square_root_outflow", tanks(), u, walked(u, rate, 2, 0.5)[:, 1], 0.02)
    assert before > 3
    assert after < 1.2
    assert trial.values["root_share"] > 0.9


@pytest.mark.parametrize(
    ("model", "per"), [(tank(), 1.0), (OutputError(stable=True), STEP)], ids=["in rates", "in steps"]
)
def test_an_input_multiplies_the_state(model: Model, per: float) -> None:
    u = held(7)
    y = walked(u, lambda x, v: 2 * v - 1.5 * x + 0.8 * v * x)[:, 0]
    trial, before, after = tried("bilinear", model, u, y, 0.02)
    assert before > 3
    assert after < 1.2
    assert trial.values["w_bilinear"] / per == pytest.approx(0.8, rel=0.05)


def test_an_input_multiplies_a_position() -> None:
    """x'' = 4 (u + c u x) - 4 x - 0.8 x', c the law's in steps as in rates."""

    def rate(x: np.ndarray, v: float) -> np.ndarray:
        return np.array([x[1], 4 * v * (1 + 0.5 * x[0]) - 4 * x[0] - 0.8 * x[1]])

    u = 0.6 * held(7)
    trial, before, after = tried("bilinear", OutputError(2, 1, stable=True), u, walked(u, rate, 2)[:, 0], 0.02)
    assert before > 3
    assert after < 1.2
    assert trial.values["w_u_bilinear"] == pytest.approx(0.5, rel=0.05)


@pytest.mark.parametrize("of", ["w", "u"])
def test_a_channel_multiplies_the_state_or_the_input(of: str) -> None:
    """The second input, a flow, is carried as the imaginary part of what drives the walk."""
    u, flow = held(8), 1 + 0.5 * held(9, hold=20)

    def rate(x: np.ndarray, v: complex) -> np.ndarray:
        product = v.imag * x if of == "w" else v.imag * v.real
        return 2 * v.real - 1.5 * x - 0.4 * product

    y = walked(u + 1j * flow, rate)[:, 0]
    trial, before, after = tried("bilinear", OutputError(stable=True), u, y, 0.01, flow=flow)
    assert before > 3
    assert after < 1.2
    assert trial.label == f"flow times {of}"
    law = -0.4 * STEP if of == "w" else -0.4 / 2
    assert trial.values[f"{'w' if of == 'w' else 'input'}_bilinear"] == pytest.approx(law, rel=0.05)


def test_friction_that_an_effect_brought_is_no_outflow() -> None:
    mass = Model(
        "mass",
        (Parameter("gain", 0, 10),),
        (Line(signal("v")[t], sympy.Symbol("gain", real=True) * signal("u")[t], rate=True),),
        (Measurement("y", "v", "eta"),),
        sampling_time=STEP,
    )
    y = walked(held(3), lambda x, v: 2 * v - 1.5 * x)[:, 0]
    trial, _, after = tried("viscous_friction", mass, held(3), y, 0.01)
    assert after < 1.2
    assert trial.fit.model.origins
    data = Dataset.from_arrays(input={"u": held(3)}, output={"y": y}, sampling_time=STEP)
    assert not list(BY_NAME["square_root_outflow"].extensions(trial.fit.model, Site(data, "u", "y")))


CURVES = {
    "saturation": lambda x: np.clip(x, -0.25, 0.35),
    "dead zone": lambda x: x - np.clip(x, -0.2, 0.3),
    "diode": lambda x: np.where(x > 0.1, x - 0.1, 0.1 * (x - 0.1)) + 0.01,
}
LAWS = {
    "saturation": {"inner_limit_lower": -0.25, "inner_limit_upper": 0.35},
    "dead zone": {"inner_zone_lower": -0.2, "inner_zone_upper": 0.3},
    "diode": {"inner_blocked": 0.9, "inner_knee": 0.1},
}


@pytest.mark.parametrize("kind", CURVES)
def test_a_curve_between_two_lags(kind: str) -> None:
    def rate(x: np.ndarray, v: float) -> np.ndarray:
        return np.array([(v - x[0]) / 0.6, 2 * CURVES[kind](x[0]) - x[1] / 0.9])

    u = held(10)
    y = walked(u, rate, 2)[:, 1]
    trial, before, after = tried("inner_curve", OutputError(stable=True), u, y, 0.02)
    assert before > 3
    assert after < 1.2
    assert trial.label == f"{kind} at the input"
    assert {name: trial.values[name] for name in LAWS[kind]} == pytest.approx(LAWS[kind], abs=0.03)
    assert trial.values["inner_input_pole"] == pytest.approx(np.exp(-STEP / 0.6), abs=0.03)
