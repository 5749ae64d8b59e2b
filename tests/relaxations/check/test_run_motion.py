"""Rates in run certificates: enclosures hold the solutions that other methods compute, and forged files are refused."""

import copy
import math
from fractions import Fraction
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from relaxations.check import Refused, Unreadable, runs
from relaxations.check.arithmetic import Work
from relaxations.check.runs import motion, read
from relaxations.check.runs.affine import UNKNOWN, Form, between, gathered, scaled, scattered, symbol
from relaxations.check.runs.fixed import ONE, above, below
from relaxations.check.runs.motion import Motion
from relaxations.check.runs.operations import operate
from relaxations.check.runs.proof import hull
from relaxations.check.runs.tape import Tape
from tests.relaxations.check.any_boxes import any_boxes

# Rates as text, the same in numbers, and states to begin with.
RATES: dict[str, tuple[dict[str, str], Any, tuple[float, ...]]] = {
    "pendulum": (
        {"h": "v[t]", "v": "1 - 3*a*sin(h[t]) - b*v[t]"},
        lambda x, a, b: [x[1], 1 - 3 * a * math.sin(x[0]) - b * x[1]],
        (0.5, 0.3),
    ),
    "Arrhenius": (
        {"h": "a*(1 - h[t]) + b*exp(-2/h[t])"},
        lambda x, a, b: [a * (1 - x[0]) + b * math.exp(-2 / x[0])],
        (0.8,),
    ),
    "order": ({"h": "b - a*h[t]**(1 + b)/(1 + a)"}, lambda x, a, b: [b - a * x[0] ** (1 + b) / (1 + a)], (0.9,)),
    "root": ({"h": "a - b*sqrt(h[t]) + h[t]**1.5/9"}, lambda x, a, b: [a - b * x[0] ** 0.5 + x[0] ** 1.5 / 9], (0.7,)),
    "curves": (
        {"h": "tanh(2*h[t]) - a*h[t]**3 + cos(v[t])", "v": "atan(h[t]) - b*log(2 + v[t]) + 1/(1 + h[t]**2)"},
        lambda x, a, b: [
            math.tanh(2 * x[0]) - a * x[0] ** 3 + math.cos(x[1]),
            math.atan(x[0]) - b * math.log(2 + x[1]) + 1 / (1 + x[0] ** 2),
        ],
        (0.2, -0.1),
    ),
    "drag": (
        {"v": "0.3 - a*v[t]*Abs(v[t]) - b*Max(v[t], 0.2) + Min(v[t], 0)"},
        lambda x, a, b: [0.3 - a * x[0] * abs(x[0]) - b * max(x[0], 0.2) + min(x[0], 0)],
        (-0.4,),
    ),
    "switched": (
        {"h": "Piecewise((a, h[t] < 0.5), (-b, True)) + 0.1*h[t]"},
        None,
        (0.6,),
    ),
    "stiff": (
        {"h": "a*(v[t] - h[t])", "v": "20*(b*h[t] - v[t])"},
        lambda x, a, b: [a * (x[1] - x[0]), 20 * (b * x[0] - x[1])],
        (0.6, 0.1),
    ),
}


def posed(name: str, box: list[tuple[float, float]]) -> Motion:
    """Return the motion over a box of both parameters, whose symbols are 0 and 1."""
    tape = Tape({"a": 0, "b": 1}, frozenset())
    tape.integrated(RATES[name][0])
    forms = [UNKNOWN] * len(tape.entries)
    starts = [symbol(below(Fraction(low)), above(Fraction(high)), k) for k, (low, high) in enumerate(box)]
    for k, (entry, fixed) in enumerate(zip(tape.entries, tape.fixed, strict=True)):
        if fixed:
            forms[k] = operate(entry, forms, starts)
    return Motion(tape, forms, 2, Work(10**9))


def holds(form: Form, value: float, symbols: dict[int, float], slack: float) -> bool:
    """Return whether a form holds a value where some symbols are known."""
    if not form.low / ONE - slack <= value <= form.high / ONE + slack:
        return False
    rest = sum(abs(slope) for k, slope in form.slopes.items() if k not in symbols) + form.radius
    known = form.mid + sum(slope * symbols[k] for k, slope in form.slopes.items() if k in symbols)
    return abs(known / ONE - value) <= rest / ONE + slack


@settings(deadline=None, max_examples=40)
@given(
    st.sampled_from(list(RATES)),
    st.floats(0.2, 0.9),
    st.floats(0.2, 0.9),
    st.floats(-1, 1),
    st.sampled_from([0.0, 1e-4, 0.02, 0.2]),
    st.sampled_from([1, 3]),
)
def test_the_solution_lies_inside(name: str, a: float, b: float, place: float, half: float, steps: int) -> None:
    _, rates, begin = RATES[name]
    own = posed(name, [(x - half * (1 + place), x + half * (1 - place)) for x in (a, b)])
    starts = [between(below(Fraction(x - half / 9)), above(Fraction(x + half / 9))) for x in begin]
    found = own.after(starts, Fraction(2, 5), steps)
    if found is None:
        return
    if name == "switched":
        # It falls to the jump, and stays there.
        end = [max(0.5, 10 * b + (begin[0] - 10 * b) * math.exp(0.04))]
    else:
        end = solve_ivp(lambda _, x: rates(x, a, b), (0, 0.4), begin, rtol=1e-9, atol=1e-11).y[:, -1].tolist()
    for form, value in zip(found, end, strict=True):
        assert holds(form, value, {0: place, 1: place}, 1e-7)


@pytest.mark.parametrize("name", sorted(set(RATES) - {"switched", "stiff", "drag"}))
def test_at_a_point_it_is_narrow_and_narrower_in_more_steps(name: str) -> None:
    own, widths = posed(name, [(0.5, 0.5), (0.6, 0.6)]), []
    for steps in (4, 16):
        found = own.after(
            [between(below(Fraction(x)), above(Fraction(x))) for x in RATES[name][2]], Fraction(2, 5), steps
        )
        widths.append(max(form.high - form.low for form in found) / ONE)
    assert widths[0] < 1e-3
    assert widths[1] < widths[0] / 4**4  # the remainder is of order six, and added up over the steps of order five


@given(
    st.lists(st.integers(-1000, 1000), min_size=5, max_size=5),
    st.lists(st.floats(-1, 1), min_size=5, max_size=5),
    st.fractions(-3, 3),
)
def test_gathered_symbols_are_scattered_again(slopes: list[int], values: list[float], factor: Fraction) -> None:
    sizes = [abs(slope) for slope in slopes]
    before = Form(7, dict(enumerate(slopes[:4])), sizes[4], 7 - sum(sizes), 7 + sum(sizes))
    after = scattered(scaled(gathered(before, 2, -1), factor), 2, -1, before)
    assert set(after.slopes) <= set(range(4))
    number = 7 + sum(slope * value for slope, value in zip([*slopes[:4], sizes[4]], values, strict=True))
    known = after.mid + sum(slope * values[k] for k, slope in after.slopes.items())
    assert abs(float(factor) * number - known) <= after.radius + 1e-6
    assert after.low - 1e-6 <= float(factor) * number <= after.high + 1e-6


# ---------------------------------------------------------------- files

# The state falls from 1 as exp(-a t): after half a second, with a = 1, it is 0.60653.
FALLING: dict[str, Any] = {
    "format": "relaxations run certificate",
    "version": 1,
    "model": {
        "name": "falling",
        "parameters": {"a": [0, 2]},
        "rates": {"w": "-a*w[t]"},
        "interval": "1/2",
        "lines": {},
        "measurements": [{"channel": "y", "signal": "w", "noise": "eta", "inverse": None}],
        "constraints": [],
    },
    "noise_bounds": {"y": "1/1000"},
    "first": {"w": 1},
    "initial": [[0, "w", 0, 1, 1]],
    "experiments": [{"name": "run", "samples": 2, "channels": {"y": [1, "60653/100000"]}}],
    "symbols": 4,
    "steps": 2,
    "claim": {"a": ["9/10", "11/10"]},
    "boxes": [
        {
            "passes": [
                {"rows": [[0, 0, 0, 1]], "sides": [[0, 1, 0, [0, -3]], [0, -1, 0, [0, 3]]]},
                {"rows": [[0, 0, 0, 1]], "sides": [[0, 1, 0, [0, -12]], [0, -1, 0, [0, 12]]]},
            ]
        }
    ],
}


def changed(*path: Any, to: Any) -> Any:
    """Return the file with another value in some place."""
    content = copy.deepcopy(FALLING)
    place = content
    for key in path[:-1]:
        place = place[key]
    place[path[-1]] = to
    return content


def test_the_file_holds() -> None:
    assert set(runs.check(FALLING)) == {"a"}


NOT_A_CERTIFICATE = {
    "no interval": changed("model", "interval", to=None),
    "no time between samples": changed("model", "interval", to=0),
    "no steps": changed("steps", to=0),
    "too many steps": changed("steps", to=1 << 20),
    "a rate and a line": changed("model", "lines", to={"w": "a"}),
    "a rate of a signal at the time itself": changed("model", "rates", "w", to="-a*y[t]"),
    "a rate of a signal that nothing defines": changed("model", "rates", "w", to="-a*v[t - 1]"),
    "a rate from its first sample on": changed("first", "w", to=0),
    "a balance of another state": changed("boxes", 0, "passes", 0, "rows", to=[[4, 0, 1, 1]]),
}


@pytest.mark.parametrize("name", NOT_A_CERTIFICATE)
def test_what_is_no_certificate_is_said_to_be_none(name: str) -> None:
    with pytest.raises(Unreadable):
        runs.check(NOT_A_CERTIFICATE[name])


FALSE = {
    "a narrower claim": changed("claim", "a", to=["999/1000", "1001/1000"]),
    "an empty set": changed("claim", to=None),
    "another law": changed("model", "rates", "w", to="-a*w[t]**2"),
    "another interval": changed("model", "interval", to="3/4"),
    "another sample": changed("experiments", 0, "channels", "y", 1, to="7/10"),
    "another multiplier": changed("boxes", 0, "passes", 0, "sides", 0, 3, 1, to=-1),
    "a rate that is nowhere real": changed("model", "rates", "w", to="log(-9 - w[t]**2)"),
}


@pytest.mark.parametrize("name", FALSE)
def test_what_is_not_proven_is_refused(name: str) -> None:
    with pytest.raises(Refused) as refusal:
        runs.check(FALSE[name])
    assert not isinstance(refusal.value, Unreadable)


@st.composite
def files(draw):
    """Return a record of rates at true parameters, with any boxes and multipliers."""
    name = draw(st.sampled_from(["pendulum", "Arrhenius", "order", "root", "drag"]))
    texts, rates, begin = RATES[name]
    rng = np.random.default_rng(draw(st.integers(0, 9)))
    true = rng.uniform(0.3, 0.8, 2).tolist()
    solution = solve_ivp(
        lambda _, x: rates(x, *true), (0, 1.5), begin, t_eval=np.arange(6) * 0.3, rtol=1e-9, atol=1e-11
    ).y
    noise, count = rng.uniform(-0.019, 0.019, solution.shape), len(texts)
    channels = {f"y{k}": [y.hex() for y in row] for k, row in enumerate((solution + noise).tolist())}
    row = st.tuples(st.sampled_from([0, 1, 4]), st.just(0), st.integers(0, count - 1), st.integers(1, 5))
    model = {
        "name": name,
        "parameters": {"a": ["1/5", "9/10"], "b": ["1/5", "9/10"]},
        "rates": texts,
        "interval": (0.3).hex(),
        "lines": {},
        "measurements": [
            {"channel": f"y{k}", "signal": signal, "noise": "eta", "inverse": None} for k, signal in enumerate(texts)
        ],
        "constraints": [],
    }
    parts = {
        "model": model,
        "noise_bounds": dict.fromkeys(channels, "1/50"),
        "first": dict.fromkeys(texts, 1),
        "initial": [],
        "experiments": [{"name": "run", "samples": 6, "channels": channels}],
        "steps": draw(st.integers(1, 2)),
        "boxes": draw(any_boxes(row)),
        "claim": None,
    }
    return {**FALLING, **parts}, (*true, *begin)


@given(found=files())
@settings(max_examples=15, deadline=None)
def test_no_multipliers_exclude_the_truth(found) -> None:
    content, truth = found
    document = read.document(content)
    try:
        box = hull(document.nodes, document.stated, list(document.stated.box))
    except Refused:
        return  # a row of which nothing is known
    assert box is not None
    for (low, high), value in zip(box, truth, strict=True):
        assert low <= value * ONE <= high


def test_what_remains_keeps_the_solution_inside(monkeypatch) -> None:
    """Of two coefficients, the second over the box: with zero in its place the step would exclude the solution."""
    tape, h = Tape({}, frozenset()), Fraction(1, 4)
    tape.integrated({"w": "-1.6*w[t]"})
    forms = [operate(entry, [], []) if entry[0] == "number" else UNKNOWN for entry in tape.entries]
    own, begin = Motion(tape, forms, 0, Work(10**9)), [between(ONE, ONE)]
    monkeypatch.setattr(motion, "ORDER", 2)
    (kept,), coefficients = own._step(begin, h, 0), own._coefficients
    assert holds(kept, math.exp(-0.4), {}, 0.0)

    def without_last(states: Any, order: int, forms: Any) -> Any:
        found = coefficients(states, order, forms)
        return [[*given, between(0, 0)] for *given, _ in found] if order == 2 else found

    monkeypatch.setattr(own, "_coefficients", without_last)
    (lost,) = own._step(begin, h, 0)
    assert not holds(lost, math.exp(-0.4), {}, 0.0)
