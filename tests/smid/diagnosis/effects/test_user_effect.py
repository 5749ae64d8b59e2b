"""An effect of a user's own, written as in a notebook cell, goes all the way."""

import json
from concurrent.futures import ProcessPoolExecutor

import numpy as np

from smid.diagnosis import check_effect, diagnose
from tests.smid.diagnosis.lag_records import BOUND, LAG, lag, record, steps

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
    from dataclasses import replace

    shy = replace(cell(), extend=lambda *_: (), needs="a leaking vessel")
    found = diagnose(LAG, leaking(), BOUND, [shy], certify=False, workers=1)
    assert found.skipped == {"leak": "a leaking vessel"}
    assert found.verdict == "none"
