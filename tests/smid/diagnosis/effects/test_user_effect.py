"""An effect of a user's own, written as in a notebook cell, goes all the way."""

import json
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace

import numpy as np
import pytest

from smid import Parameter
from smid.diagnosis import Extension, check_effect, diagnose
from smid.diagnosis.effects.effect import on_the_noise
from smid.models import signal, t
from smid.reports.diagnosis_page import diagnosis_page
from tests.smid.diagnosis.lag_records import BOUND, LAG, dead_zone, lag, record, steps

CELL = """
from smid import Parameter
from smid.diagnosis import Effect, Extension


def extend(model, site):
    name = "leak" if "leak" not in {p.name for p in model.parameters} else "leak_again"
    target = next(line for line in model.lines if line.signal in ("w", "speed"))
    leak = Parameter(name, -10, 10, site.unit(site.output), 0.0)
    yield Extension(model.add_term(target.signal, leak.symbol, [leak]), ({name: 0.1},))


def describe(values, site):
    return f"The state gains {next(iter(values.values())):.3g} {site.unit(site.output)} each sample."


leak = Effect("leak", "the state leaks", extend, describe)
"""


def cell():
    """Run the cell in a module of its own that no process can import."""
    scope = {"__name__": "__main__"}
    exec(CELL, scope)
    return scope["leak"]


def leaking():
    u = steps(0, 300)
    return record(u, lag(u + 0.3))


def test_it_keeps_the_contract():
    check_effect(cell())


def test_it_is_named_among_those_that_ship():
    found = diagnose(LAG, leaking(), BOUND, [cell(), "input_delay", "input_dead_zone"], certify=False, workers=1)
    assert [c.effect for c in found.causes] == ["leak"]
    (cause,) = found.causes
    (size,) = cause.parameters
    assert size.lower <= 0.15 <= size.upper
    assert size.unit == "bar"
    assert "bar each sample" in cause.sentence
    assert found.gain.rmse_after < 1.2 * BOUND / np.sqrt(3)
    assert found.model.simulate(found.data).outputs[0]["y"].shape == (300,)
    json.dumps(found.to_dict(), allow_nan=False)


def test_asked_for_processes_it_stays_in_this_one(monkeypatch):
    """Other processes cannot import what a cell defines."""

    def refuse(*_arguments, **_options):
        raise AssertionError("a process was started")

    monkeypatch.setattr(ProcessPoolExecutor, "__init__", refuse)
    found = diagnose(LAG, leaking(), BOUND, [cell(), "input_delay"], certify=False, workers=2)
    assert [c.effect for c in found.causes] == ["leak"]


def test_one_that_lists_what_it_needs_is_skipped_with_it():
    shy = replace(cell(), extend=lambda *_: (), needs="a leaking vessel")
    found = diagnose(LAG, leaking(), BOUND, [shy], certify=False, workers=1)
    assert found.skipped == {"leak": "a leaking vessel"}
    assert found.verdict == "none"


def no_vessel(*_):
    raise LookupError("no vessel\nin sight")


FAILING = {
    "where it is put on the model": replace(cell(), extend=no_vessel),
    "where it is detected": replace(cell(), extend=on_the_noise, detect=no_vessel),
    "where it detects glitches": replace(cell(), extend=on_the_noise, detect=no_vessel, marks_glitches=True),
}


@pytest.mark.parametrize("workers", [1, 2])
@pytest.mark.parametrize("broken", FAILING.values(), ids=FAILING)
def test_one_that_raises_costs_only_itself(broken, workers):
    u = steps(1, 300)
    data, broken = record(u, lag(dead_zone(u, 0.4))), replace(broken, describe=no_vessel)
    found = diagnose(LAG, data, BOUND, [broken, "input_dead_zone", "input_delay"], certify=False, workers=workers)
    assert [c.effect for c in found.causes] == ["input_dead_zone"]
    assert found.skipped == {"leak": "LookupError: no vessel in sight"}
    assert found.failed == ("leak",)
    assert "Not tested: leak failed with LookupError: no vessel in sight" in str(found).splitlines()
    assert "not tested: it failed with LookupError: no vessel in sight" in str(diagnosis_page(found))


def test_one_that_raises_only_on_top_of_another_is_tried_without():
    def extend(model, site):
        if "leak" in model.origins.values():
            raise LookupError("leaks already")
        return cell().extend(model, site)

    found = diagnose(LAG, leaking(), BOUND, [replace(cell(), extend=extend)], certify=False, workers=1)
    assert [c.effect for c in found.causes] == ["leak"]
    assert (found.skipped, found.failed) == ({}, ())


def test_one_with_a_closure_stays_in_this_process():
    closed = replace(cell(), extend=lambda *given: cell().extend(*given), describe=no_vessel)
    found = diagnose(LAG, leaking(), BOUND, [closed, "input_delay"], certify=False, workers=2)
    assert [c.effect for c in found.causes] == ["leak"]


def test_one_whose_sentence_fails_is_named_all_the_same():
    found = diagnose(LAG, leaking(), BOUND, [replace(cell(), describe=no_vessel)], certify=False, workers=1)
    assert [c.sentence for c in found.causes] == ["Its description failed: LookupError: no vessel in sight."]


def test_one_whose_model_diverges_from_every_start_is_skipped_with_the_cure():
    def extend(model, _site):
        grows = Parameter("grows", 0.0, 9.0, "", 0.0)
        w = signal("w")
        yield Extension(model.add_term("w", grows.symbol * (1 + w[t - 1] ** 2), [grows]), ({"grows": 9.0},))

    found = diagnose(LAG, leaking(), BOUND, [replace(cell(), extend=extend), "sensor_bias"], certify=False, workers=1)
    assert [c.effect for c in found.causes] == ["sensor_bias"]
    assert "infinity or NaN from every start" in found.skipped["leak"]
    assert "bound its parameters" in found.skipped["leak"]
