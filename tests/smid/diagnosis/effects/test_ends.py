"""An effect acts on every input, state and output of the base model, whatever these are called."""

import re

import numpy as np
import pytest
from scipy.signal import lfilter

from benchmarks.blind.plants import Friction, Plant, Twist, simulate
from relaxations.algebra.arrays import Array
from smid import Dataset, Model, OutputError, Parameter
from smid.diagnosis.effects import (
    bilinear,
    coulomb_friction,
    inner_curve,
    input_dead_zone,
    input_delay,
    missing_input,
    sensor_bias,
    stiffness,
    valve_stiction,
)
from smid.diagnosis.effects.effect import Effect
from smid.diagnosis.search.trial import Trial, fitted_base, try_effect
from smid.models import Line, Measurement, signal, t
from tests.smid.diagnosis.lag_records import steps

N = 400


def tried(effect: Effect, model: Model, data: Dataset) -> tuple[Trial, str]:
    """Fit an effect to a record, and say it."""
    used = (np.ones(N, bool),)
    base = fitted_base(model, data, used, model.input_channels[0], model.output_channels[0])
    trial = try_effect(effect, base)
    assert trial is not None
    assert trial.describe is not None
    return trial, trial.describe(trial.values, base.site())


def assert_recovered(trial: Trial, data: Dataset, noise: dict[str, Array]) -> None:
    for channel, error in noise.items():
        left = np.concatenate(trial.fit.residual(data, channel))
        assert np.sqrt(np.mean(left**2)) <= 1.2 * np.sqrt(np.mean(error**2))


def noise(seed: int, size: float) -> Array:
    return np.random.default_rng(seed).uniform(-size, size, N)


def lag(state: str, pole: str, *inputs: str) -> Model:
    """A lag of some inputs; its parameters are the pole and a gain of each input."""
    a, gains = Parameter(pole, -5, 5), [Parameter(f"k{i}", -5, 5) for i in range(len(inputs))]
    w = signal(state)
    drive = sum(k.symbol * signal(name)[t - 1] for k, name in zip(gains, inputs, strict=True))
    return Model("lag", (a, *gains), (Line(w[t], a.symbol * w[t - 1] + drive),), (Measurement("y", state, "eta"),))


@pytest.mark.parametrize(("first", "second"), [("a", "b"), ("b", "a")])
def test_a_dead_zone_of_the_second_input_is_found(first: str, second: str) -> None:
    """Whichever name comes first."""
    plain, dead = steps(1, N), steps(2, N)
    acting = np.where(np.abs(dead) > 0.4, dead - 0.4 * np.sign(dead), 0.0)
    y, error = np.zeros(N), noise(3, 0.02)
    for i in range(1, N):
        y[i] = 0.8 * y[i - 1] + 0.3 * plain[i - 1] + 0.5 * acting[i - 1]
    data = Dataset.from_arrays(input={first: plain, second: dead}, output={"y": y + error}, sampling_time=0.1)
    trial, said = tried(input_dead_zone.EFFECT, lag("w", "pole", first, second), data)
    assert_recovered(trial, data, {"y": error})
    assert trial.label in (f"symmetric, {second}", f"two sides, {second}")
    assert said.endswith(f" {second} has no effect.")


def test_a_bias_of_the_second_output_is_found() -> None:
    a, k, c = (Parameter(name, -5, 5) for name in ("a", "k", "c"))
    w, v = signal("w"), signal("v")
    lines = (
        Line(w[t], a.symbol * w[t - 1] + k.symbol * signal("u")[t - 1]),
        Line(v[t], c.symbol * v[t - 1] + (1 - c.symbol) * w[t - 1]),
    )
    seen = (Measurement("y", "w", "eta"), Measurement("z", "v", "zeta"))
    u = steps(1, N)
    y, z = np.zeros(N), np.zeros(N)
    for i in range(1, N):
        y[i] = 0.8 * y[i - 1] + 0.5 * u[i - 1]
        z[i] = 0.9 * z[i - 1] + 0.1 * y[i - 1]
    errors = {"y": noise(3, 0.02), "z": noise(4, 0.02)}
    outputs = {"y": y + errors["y"], "z": z + 0.3 + errors["z"]}
    data = Dataset.from_arrays(input={"u": u}, output=outputs, sampling_time=0.1)
    trial, said = tried(sensor_bias.EFFECT, Model("two outputs", (a, k, c), lines, seen), data)
    assert_recovered(trial, data, errors)
    assert trial.label == "z"
    assert said.startswith("The sensor of z shows 0.3")


def test_friction_of_a_model_with_a_parameter_called_friction_is_found() -> None:
    u, error = steps(1, N, hold=12), noise(3, 0.01)
    plant = Plant("arm_speed", 0.1, -1, 1, "u", "y", 2.0, 1.0)
    speed = simulate(plant, Twist(friction=Friction(sliding=0.5, breakaway=0.5)), u)
    data = Dataset.from_arrays(input={"u": u}, output={"y": speed + error}, sampling_time=0.1)
    trial, _ = tried(coulomb_friction.EFFECT, lag("speed", "friction", "u"), data)
    assert_recovered(trial, data, {"y": error})
    assert set(trial.fit.model.values) - set(trial.values) == {"friction", "k0"}
    # The force takes its part of (1 - exp(-0.1 s / 1 s)) 1 s from the speed in every sample.
    assert next(iter(trial.values.values())) == pytest.approx(0.5 * (1 - np.exp(-0.1)), rel=0.05)


def test_a_delay_of_a_model_with_a_state_called_water_mean_is_found() -> None:
    u, error = steps(1, N), noise(3, 0.02)
    y = np.zeros(N)
    for i in range(3, N):
        y[i] = 0.8 * y[i - 1] + 0.5 * u[i - 3]
    data = Dataset.from_arrays(input={"u": u}, output={"y": y + error}, sampling_time=0.1)
    trial, said = tried(input_delay.EFFECT, lag("water_mean", "pole", "u"), data)
    assert_recovered(trial, data, {"y": error})
    assert said == "u acts 0.2 s (2 samples) later."


def apart() -> Model:
    """A lag of one input that y shows, and a state of order two of another input that z shows."""
    names = ("a", "k", "c1", "c2", "b1", "b2")
    a, k, c1, c2, b1, b2 = (Parameter(name, -5, 5).symbol for name in names)
    w, x, u, v = (signal(name) for name in ("w", "x", "u", "v"))
    lines = (
        Line(w[t], a * w[t - 1] + k * u[t - 1]),
        Line(x[t], c1 * x[t - 1] + c2 * x[t - 2] + b1 * v[t - 1] + b2 * v[t - 2]),
    )
    seen = (Measurement("y", "w", "eta"), Measurement("z", "x", "zeta"))
    return Model("apart", tuple(Parameter(name, -5, 5) for name in names), lines, seen)


def two_records(
    acting: Array, given: Array, cube: float = 0.0, product: float = 0.0
) -> tuple[Dataset, dict[str, Array]]:
    """Drive both; the second, walked in small steps, by `acting`, of which `given` is recorded.

    Its channels are in small units, so that their numbers are large.
    """
    u, y, z, x, speed, fine = steps(1, N), np.zeros(N), np.zeros(N), 0.0, 0.0, 50
    for i in range(1, N):
        y[i] = 0.8 * y[i - 1] + 0.5 * u[i - 1]
        for _ in range(fine):
            middle = x + speed / (2 * fine)
            push = 0.04 * acting[i - 1] - 0.04 * middle - cube * middle**3 + product * u[i - 1] * middle
            speed = speed + (push - 0.08 * speed) / fine
            x = middle + speed / (2 * fine)
        z[i] = x
    errors = {"y": noise(3, 0.02), "z": 1000 * noise(4, 0.02)}
    outputs = {"y": y + errors["y"], "z": 1000 * z + errors["z"]}
    data = Dataset.from_arrays(input={"u": u, "v": 100 * given}, output=outputs, sampling_time=0.1)
    return data, errors


def test_a_spring_behind_the_second_output_is_found() -> None:
    v = steps(2, N)
    data, errors = two_records(v, v, cube=0.08)
    trial, said = tried(stiffness.EFFECT, apart(), data)
    assert_recovered(trial, data, errors)
    (cubic,) = (one for one in (trial, *trial.tied) if one.label == "cubic on x, z")
    assert cubic.values["spring_cube"] == pytest.approx(0.08e-6, rel=0.1)
    # Beside the cube, a square is next to nothing.
    reach = np.abs(data.values("z")).max()
    assert abs(trial.values.get("spring_square", 0.0)) < 0.02 * trial.values["spring_cube"] * reach
    assert "z^3" in said


def test_a_valve_at_the_second_input_that_the_second_output_shows_is_found() -> None:
    command = steps(2, N)
    stem, valve = command[0], np.zeros(N)
    for i, now in enumerate(command):
        if abs(now - stem) > 0.3:
            stem = now - 0.1 * np.sign(now - stem)
        valve[i] = stem
    data, errors = two_records(valve, command)
    trial, said = tried(valve_stiction.EFFECT, apart(), data)
    assert_recovered(trial, data, errors)
    assert trial.label == "v"
    assert trial.values["slip_jump"] == pytest.approx(20, rel=0.2)
    assert said.startswith("A valve sticks behind v:")


def test_a_curve_behind_a_lag_of_the_second_input_is_found() -> None:
    v = steps(2, N)
    inner = np.zeros(N)
    for i in range(1, N):
        inner[i] = 0.8 * inner[i - 1] + 0.1 * (v[i] + v[i - 1])
    data, errors = two_records(np.clip(inner, -0.3, 0.4), v)
    trial, said = tried(inner_curve.EFFECT, apart(), data)
    assert_recovered(trial, data, errors)
    assert trial.label == "saturation at the input, v"
    assert trial.values["inner_limit_upper"] == pytest.approx(40, rel=0.1)
    assert said.startswith("A curve lies behind a lag of v ")


def test_the_first_input_that_multiplies_a_state_of_the_second_is_found() -> None:
    v = steps(2, N)
    data, errors = two_records(v, v, product=0.02)
    trial, _ = tried(bilinear.EFFECT, apart(), data)
    assert_recovered(trial, data, errors)
    assert trial.label == "u times x, v"


def test_a_loss_to_a_recorded_channel_is_found() -> None:
    """The difference acts: neither the channel nor the state alone explains it."""
    heat, around = steps(1, N), 5 * np.sin(np.arange(N) / 40)
    y, error = np.zeros(N), noise(3, 0.02)
    for k in range(1, N):
        y[k] = y[k - 1] + 0.5 * heat[k - 1] + 0.02 * (around[k - 1] - y[k - 1])
    data = Dataset.from_arrays(
        input={"u": heat}, output={"y": y + error}, sampling_time=1.0, ambient=around, units={"y": "K", "ambient": "K"}
    )
    gain, w = Parameter("k", -5, 5), signal("w")
    store = Model(
        "store", (gain,), (Line(w[t], w[t - 1] + gain.symbol * signal("u")[t - 1]),), (Measurement("y", "w", "eta"),)
    )
    trial, said = tried(missing_input.EFFECT, store, data)
    assert_recovered(trial, data, {"y": error})
    assert trial.label == "ambient minus w"
    assert trial.values["ambient_exchange_w"] == pytest.approx(0.02, rel=0.05)
    assert said.startswith("y goes to ambient: in each sample by 2")


def test_a_disturbance_that_comes_through_a_lag_of_its_own_is_found() -> None:
    u, flow, error = steps(1, N), 20 + 5 * steps(2, N), noise(3, 0.01)
    w = lfilter([0, 0.5], [1, -0.8], u) + 0.3 * lfilter([0.1], [1, -0.9], flow - flow.mean())
    data = Dataset.from_arrays(
        input={"u": u}, output={"y": w + error}, sampling_time=2.0, flow=flow, units={"y": "K", "flow": "l/s"}
    )
    trial, said = tried(missing_input.EFFECT, OutputError(), data)
    assert_recovered(trial, data, {"y": error})
    assert trial.label == "flow behind a lag at the sensor"
    assert trial.values["flow_missing_pole"] == pytest.approx(0.9, abs=0.01)
    assert re.search(r"with a time constant of (18|19|20)(\.\d)? s\.$", said)
