"""Effects of a package of one's own: nothing of smid is edited, and each is treated as one that ships."""

from collections.abc import Iterator, Mapping
from concurrent.futures import ProcessPoolExecutor
from functools import partial

import numpy as np
import pytest
import sympy

import smid
from smid.diagnosis import EFFECTS, Effect, Extension, Site, check_effect, diagnose
from smid.diagnosis.effects.effect import Detection
from smid.diagnosis.effects.parts.naming import fresh
from smid.models import Model, OutputError, signal, simulate, t

BOUND = 0.02


def weak_reverse(model: Model, site: Site) -> Iterator[Extension]:
    """Put a weaker input below zero on the model."""
    weakness = fresh(model, "weakness", (-1, 1), "", 0.0)
    weaker = model.insert_before(site.input, lambda u: u + weakness.symbol * sympy.Min(u, 0), [weakness])
    starts = ({weakness.name: -0.3}, {weakness.name: 0.3})
    yield Extension(weaker, starts, describe=partial(say, weakness.name))


def say(name: str, values: Mapping[str, float], site: Site) -> str:
    return f"Below zero {site.input} acts with {1 + values[name]:.2f} of its strength."


def leaking_memory(model: Model, site: Site) -> Iterator[Extension]:
    """Add a state of one's own, which is not taken for a state of the plant."""
    share = fresh(model, "memory_share", (-2, 2), "", 0.0)
    memory = signal("my_memory")
    if "my_memory" in model.names:
        return
    extended = model.with_line("my_memory", memory[t - 1] / 2 + signal(site.input)[t])
    yield Extension(
        extended.insert_sensor(site.output, lambda w: w + share.symbol * memory[t], [share]), ({share.name: 0.1},)
    )


def spikes(model: Model, site: Site) -> Detection | None:
    """Detect samples that are far from the free run."""
    masks = tuple(np.abs(residual) > 2.0 for residual in site.residual)
    count = float(sum(mask.sum() for mask in masks))
    return Detection(model, {"count": count}, 0.9, {}, glitches=masks) if count else None


WEAK = Effect("weak_reverse", "the input acts less below zero", weak_reverse)
MEMORY = Effect(
    "memory", "the sensor has a memory", leaking_memory, lambda values, _: f"Share {next(iter(values.values())):.2g}."
)
SPIKES = Effect(
    "spikes",
    "a few samples are far off",
    lambda _model, _site: (),
    lambda values, _: f"{values['count']:.0f} samples are spikes.",
    detect=spikes,
    marks_glitches=True,
)


def record(strength: float = 1.0, n: int = 300) -> smid.Dataset:
    rng = np.random.default_rng(0)
    u = np.repeat(rng.uniform(-1, 1, n // 6), 6)
    w = simulate(OutputError(), {"u": np.maximum(u, strength * u)}, {"a1": -0.8, "b0": 0.5})["y"]
    return smid.Dataset.from_arrays(input={"u": u}, output={"y": w + rng.uniform(-BOUND, BOUND, n)}, sampling_time=0.1)


def test_an_effect_of_ones_own_keeps_the_contract() -> None:
    check_effect(WEAK)


@pytest.mark.parametrize("workers", [1, 2])
def test_it_is_named_beside_those_that_ship_also_in_other_processes(workers: int) -> None:
    effects = [WEAK, "input_delay", "sensor_bias"]
    with ProcessPoolExecutor(workers) as pool:
        executor = pool if workers > 1 else None
        found = diagnose(OutputError(), record(0.6), BOUND, effects, certify=False, workers=1, executor=executor)
    assert [cause.effect for cause in found.causes] == ["weak_reverse"]
    assert found.causes[0].sentence == "Below zero u acts with 0.60 of its strength."
    assert dict(found.model.origins) == {"u_new": "weak_reverse", "weakness": "weak_reverse"}


def test_a_state_that_it_adds_is_not_one_of_the_plant() -> None:
    data = record()
    site = Site(data, "u", "y", (np.sin(np.arange(300.0)),))
    (extended,) = MEMORY.extensions(OutputError().with_values({"a1": -0.8, "b0": 0.5}), site)
    base = extended.model.with_values({"memory_share": 0.1})
    drift = next(effect for effect in EFFECTS if effect.name == "parameter_drift")
    labels = [item.label for item in drift.extensions(base, site)]
    assert labels == ["a1", "b0", "pace of w", "gain of w"]


def test_bad_samples_that_it_marks_are_left_out_of_every_fit() -> None:
    clean = record(0.6)
    y = clean.values("y").copy()
    y[[40, 130, 250]] += 9.0
    data = smid.Dataset.from_arrays(input={"u": clean.values("u")}, output={"y": y}, sampling_time=0.1)
    found = diagnose(OutputError(), data, BOUND, [SPIKES, WEAK, "input_delay"], certify=False, workers=1)
    assert [cause.effect for cause in found.causes] == ["spikes", "weak_reverse"]
    assert found.causes[0].sentence == "3 samples are spikes."
    assert found.gain.rmse_after < BOUND
