"""Every effect keeps the contract on every base model, and so does one of a user's own; a broken one is told why."""

from collections.abc import Iterator, Mapping
from dataclasses import replace

import numpy as np
import pytest
import sympy

from smid import Dataset, OutputError
from smid.diagnosis.effects import (
    EFFECTS,
    Effect,
    Extension,
    Site,
    check_effect,
    coulomb_friction,
    direction_dependence,
    operating_point,
)
from smid.diagnosis.effects.check import Case, cases, check_on
from smid.models import Model, Parameter, simulate

# What applies to fewer models than all, and why; everything else must apply to each.
SELECTIVE = {
    "input_noise",
    "outliers",
    "quantisation",
    "multiplicative_noise",
    "scheduled_parameter",
    "missing_input",
    "viscous_friction",
    "stiffness",
    "gravity",
    "power_law",
    "square_root_outflow",
    "time_constant",
    "sensor_lag",
    "input_bias",
    "variable_delay",
    "load_friction",
}


# What reads a further channel.
READING = ("scheduled_parameter", "missing_input", "variable_delay", "load_friction")
# Beside a channel, the last case is the first again: only an effect that looks at channels sees a difference.
*PLAIN, WITH_A_CHANNEL = cases()
PAIRS = [(effect, case) for effect in EFFECTS for case in PLAIN]
PAIRS += [(effect, WITH_A_CHANNEL) for effect in EFFECTS if effect.name in (*READING, "bilinear", "hysteresis")]


@pytest.mark.parametrize(("effect", "case"), PAIRS, ids=[f"{e.name}-{c.name.replace(' ', '-')}" for e, c in PAIRS])
def test_an_effect_keeps_the_contract(effect: Effect, case: Case) -> None:
    applies = check_on(effect, case)
    assert applies or effect.name in SELECTIVE


def test_each_selective_effect_applies_where_it_should() -> None:
    by_name = {effect.name: effect for effect in EFFECTS}

    def applies(name: str, case: Case) -> bool:
        return any(True for _ in by_name[name].extend(case.model, case.site))

    kinds = [case.name for case in cases()]
    for effect in READING:
        assert [applies(effect, case) for case in cases()] == [name == "a lag with a temperature" for name in kinds]
    assert [applies("sensor_lag", case) for case in cases()] == [name == "a lag seen twice" for name in kinds]
    positions = ["a swinging second order", "the arm"]
    for effect in ("stiffness", "gravity"):
        assert [applies(effect, case) for case in cases()] == [name in positions for name in kinds]
    assert [applies("viscous_friction", case) for case in cases()] == [name == "the arm" for name in kinds]
    assert [applies("square_root_outflow", case) for case in cases()] == [name not in positions for name in kinds]
    assert [applies("power_law", case) for case in cases()] == [name != "the arm" for name in kinds]


def test_names_are_unique() -> None:
    names = [effect.name for effect in EFFECTS]
    assert len(set(names)) == len(names)


def _leak(model: Model, site: Site, null: float | None = 0.0, push: float = 1.0) -> Iterator[Extension]:
    del site
    name = "leak" if "leak" not in {p.name for p in model.parameters} else "leak_again"
    shift = Parameter(name, -10, 10, "", null)
    target = next(line for line in model.lines if line.signal in ("w", "speed"))
    yield Extension(model.add_term(target.signal, push * shift.symbol, [shift]), ({name: 0.1},))


def _say(values: Mapping[str, float], site: Site) -> str:
    return f"{site.output} leaks {next(iter(values.values())):.3g}."


OWN = Effect("leak", "the state leaks", _leak, _say)


def test_an_effect_of_ones_own_passes() -> None:
    check_effect(OWN)


@pytest.mark.parametrize(
    ("broken", "message"),
    [
        (replace(OWN, extend=lambda m, s: _leak(m, s, None)), "no new parameter has a null value"),
        (replace(OWN, extend=lambda m, s: _leak(m, s, 1.0)), "off the base model"),
        (replace(OWN, extend=lambda m, s: _leak(m, s, 0.0, 0.0)), "is the base model's"),
        (replace(OWN, describe=lambda *_: "It leaks."), "gives no number"),
        (replace(OWN, describe=lambda *_: "It leaks 3"), "no sentence"),
        (replace(OWN, extend=lambda *_: ()), "applies to none"),
        (replace(OWN, summary="It leaks."), "full stop"),
        (replace(OWN, describe=None), "has a describe"),
        (replace(OWN, name="A leak"), "snake_case"),
    ],
)
def test_a_broken_effect_is_told_why(broken: Effect, message: str) -> None:
    with pytest.raises(AssertionError, match=message):
        check_effect(broken)


def test_a_start_outside_its_box_is_told() -> None:
    def extend(model: Model, site: Site) -> Iterator[Extension]:
        for extension in _leak(model, site):
            yield replace(extension, starts=({"leak": 11.0},))

    with pytest.raises(AssertionError, match="not in its box"):
        check_effect(replace(OWN, extend=extend))


def test_an_effect_that_drops_a_parameter_is_told() -> None:
    def extend(model: Model, site: Site) -> Iterator[Extension]:
        for extension in _leak(model, site):
            yield replace(extension, model=extension.model.substitute("b0", sympy.Integer(1)))

    with pytest.raises(AssertionError, match="drops"):
        check_effect(replace(OWN, extend=extend))


def test_dry_friction_is_exact_along_a_step() -> None:
    """A lag under a held force that changes at every sample, stick and slip told apart in a thousandth of a step."""
    rng, n, fine = np.random.default_rng(0), 60, 1000
    force, speed, v, friction = rng.uniform(-2, 2, n), np.zeros(n), 0.0, 0.7
    for k in range(1, n):
        for _ in range(fine):
            v += (force[k - 1] - 0.2 * v) / fine
            v = float(np.sign(v)) * max(abs(v) - friction / fine, 0.0)
        speed[k] = v
    data = Dataset.from_arrays(input={"u": force}, output={"y": speed}, sampling_time=1.0)
    extension = next(coulomb_friction.EFFECT.extend(OutputError(), Site(data, "u", "y")))
    held = -np.expm1(-0.2) / 0.2  # what a constant force of one does within a step
    values = {"a1": -np.exp(-0.2), "b0": held, "speed_step_friction": friction * held}
    simulated = simulate(extension.model, data.experiments[0].values, values)["y"]
    assert np.abs(simulated - speed).max() < 2e-3 * np.abs(speed).max()


@pytest.mark.parametrize(("speeds", "offered"), [((2.0, -3.0), True), ((2.0, 3.0), False)])
def test_dry_friction_is_offered_where_only_experiments_differ_in_direction(
    speeds: tuple[float, float], offered: bool
) -> None:
    """In each of them it is a constant force."""
    runs = [
        Dataset.from_arrays(input={"u": np.ones(60)}, output={"y": np.full(60, v)}, sampling_time=1.0, name=f"{v}")
        for v in speeds
    ]
    assert bool([*coulomb_friction.EFFECT.extend(OutputError(), Site(Dataset.merge(runs), "u", "y"))]) == offered


def test_a_direction_bends_what_a_pace_between_two_levels_makes_of_a_step() -> None:
    rng = np.random.default_rng(0)
    data = Dataset.from_arrays(input={"u": rng.uniform(0, 5, 60)}, output={"y": np.zeros(60)}, sampling_time=1.0)
    inputs, site = data.experiments[0].values, Site(data, "u", "y", (np.zeros(60),))
    offered = operating_point.EFFECT.extend(OutputError(offset=True, stable=True), site)
    varying = next(x.model for x in offered if x.label == "pace of w between two levels")
    bent = next(x.model for x in direction_dependence.EFFECT.extend(varying, site) if x.label == "w rising and falling")
    values = {p.name: 0.3 for p in varying.parameters} | {"a1": -0.5}
    seen = simulate(bent, inputs, values | {"w_directional": 0.4}, {"w": [0.1]})["y"]
    for k in range(1, 60):
        step = {name: x[k - 1 : k + 1] for name, x in inputs.items()}
        plain = simulate(varying, step, values, {"w": [seen[k - 1]]})["y"][1] - seen[k - 1]
        assert seen[k] - seen[k - 1] == pytest.approx(plain + 0.4 * abs(plain), abs=1e-12)
