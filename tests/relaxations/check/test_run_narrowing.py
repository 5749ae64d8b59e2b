"""A box narrowed without a run keeps the truth, whatever values and modulating functions a file states."""

import copy
import math
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from relaxations.check import Refused, Unreadable, runs
from relaxations.check.runs import read
from relaxations.check.runs.comparison import flow
from relaxations.check.runs.fixed import ONE
from relaxations.check.runs.narrowing import Bounded, Narrowed
from relaxations.check.runs.terms import Terms

H, N, FINE = 0.125, 20, 200
# Rates as text and as a function of the states, the input, and both constants; what multiplies each product of these.
PLANTS: dict[str, Any] = {
    "pendulum": (
        {"x": "v[t]", "v": "u[t - 1] - a*sin(x[t]) - b*v[t]"},
        lambda x, u, a, b: (x[1], u - a * math.sin(x[0]) - b * x[1]),
        lambda x, *_: {(0,): -math.sin(x[0]), (1,): -x[1]},
    ),
    "drag": (
        {"x": "v[t]", "v": "a*b*u[t - 1] - b*Abs(v[t])*v[t]"},
        lambda x, u, a, b: (x[1], a * b * u - b * abs(x[1]) * x[1]),
        lambda x, u: {(0, 1): u, (1,): -abs(x[1]) * x[1]},
    ),
    "leak": (
        {"x": "b*Abs(u[t - 1]) - a*x[t]**2"},
        lambda x, u, a, b: (b * abs(u) - a * x[0] ** 2,),
        lambda x, u: {(0,): -(x[0] ** 2), (1,): abs(u)},
    ),
    "dry friction": (
        {"x": "v[t]", "v": "2*u[t - 1] - a*sign(v[t]) - b*v[t]"},
        lambda x, u, a, b: (x[1], 2 * u - a * math.copysign(1, x[1]) - b * x[1]),
        lambda x, *_: {(0,): -math.copysign(1, x[1]), (1,): -x[1]},
    ),
}


def simulated(name: str, inputs: np.ndarray, a: float, b: float) -> np.ndarray:
    """Return the states at the samples, by steps far below the time between these; friction may hold a mass."""
    rates, states, step = PLANTS[name][1], [np.array([0.2, 0.3][: len(PLANTS[name][0])])], H / FINE
    for u in inputs[:-1]:
        x = states[-1].copy()
        for _ in range(FINE):
            first = np.array(rates(x, u, a, b))
            second = np.array(rates(x + step * first, u, a, b))
            after = x + 0.5 * step * (first + second)
            if name == "dry friction" and after[1] * x[1] <= 0:
                after = np.array([x[0], 0.0 if abs(2 * u) <= a else math.copysign(step * (abs(2 * u) - a), u)])
            x = after
        states.append(x)
    return np.array(states)


def posed(name: str, seed: int, bound: float) -> tuple[dict[str, Any], np.ndarray, tuple[float, float]]:
    """Return a file without steps, the true states and the true constants."""
    rng = np.random.default_rng(seed)
    a, b = rng.uniform(0.4, 1.5, 2)
    inputs = np.repeat(rng.uniform(-3, 3, N), 4)[:N]
    states = simulated(name, inputs, a, b)
    measured = states[:, 0] + rng.uniform(-bound, bound, N)
    texts = PLANTS[name][0]
    content = {
        "format": read.FORMAT,
        "version": read.VERSION,
        "model": {
            "name": name,
            "parameters": {"a": [0, 20], "b": ["1/10", 20]},
            "rates": texts,
            "interval": H.hex(),
            "lines": {},
            "measurements": [{"channel": "y", "signal": "x", "noise": "eta", "inverse": None}],
            "constraints": [],
        },
        "noise_bounds": {"y": (bound + 1e-6).hex()},
        "first": dict.fromkeys(texts, 1),
        "initial": [],
        "experiments": [
            {
                "name": "run",
                "samples": N,
                "channels": {"y": [y.hex() for y in measured.tolist()], "u": [u.hex() for u in inputs.tolist()]},
            }
        ],
        "symbols": 4,
        "steps": 1,
        "claim": None,
        "boxes": [],
    }
    return content, states, (float(a), float(b))


def modulation(name: str, states: np.ndarray, inputs: list[float], factors: Any, kind: str, seed: int) -> list[Any]:
    """Return a modulating function: one that nearly isolates a coefficient, or any."""
    rng, state = np.random.default_rng(seed), len(PLANTS[name][0]) - 1
    table = [PLANTS[name][2](x, u) for x, u in zip(states, inputs, strict=True)]
    if kind == "isolating" and factors in table[0]:
        others = [[own[key] for key in own if key != factors] for own in table]
        knots = np.linalg.pinv(np.column_stack([[own[factors] for own in table], others, np.ones(N)]))[0]
    else:
        knots = rng.normal(size=N)
    jumps = rng.normal(size=(2, N - 1)) * (0.1 if kind == "jumping" else 0.0)
    ends = zip((knots[:-1] + jumps[0]).tolist(), (knots[1:] + jumps[1]).tolist(), strict=True)
    return [(0, state, k + 1, round(1e6 * a), round(1e6 * b)) for k, (a, b) in enumerate(ends)]


@settings(max_examples=25, deadline=None)
@given(
    st.sampled_from(list(PLANTS)),
    st.integers(0, 2**32 - 1),
    st.sampled_from([0.0005, 0.01]),
    st.lists(st.sampled_from(["compare", "isolating", "any", "jumping"]), min_size=3, max_size=6),
)
def test_no_values_and_no_modulating_functions_exclude_the_truth(name, seed, bound, kinds) -> None:
    content, states, (a, b) = posed(name, seed, bound)
    stated = read.document(content).stated
    known, i = Narrowed.of(stated), len(PLANTS[name][0]) - 1
    inputs = [float.fromhex(u) for u in content["experiments"][0]["channels"]["u"]]
    true = {(0,): a, (1,): b, (0, 1): a * b}
    slack = 2e-3 if name == "dry friction" else 1e-5  # of the simulation
    for number, kind in enumerate(["compare", "isolating", *kinds]):
        if kind == "compare":
            edges = [round(edge * ONE) for edge in (-4, -2, -1, -1e-9, 1e-9, 1, 2, 4)]
            upwards = known.cells(0, i, edges)
            for side in (1, -1):
                for k, value in enumerate(states[:, i].tolist()):
                    for beyond in (2, 0.5, 0.1, 0.02, 0.0, -0.01):
                        tried = round((side * value + beyond) * ONE)
                        if tried < upwards.high[k] and upwards.is_impossible(k, tried):
                            assert beyond >= 0
                            upwards.high[k] = tried
                upwards = upwards.mirrored()
            known.compared(0, i, upwards.mirrored())
        else:
            for target, own in enumerate(stated.terms.coefficients):
                modulating = modulation(name, states, inputs, own.factors, kind, seed + number)
                known.take(Bounded([(target, modulating)]))
        assert not known.empty
        for (low, high), value in zip(known.box, (a, b), strict=True):
            assert low / ONE - slack <= value <= high / ONE + slack
        for own, (low, high) in zip(stated.terms.coefficients, known.products, strict=True):
            value = true.get(tuple(sorted(own.factors)), 1.0)
            assert low / ONE - slack <= value <= high / ONE + slack
        for tube, values in zip(known.tubes[0], states.T, strict=True):
            for low, high, value in zip(tube.low, tube.high, values.tolist(), strict=True):
                assert low / ONE - slack <= value <= high / ONE + slack


@pytest.mark.parametrize("name", PLANTS)
def test_a_modulating_function_bounds_its_coefficient(name: str) -> None:
    content, states, _ = posed(name, 5, 0.0005)
    stated = read.document(content).stated
    known, inputs = Narrowed.of(stated), [float.fromhex(u) for u in content["experiments"][0]["channels"]["u"]]
    # Where the states are known within little, so are the coefficients.
    for tube, values in zip(known.tubes[0], states.T.tolist(), strict=True):
        for k, value in enumerate(values):
            tube.low[k], tube.high[k] = round((value - 0.001) * ONE), round((value + 0.001) * ONE)
        for k, ends in enumerate(pairwise(values)):
            tube.least[k], tube.most[k] = round((min(ends) - 0.02) * ONE), round((max(ends) + 0.02) * ONE)
    before = list(known.products)
    for _ in range(6):
        for target, own in enumerate(stated.terms.coefficients):
            modulating = modulation(name, states, inputs, own.factors, "isolating", 0)
            known.take(Bounded([(target, modulating)]))
    for own, (low, high), (least, most) in zip(stated.terms.coefficients, known.products, before, strict=True):
        assert own.factors == () or high - low < 0.8 * (most - least)


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 2**32 - 1), st.floats(-3, 3), st.floats(0.01, 4))
def test_a_least_solution_is_below_any_other(seed: int, begin: float, time: float) -> None:
    rng = np.random.default_rng(seed)
    edges = np.cumsum(rng.uniform(0.05, 1.2, 6)) - 3  # wider than a step of the solution below, which is at most 0.018
    rates = rng.choice([-3.0, -0.5, 0.0, 0.7, 4.0], 5)
    begin = min(max(begin, edges[0]), edges[-1])
    after, integral = flow(
        *([round(x * ONE) for x in own.tolist()] for own in (edges, rates)), round(begin * ONE), round(time * ONE)
    )
    # A solution of rates that are nowhere less, kept within the edges.
    further, v, total, steps = float(rng.uniform(0, 0.5)), begin, 0.0, 1000
    for _ in range(steps):
        cell = min(max(int(np.searchsorted(edges, v, side="right")) - 1, 0), 4)
        last = v
        v = min(max(v + time / steps * (rates[cell] + further), edges[0]), edges[-1])
        total += 0.5 * (v + last) * time / steps
    slack = 10 * time / steps
    assert after / ONE <= v + slack
    assert integral / ONE <= total + slack * time


def test_rates_are_sums_of_products() -> None:
    box, texts = [(0, ONE), (ONE, ONE), (0, ONE)], {"x": "v[t]", "v": "a*c*b*sin(x[t]) - c*b*v[t]/2 + b*a*v[t] - 3"}
    terms = Terms.of(texts, {"a": 0, "b": 1, "c": 2}, box, frozenset())
    # b is a number, as both of its ends are one.
    assert {own.factors for own in terms.coefficients} == {(0, 2), (2,), (0,), ()}
    assert (terms.rate, terms.integral, terms.alone) == ((1, None), (None, 0), (False, False))


# ---------------------------------------------------------------- files


def stated(*steps: Any, **parts: Any) -> dict[str, Any]:
    content = copy.deepcopy(posed("pendulum", 0, 0.01)[0])
    return {**content, "narrowing": list(steps), **parts}


COMPARE = {"compare": [0, 1], "edges": [], "upper": [], "lower": []}
NOT_A_CERTIFICATE = {
    "no list": stated(7),
    "an unknown step": stated({"guess": []}),
    "the state whose rate is another one": stated({**COMPARE, "compare": [0, 0]}),
    "another experiment": stated({**COMPARE, "compare": [1, 1]}),
    "a sample beyond the last": stated({**COMPARE, "upper": [N, 1]}),
    "a sample without a value": stated({**COMPARE, "upper": [1]}),
    "a value beyond all": stated({**COMPARE, "upper": [1, "0x1p+1000"]}),
    "another coefficient": stated({"bound": [[9, []]]}),
    "an interval that ends at the first sample": stated({"bound": [[0, [0, 1, 0, 1, 1]]]}),
    "an interval without an end": stated({"bound": [[0, [0, 1, 1, 1]]]}),
    "a fraction": stated({"bound": [[0, [0, 1, 1, 1, "1/2"]]]}),
    "a cut of an unknown parameter": stated({"cut": [2, 1, 1], "steps": []}),
    "a cut to no side": stated({"cut": [0, 1, 0], "steps": []}),
    "a cut within a cut": stated({"cut": [0, 1, 1], "steps": [{"cut": [0, 1, 1], "steps": []}]}),
    "a rate from the third sample on": stated(COMPARE, first={"x": 2, "v": 2}),
}


@pytest.mark.parametrize("name", NOT_A_CERTIFICATE)
def test_what_is_no_certificate_is_said_to_be_none(name: str) -> None:
    with pytest.raises(Unreadable):
        runs.check(NOT_A_CERTIFICATE[name])


def test_a_value_that_may_be_exceeded_is_refused() -> None:
    for side, kind in (("upper", "above"), ("lower", "below")):
        value = "-1/10" if side == "upper" else "1/10"
        with pytest.raises(Refused, match=f"v may lie {kind} the value that bounds its sample 3 in the file"):
            runs.check(stated({**COMPARE, side: [3, value]}))


def test_a_slice_that_is_not_proven_empty_is_refused() -> None:
    for sign in (1, -1):
        with pytest.raises(Refused, match="a slice of a is not proven empty"):
            runs.check(stated({"cut": [0, 5, sign], "steps": [COMPARE]}))


def test_a_slice_beyond_the_box_is_empty_and_the_rest_is_kept() -> None:
    for value, sign in ((21, 1), (-1, -1)):
        with pytest.raises(Refused, match="the list of boxes ends, and 1 part"):
            runs.check(stated({"cut": [0, value, sign], "steps": []}))


def test_constraints_bound_the_parameters() -> None:
    content = stated()
    content["model"]["constraints"] = ["a - b - 1", "3 - a", "a**2"]
    (a_low, a_high), (b_low, b_high) = Narrowed.of(read.document(content).stated).box
    tiny = ONE >> 50
    assert a_high <= 3 * ONE + tiny
    assert 1.1 * ONE - tiny <= a_low <= 1.1 * ONE + tiny
    assert (b_low <= ONE // 10 + 1, b_high >= 2 * ONE) == (True, True)


def test_steps_take_work(monkeypatch) -> None:
    monkeypatch.setattr(read, "WORK_OF_RATES", 20_000)
    monkeypatch.setattr(read, "WORK_FOR_A_NUMBER", 0)
    with pytest.raises(Unreadable, match="more work than the limit"):
        runs.check(stated(*[COMPARE] * 50))
    with pytest.raises(Unreadable, match="more work than the limit"):
        runs.check(stated({"bound": [[0, [0, 1, 1, 1, 1] * 1000]]}))
