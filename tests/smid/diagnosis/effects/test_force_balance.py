"""Friction in a static force balance: the output is a force, and the speed is a channel or the change of one."""

import numpy as np
import pytest

from smid import Dataset, Model, OutputError, Parameter
from smid.diagnosis import diagnose
from smid.diagnosis.effects import coulomb_friction, load_friction, stribeck_friction, viscous_friction
from smid.diagnosis.effects.check import Case, check_on
from smid.diagnosis.effects.effect import Site
from smid.models import Line, Measurement, signal, t

FRICTIONS = ["coulomb_friction", "load_friction", "stribeck_friction", "viscous_friction"]
OTHERS = ["sensor_bias", "input_delay", "input_dead_zone", "gain"]
EFFECTS = [coulomb_friction, load_friction, stribeck_friction, viscous_friction]
K, C, LOSS, BOUND, N, STEP = 40.0, 2.0, 3.0, 0.2, 500, 0.01
SPRING, DAMPER = Parameter("p1", -1e3, 1e3), Parameter("p2", -1e3, 1e3)


def balance(position="x", speed="v"):
    """F = k x + c v of two channels; without a channel for the speed, of the position alone."""
    x = signal(position)
    v = signal(speed)[t] if speed else (x[t] - x[t - 1]) / STEP
    line = Line(signal("f")[t], SPRING.symbol * x[t] + DAMPER.symbol * v)
    return Model("balance", (SPRING, DAMPER), (line,), (Measurement("F", "f", "noise"),))


def motion(seed=0):
    """A position of a few sines and its backward difference per second."""
    phases = np.random.default_rng(seed).uniform(0, 2 * np.pi, 3)
    waves = zip((0.4, 0.2, 0.1), (2.1, 5.3, 9.7), phases, strict=True)
    x = sum(a * np.sin(f * STEP * np.arange(-1, N) + p) for a, f, p in waves)
    return x[1:], np.diff(x) / STEP


def record(force, names=("x", "v"), speed=True, **others):
    x, v = motion()
    noise = np.random.default_rng([1, 0]).uniform(-BOUND, BOUND, N)
    inputs = {names[0]: x, **({names[1]: v} if speed else {}), **others}
    return Dataset.from_arrays(input=inputs, output={"F": force + noise}, sampling_time=STEP, units={"F": "N"})


def rubbed(load=1.0):
    x, v = motion()
    return K * x + C * v + LOSS * load * np.sign(v)


@pytest.mark.parametrize("names", [("x", "v"), ("v", "position")])
def test_coulomb_friction_is_found_whatever_the_channels_are_called(names):
    found = diagnose(balance(*names), record(rubbed(), names), BOUND, FRICTIONS + OTHERS, certify=False, workers=1)
    assert [c.effect for c in found.causes] == ["coulomb_friction"]
    force = found.causes[0].parameters[0]
    assert force.lower <= LOSS <= force.upper
    assert f"{force.value:.3g} N" in found.causes[0].sentence
    assert found.gain.rmse_after < 0.2 * found.gain.rmse_before


def test_the_speed_may_be_a_difference_in_the_model():
    data = record(rubbed(), speed=False)
    found = diagnose(balance(speed=None), data, BOUND, FRICTIONS + OTHERS, certify=False, workers=1)
    assert [c.effect for c in found.causes] == ["coulomb_friction"]
    assert "the change of x" in found.causes[0].sentence


def test_a_load_presses_on_it():
    load = 2.0 + np.repeat(np.random.default_rng(3).uniform(-2, 2, N // 20), 20)
    data = record(rubbed(load), load=load)
    found = diagnose(balance(), data, BOUND, FRICTIONS + OTHERS, certify=False, workers=1)
    assert [c.effect for c in found.causes] == ["load_friction"]
    force = found.causes[0].parameters[0]
    assert force.lower <= LOSS * load[: round(0.8 * N)].max() <= force.upper


def test_a_balance_without_friction_names_none():
    x, v = motion()
    found = diagnose(balance(), record(K * x + C * v), BOUND, FRICTIONS + OTHERS, certify=False, workers=1)
    assert found.verdict == "none"


def test_a_missing_damper_is_viscous_friction():
    x, v = motion()
    spring = Model("spring", (SPRING,), (Line(signal("f")[t], SPRING.symbol * signal("x")[t]),), balance().measurements)
    data = record(K * x + C * v, speed=False)
    found = diagnose(spring, data, BOUND, ["viscous_friction", "coulomb_friction"], certify=False, workers=1)
    assert [c.effect for c in found.causes] == ["viscous_friction"]
    assert found.causes[0].parameters[0].value * STEP == pytest.approx(C, rel=0.02)


@pytest.mark.parametrize("effect", EFFECTS)
@pytest.mark.parametrize("speed", ["v", None])
def test_friction_keeps_the_contract_on_a_force_balance(effect, speed):
    data = record(rubbed(), speed=bool(speed), load=1.5 + np.sin(np.arange(N)))
    model = balance(speed=speed).with_values({"p1": K, "p2": C})
    applies = check_on(effect.EFFECT, Case("a force balance", model, Site(data, "x", "F", (np.zeros(N),))))
    # The position, and the speed where it is a channel, have a difference that the model lacks.
    assert applies == (effect is not viscous_friction or speed == "v")


@pytest.mark.parametrize("effect", EFFECTS)
def test_a_difference_equation_is_no_force_balance(effect):
    """Only the output of a static model takes the force; a plant with a state has motions."""
    data = record(rubbed(), ("u", "v"))
    labels = [e.label for e in effect.EFFECT.extensions(OutputError(output="F"), Site(data, "u", "F"))]
    assert not any("force" in label for label in labels)
