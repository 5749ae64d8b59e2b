"""The run checker against hostile files: false statements, endless checks, forged parts; any multipliers are safe."""

import copy
import json
import math
import subprocess
import sys
import time
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from relaxations.check import Refused, Unreadable, main, read, runs
from relaxations.check.runs import read as read_run
from relaxations.check.runs.fixed import ONE
from relaxations.check.runs.proof import hull
from relaxations.check.runs.run import ANCHORED, FACTORS, FREE, PRODUCT, STEPWISE, rows
from relaxations.check.runs.text import parsed
from tests.relaxations.check.any_boxes import any_boxes

RUNS = (FREE, ANCHORED, STEPWISE)

# A signal that is twice the parameter, measured once as 1 within 1/10.
DOUBLE: dict[str, Any] = {
    "format": "relaxations run certificate",
    "version": 1,
    "model": {
        "name": "double",
        "parameters": {"a": [0, 4]},
        "lines": {"w": "2*a"},
        "measurements": [{"channel": "y", "signal": "w", "noise": "eta", "inverse": None}],
        "constraints": [],
    },
    "noise_bounds": {"y": "1/10"},
    "first": {"w": 0},
    "initial": [],
    "experiments": [{"name": "run", "samples": 2, "channels": {"y": [1, None]}}],
    "symbols": 4,
    "claim": {"a": ["2/5", "3/5"]},
    "boxes": [{"passes": [{"rows": [[0, 0, 0, 0]], "sides": [[0, 1, 2, [0, 1]], [0, -1, 2, [0, -1]]]}]}],
}


def changed(*path: Any, to: Any) -> Any:
    """Return the file with another value in some place."""
    content = copy.deepcopy(DOUBLE)
    place = content
    for key in path[:-1]:
        place = place[key]
    place[path[-1]] = to
    return content


def test_the_file_holds() -> None:
    assert set(runs.check(DOUBLE)) == {"a"}


MANY = changed("model", "lines", "w", to="w[t - 1]")
MANY["model"]["measurements"] = []
MANY["first"]["w"] = (1 << 24) - 1
MANY["experiments"][0] |= {"samples": (1 << 24) - 1, "channels": {}}

PASS = ("boxes", 0, "passes", 0)
NOT_A_CERTIFICATE = {
    "box reversed": changed("model", "parameters", "a", to=[4, 0]),
    "a float": changed("model", "parameters", "a", to=[0, 4.0]),
    "an infinite float": changed("noise_bounds", "y", to=math.inf),
    "NaN": changed("experiments", 0, "channels", "y", to=[math.nan, None]),
    "a negative noise bound": changed("noise_bounds", "y", to=-1),
    "no noise bound": changed("noise_bounds", to={}),
    "no parameters": changed("model", "parameters", to={}),
    "no experiments": changed("experiments", to=[]),
    "too few samples": changed("experiments", 0, "channels", "y", to=[1]),
    "a claim reversed": changed("claim", "a", to=[1, 0]),
    "a claim of nothing": changed("claim", to={}),
    "an unknown key": changed("trust", to=True),
    "no rows": changed(*PASS, "rows", to=[]),
    "a row of a sample that is not there": changed(*PASS, "rows", to=[[0, 0, 0, 2]]),
    "a row of a negative sample": changed(*PASS, "rows", to=[[0, 0, 0, -1]]),
    "a row of another experiment": changed(*PASS, "rows", to=[[0, 1, 0, 0]]),
    "a row of another measurement": changed(*PASS, "rows", to=[[0, 0, 1, 0]]),
    "a row of another run": changed(*PASS, "rows", to=[[4, 0, 0, 0]]),
    "a row of no kind": changed(*PASS, "rows", to=[[6, 0, 0, 0]]),
    "a step of another measurement": changed(*PASS, "rows", to=[[5, 0, 1, 0]]),
    "a link of another line": changed(*PASS, "rows", to=[[2, 0, 1, 0]]),
    "a piece of another experiment": changed("pieces", to=[[1, 0, 2]]),
    "a piece beyond the record": changed("pieces", to=[[0, 0, 3]]),
    "a piece that ends before it begins": changed("pieces", to=[[0, 2, 1]]),
    "a piece that begins before the record": changed("pieces", to=[[0, -1, 2]]),
    "a product of another unknown": changed("products", to=[[0, 1]]),
    "a product of three": changed("products", to=[[0, 0, 0]]),
    "a product stated twice": changed("products", to=[[0, 0], [0, 0]]),
    "a row of a product that is not stated": changed(*PASS, "rows", to=[[-2, 0, 0, 0]]),
    "a row of a constraint": changed(*PASS, "rows", to=[[-1, 0, 0, 0]]),
    "another unknown": changed(*PASS, "sides", 0, 0, to=1),
    "an unknown from the end": changed(*PASS, "sides", 0, 0, to=-1),
    "true for an unknown": changed(*PASS, "sides", 0, 0, to=False),
    "a side of two": changed(*PASS, "sides", 0, 1, to=2),
    "a negative shift": changed(*PASS, "sides", 0, 2, to=-1),
    "another row": changed(*PASS, "sides", 0, 3, to=[1, 1]),
    "half a row": changed(*PASS, "sides", 0, 3, to=[0]),
    "a long multiplier": changed(*PASS, "sides", 0, 3, to=[0, 1 << 4000]),
    "a float for a multiplier": changed(*PASS, "sides", 0, 3, to=[0, 1.0]),
    "a cut of another unknown": changed("boxes", 0, "cut", to=[1, 1]),
    "a cut at infinity": changed("boxes", 0, "cut", to=[0, None]),
    "an initial sample of no signal": changed("initial", to=[[0, "v", 0, 0, 0]]),
    "an initial sample of another experiment": changed("initial", to=[[1, "w", 0, 0, 0]]),
    "an initial sample reversed": changed("initial", to=[[0, "w", 0, 1, 0]]),
    "a line before its first sample": changed("model", "lines", "w", to="2*a + w[t - 1]"),
    "a negative first sample": changed("first", "w", to=-1),
    "no first sample": changed("first", to={}),
    "a constraint on a signal": changed("model", "constraints", to=["w[t]"]),
    "too many symbols": changed("symbols", to=1 << 20),
    "no samples of a measured channel": changed("experiments", 0, "channels", to={"z": [1, 1]}),
    "many unknowns without samples": MANY,
    "a parameter called as a number": changed("model", "parameters", to={"pi": [0, 4]}),
}


@pytest.mark.parametrize("name", NOT_A_CERTIFICATE)
def test_what_is_no_certificate_is_said_to_be_none(name: str) -> None:
    with pytest.raises(Unreadable):
        runs.check(NOT_A_CERTIFICATE[name])


@pytest.mark.parametrize(
    "text",
    [
        *("", "a +", "(a", "a)", "2a", "a a", "a.real", "__import__('os')", "lambda: 1", "a if a else 1", "a[0]"),
        *(
            "w[t]",
            "w[t + 1]",
            "v[t]",
            "v[t - 1]",
            "w[u]",
            "w[t - 1.5]",
            "w[-1]",
            "b",
            "t",
            "value",
            "open(a)",
            "sqrt(a, a)",
        ),
        *("9" * 500, "1e999", "2**2**2**2**2**2", "a**2000", "3**1024**2", "(" * 100 + "a" + ")" * 100, "0**-1*a + c"),
        *(
            "Piecewise((a, a), (1, True))",
            "Piecewise((a, a > 1))",
            "Max()",
            "a == 1",
            "a < 1",
            "1/3" + "+1/7" * 9 + "+d",
        ),
        "**".join("a" * 200),
        "+".join(f"1/{2 * k + 1}" for k in range(4000)),
    ],
)
def test_a_line_that_is_no_expression_is_refused(text: str) -> None:
    with pytest.raises(Unreadable):
        runs.check(changed("model", "lines", "w", to=text))


FALSE = {
    "a narrower claim": changed("claim", "a", to=["46/100", "3/5"]),
    "an empty set": changed("claim", to=None),
    "no boxes": changed("boxes", to=[]),
    "no passes": changed("boxes", to=[{}]),
    "a further box": changed("boxes", to=[*DOUBLE["boxes"], {}]),
    "a cut without its parts": changed("boxes", to=[{**DOUBLE["boxes"][0], "cut": [0, 1]}]),
    "a cut outside of the box, without its parts": changed("boxes", to=[{"cut": [0, 9]}, {}]),
    "a missing sample": changed(*PASS, "rows", to=[[0, 0, 0, 1]]),
    "a sample that says nothing": changed("model", "lines", "w", to="log(a - 9)"),
    "multipliers that prove no emptiness": changed(*PASS, "sides", to=[[None, 1, 2, [0, 1]]]),
    "no multipliers": changed(*PASS, "sides", to=[[0, 1, 2, []], [0, -1, 2, []]]),
    "another multiplier": changed(*PASS, "sides", 0, 3, 1, to=2),
    "an opposite multiplier": changed(*PASS, "sides", 0, 3, 1, to=-1),
    "another shift": changed(*PASS, "sides", 0, 2, to=0),
    "the stated box": changed("claim", "a", to=[0, 4]),
    "a box that the sample does not reach": changed("model", "parameters", "a", to=[0, 9]),
    "an unknown without a box": changed("model", "parameters", "a", to=[0, None]),
}


@pytest.mark.parametrize("name", FALSE)
def test_what_is_not_proven_is_refused(name: str) -> None:
    with pytest.raises(Refused) as refusal:
        runs.check(FALSE[name])
    assert not isinstance(refusal.value, Unreadable)


def test_a_cut_anywhere_covers_its_box() -> None:
    for value in (-5, 0, 1, 4, 9, "1/3"):
        content = changed("boxes", to=[{"cut": [0, value]}, DOUBLE["boxes"][0], DOUBLE["boxes"][0]])
        # The multipliers were made for the whole box, and give weaker ends on a part; they never give false ones.
        document = read_run.document(content)
        (low, high), *_ = hull(document.nodes, document.stated, list(document.stated.box))
        assert low <= ONE // 2 <= high


def test_a_small_file_cannot_take_long(monkeypatch) -> None:
    monkeypatch.setattr(read_run, "WORK", read_run.WORK // 100)  # which takes a hundredth of the time
    content = changed("model", "lines", "w", to="+".join(f"exp(sin(w[t - {k}]*a))" for k in range(1, 60)))
    content["first"]["w"] = 60
    content["experiments"][0] |= {"samples": 20000, "channels": {"y": [1] * 20000}}
    content["boxes"][0]["passes"] = [{"rows": [[0, 0, 0, 19999]], "sides": []}] * 1000
    before = time.process_time()
    with pytest.raises(Unreadable, match="more work than the limit"):
        runs.check(content)
    assert time.process_time() - before < 3


def test_the_text_is_read_as_python_reads_it() -> None:
    def value(node: Any) -> float:
        match node:
            case ("number", number):
                return float(number)
            case ("+", *parts):
                return sum(map(value, parts))
            case ("*", *factors):
                return math.prod(map(value, factors))
            case ("**", base, exponent):
                return value(base) ** value(exponent)
        raise AssertionError(node)

    for text in (
        "-2**2",
        "2**-1",
        "2**3**2",
        "-2**-2*3",
        "1 - 2 - 3",
        "8/4/2",
        "8/4*2",
        "2*-3",
        "1 - -1",
        "-(1 + 2)*3",
    ):
        assert value(parsed(text)) == eval(text)


# ---------------------------------------------------------------- whatever the multipliers are, the truth stays

LINES = {
    "0.8*x[t - 1] + b*u[t - 1]**a": lambda a, b, x, u: 0.8 * x + b * u**a,
    "x[t - 1] - a*sqrt(x[t - 1])/5 + b*u[t - 1]": lambda a, b, x, u: x - a * math.sqrt(x) / 5 + b * u,
    "a*tanh(3*x[t - 1]) + b*atan(u[t - 1])*cos(x[t - 1])": (
        lambda a, b, x, u: a * math.tanh(3 * x) + b * math.atan(u) * math.cos(x)
    ),
    "Max(a*x[t - 1], Min(u[t - 1], b)) + Abs(x[t - 1] - b)/4": (
        lambda a, b, x, u: max(a * x, min(u, b)) + abs(x - b) / 4
    ),
    "Abs(x[t - 1] - b)**a + (x[t - 1] - 1/2)**3*(1 + u[t - 1])**b": (
        lambda a, b, x, u: abs(x - b) ** a + (x - 0.5) ** 3 * (1 + u) ** b
    ),
    "Piecewise((a*x[t - 1], x[t - 1] > b), (exp(-x[t - 1])*u[t - 1], True))": (
        lambda a, b, x, u: a * x if x > b else math.exp(-x) * u
    ),
    "a*x[t - 1]/(1 + x[t - 1]**2) + b*log(1 + u[t - 1])": lambda a, b, x, u: a * x / (1 + x * x) + b * math.log(1 + u),
}


@st.composite
def files(draw):
    """Return a record of a model at true parameters, with any boxes and multipliers."""
    text, step = draw(st.sampled_from(list(LINES.items())))
    rng = np.random.default_rng(draw(st.integers(0, 9)))
    true = rng.uniform(0.2, 0.9, 2).tolist()
    inputs, states = rng.uniform(0, 1, 9).tolist(), [0.7]
    for k in range(8):
        states.append(step(*true, states[-1], inputs[k]))
    noise = rng.uniform(-0.049, 0.049, 9).tolist()
    measured = [x + n for x, n in zip(states, noise, strict=True)]
    row = st.tuples(st.sampled_from(RUNS), st.just(0), st.just(0), st.integers(0, 8))
    products = draw(st.sampled_from([[], [[0, 1]], [[0, 0], [0, 1], [0, 2], [1, 1], [1, 2], [2, 2]]]))
    if products:
        factors = st.tuples(st.just(PRODUCT), st.just(0), st.integers(0, len(products) - 1), st.integers(0, 3))
        row = st.one_of(row, factors)
    model = {
        "name": "m",
        "parameters": {"a": ["1/10", 1], "b": ["1/10", 1]},
        "lines": {"x": text},
        "measurements": [{"channel": "y", "signal": "x", "noise": "eta", "inverse": None}],
        "constraints": [],
    }
    channels = {"u": [u.hex() for u in inputs], "y": [y.hex() for y in measured]}
    parts = {
        "model": model,
        "noise_bounds": {"y": "1/20"},
        "first": {"x": 1},
        "experiments": [{"name": "run", "samples": 9, "channels": channels}],
        "boxes": draw(any_boxes(row)),
        "products": products,
        "claim": None,
    }
    return {**DOUBLE, **parts}, (*true, 0.7), states


@given(found=files())
@settings(max_examples=200, deadline=None)
def test_no_multipliers_exclude_the_truth(found) -> None:
    content, truth, _ = found
    document = read_run.document(content)
    try:
        box = hull(document.nodes, document.stated, list(document.stated.box))
    except Refused:
        return  # a row of which nothing is known
    assert box is not None
    for (low, high), value in zip(box, truth, strict=True):
        assert low <= value * ONE <= high


@given(found=files(), share=st.sampled_from([1, Fraction(1, 10), Fraction(1, 1000)]))
@settings(deadline=None)
def test_every_row_holds_at_the_truth_and_its_errors(found, share) -> None:
    content, truth, states = found
    stated = read_run.document(content).stated
    exact = [int(Fraction(value) * ONE) for value in truth]
    box = [
        (x - int(share * (x - low)), x + int(share * (high - x)))
        for x, (low, high) in zip(exact, stated.box, strict=True)
    ]
    shown = [(own.low, own.high) for own in stated.pieces[0].shown[0]]
    products = {own: pair for pair, own in stated.products.items()}
    errors = len(box) + len(products) + len(stated.tape.shared)
    sources = [(run, 0, 0, now) for run in RUNS for now in range(9)]
    sources += [(PRODUCT, 0, n, which) for n in range(len(products)) for which in range(len(FACTORS))]
    known = rows(stated, box, sources)
    assert any(k >= errors for row in known.values() if row for k in row.slopes)

    def symbol(k: int) -> Fraction:
        """Return what a symbol is at the truth."""
        if k in products:
            one, other = map(symbol, products[k])
            return 2 * one * one - 1 if products[k][0] == products[k][1] else one * other
        (low, high), value = (box[k], exact[k]) if k < errors else (shown[k - errors], states[k - errors] * ONE)
        return (2 * Fraction(value) - low - high) / (high - low)

    for row in filter(None, known.values()):
        assert not row.impossible
        total, left = Fraction(0), 0  # of what operations on parameters leave over nothing is known here
        for k, slope in row.slopes.items():
            if len(box) + len(products) <= k < errors:
                left += abs(slope)
            else:
                total += slope * symbol(k)
        rounding = ONE * Fraction(1, 10**12)  # of the simulation
        assert row.low - left - rounding <= total <= row.high + left + rounding


# ---------------------------------------------------------------- the program


def test_it_uses_the_standard_library_alone() -> None:
    code = (
        "import sys; before = set(sys.modules); import relaxations.check; "
        "new = {name.split('.')[0] for name in set(sys.modules) - before}; "
        "print(sorted(new - set(sys.stdlib_module_names) - {'relaxations'}))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_the_file_may_hold_no_decimals(tmp_path: Path) -> None:
    for text in ('{"claim": 0.5}', '{"claim": NaN}', '{"claim": Infinity}', '{"claim": 1e3}'):
        file = tmp_path / "claim.json"
        file.write_text(text, encoding="utf-8")
        with pytest.raises(Unreadable):
            read(file)


def test_the_exit_codes(tmp_path: Path, capsys) -> None:
    for content, code, said in ((DOUBLE, 0, "a in [0, 4]: 0.4 to 0.6"), (FALSE["an empty set"], 1, "refused: ")):
        file = tmp_path / "proof.json"
        file.write_text(json.dumps(content), encoding="utf-8")
        assert main([str(file)]) == code
        printed = capsys.readouterr()
        assert said in printed.out + printed.err
