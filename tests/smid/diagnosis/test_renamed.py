"""A diagnosis is the same whatever the channels, signals, parameters and experiments are called, in any order."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pytest

from smid import Dataset
from smid.diagnosis import EFFECTS, Diagnosis, Site, diagnose
from smid.models import Line, Measurement, Model, Parameter, signal, simulate, t
from tests.smid.diagnosis.lag_records import lag, steps

OWN = ("u", "T", "y", "a", "b", "w", "eta")
NAMES = [
    ("volt", "temperature", "level", "pole", "slope", "state", "noise"),
    ("u", "T", "y", "friction", "speed_step_friction", "water_mean", "eta"),
    # Names that the effects themselves choose.
    ("time", "u_play", "y_joined", "p_drift", "gap", "u_lag", "zeta"),
    ("input_curve_1", "change_step", "w", "input", "speed", "sensor", "y"),
    ("input", "sensor", "output", "every_power", "a_with_b", "time", "u"),
    # A further channel with the name of a parameter, or of a signal.
    ("z", "a", "x", "a", "b", "c", "d"),
    ("z", "w", "x", "a1", "b0", "w", "eta"),
]
CASES = {
    "drift": ["parameter_drift", "missing_input", "sensor_drift"],
    "missing": ["missing_input", "scheduled_parameter", "sensor_drift", "hysteresis"],
}


def model(names: Mapping[str, str]) -> Model:
    """A lag; its hidden names are free of those of its own channels."""
    a, b = Parameter(names["a"], -1, 1), Parameter(names["b"], -5, 5)
    u, w = signal(names["u"]), signal(names["w"])
    line = Line(w[t], -a.symbol * w[t - 1] + b.symbol * u[t - 1])
    return Model("lag", (a, b), (line,), (Measurement(names["y"], names["w"], names["eta"]),))


def record(case: str, names: Mapping[str, str], *, reverse: bool = False) -> Dataset:
    rng = np.random.default_rng(1)
    u, temperature = steps(0, 300), np.cumsum(np.random.default_rng(2).normal(size=300))
    if case == "drift":
        y = np.zeros(300)
        for k in range(1, 300):
            y[k] = (0.8 - 0.3 * k / 300) * y[k - 1] + 0.5 * u[k - 1]
    else:
        y = lag(u + 0.05 * temperature)
    y = y + rng.uniform(-0.02, 0.02, 300)
    inputs = {names["u"]: u, names["T"]: temperature}
    ordered = dict(reversed(inputs.items())) if reverse else inputs
    name = "y" if reverse else names["y"]
    return Dataset.from_arrays(input=ordered, output={names["y"]: y}, sampling_time=0.1, name=name)


def found(case: str, names: Mapping[str, str], *, reverse: bool = False) -> Diagnosis:
    data = record(case, names, reverse=reverse)
    return diagnose(model(names), data, 0.02, effects=CASES[case], certify=False, workers=1)


@pytest.fixture(scope="module")
def plain() -> dict[str, Diagnosis]:
    return {case: found(case, dict(zip(OWN, OWN, strict=True))) for case in CASES}


@pytest.mark.parametrize("case", CASES)
@pytest.mark.parametrize("chosen", NAMES, ids=lambda names: "-".join(names[:3]))
def test_a_diagnosis_is_the_same_up_to_names(plain: dict[str, Diagnosis], case: str, chosen: tuple[str, ...]) -> None:
    names = dict(zip(OWN, chosen, strict=True))
    expected, other = plain[case], found(case, names, reverse=chosen != NAMES[0])
    assert other.verdict == expected.verdict
    assert [c.effect for c in other.causes] == [c.effect for c in expected.causes]
    assert other.gain.rmse_after == pytest.approx(expected.gain.rmse_after, rel=1e-3)
    for cause, before in zip(other.causes, expected.causes, strict=True):
        assert len(cause.label.split()) == len(before.label.split())
        assert [p.value for p in cause.parameters] == pytest.approx([p.value for p in before.parameters], rel=1e-2)
        assert [r.effect for r in cause.rivals] == [r.effect for r in before.rivals]
    # The names of the base model's own parameters are those that the user gave.
    own = [other.model.values[names[name]] for name in ("a", "b")]
    assert own == pytest.approx([expected.model.values[name] for name in ("a", "b")], rel=1e-2, abs=1e-3)


def _extensions(names: Mapping[str, str]) -> dict[str, list[tuple[int, int, np.ndarray]]]:
    """Return what every effect offers: numbers of parameters and lines, and the run at its first start."""
    data = record("missing", names)
    base = model(names).with_values({names["a"]: -0.8, names["b"]: 0.5})
    site = Site(data, names["u"], names["y"], (np.sin(np.arange(300.0)),))
    runs = {}
    for effect in EFFECTS:
        runs[effect.name] = [
            (
                len(item.model.parameters),
                len(item.model.lines),
                simulate(item.model, data.experiments[0].values, {**base.values, **item.starts[0]}, check=False)[
                    names["y"]
                ],
            )
            for item in effect.extensions(base, site)
        ]
    return runs


@pytest.mark.parametrize("chosen", NAMES[:6], ids=lambda names: "-".join(names[:3]))
def test_every_effect_offers_the_same_up_to_names(chosen: tuple[str, ...]) -> None:
    expected = _extensions(dict(zip(OWN, OWN, strict=True)))
    other = _extensions(dict(zip(OWN, chosen, strict=True)))
    for effect, before in expected.items():
        assert [item[:2] for item in other[effect]] == [item[:2] for item in before], effect
        for (*_, run), (*_, wanted) in zip(other[effect], before, strict=True):
            np.testing.assert_allclose(run, wanted, rtol=1e-6, atol=1e-9, err_msg=effect)


def test_an_effect_goes_on_an_effect_the_same_up_to_names() -> None:
    """Also where a parameter of the plant is called as one that an effect adds."""
    results = []
    for chosen in (OWN, ("u", "T", "y", "gain_drift", "bias", "memory", "eta")):
        names = dict(zip(OWN, chosen, strict=True))
        data, by_name = record("drift", names), {effect.name: effect for effect in EFFECTS}
        site = Site(data, names["u"], names["y"])
        grown = model(names).with_values({names["a"]: -0.8, names["b"]: 0.5})
        for effect in ("sensor_bias", "input_backlash", "hysteresis", "parameter_drift"):
            grown = next(iter(by_name[effect].extensions(grown, site))).model
        offered = [list(by_name[name].extensions(grown, site)) for name in ("parameter_change", "gain", "extra_lag")]
        results.append([[len(item.model.parameters) for item in each] for each in offered])
        assert set(grown.origins.values()) == {"sensor_bias", "input_backlash", "hysteresis", "parameter_drift"}
        stored = Model.from_dict(grown.to_dict())
        assert stored.origins == grown.origins
        assert replace(stored, origins={}).origins == {}
    assert results[0] == results[1]
