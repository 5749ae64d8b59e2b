"""The checker against hostile files: false statements, endless checks, forged lines; and its kernel is small."""

import ast
import json
import subprocess
import sys
from fractions import Fraction
from pathlib import Path

import pytest

from relaxations import check

FOLDER = Path(check.__file__).parent
HEAD = {"format": "relaxations certificate", "version": 1, "equalities": [], "inequalities": []}
SHARED = Path(__file__).parents[4] / "shared" / "cases" / "proofs"


def bound(count, centre, scale, objective, claimed, equalities=()):
    """Return a step that claims a lower bound."""
    return {
        "objective": objective,
        "bound": claimed,
        "centre": centre[:count],
        "scale": scale[:count],
        "equalities": list(equalities),
        "products": [],
    }


X = [[1, 0, [0]]]


def test_a_scale_of_zero_does_not_hide_a_variable_from_its_box():
    content = HEAD | {"variables": ["x"], "box": [[0, 10]], "steps": [bound(1, [5], [0], X, 5)]}
    with pytest.raises(check.Refused, match=r"centre - scale <= lower fails for x: 5 > 0"):
        check.check(content)
    content["box"] = [[5, 5]]
    (theorem,) = check.theorems(content)
    assert theorem.bound == 5


def test_a_scale_of_zero_does_not_prove_that_a_set_is_empty():
    step = bound(2, [5, 0], [0, 0], [], 1, [[0, [["1/5", []]]]])
    rows = {"equalities": [[[1, 0, [1]], [-1, 0, [0]]]]}  # y = x holds on a diagonal of the box
    content = HEAD | rows | {"variables": ["x", "y"], "box": [[0, 10], [0, 1]], "steps": [step]}
    with pytest.raises(check.Refused, match="fails for x"):
        check.check(content)


@pytest.mark.parametrize("name", ["x\nstep 2: y", "\x1b[2J", "\ud800", "", "x" * 121, "‮x"])
def test_a_name_that_cannot_be_printed_on_one_line_is_refused(name):
    content = HEAD | {"variables": [name], "box": [[0, 10]], "steps": [bound(1, [5], [5], X, 0)]}
    with pytest.raises(check.Unreadable, match="name"):
        check.check(content)


def test_two_variables_of_one_name_are_refused():
    content = HEAD | {"variables": ["x", "x"], "box": [[0, 10], [6, 10]], "steps": [bound(2, [5, 8], [5, 2], X, 0)]}
    with pytest.raises(check.Unreadable, match="two variables have the name x"):
        check.check(content)


def run(path):
    command = [sys.executable, "-m", "relaxations.check", str(path)]
    return subprocess.run(command, capture_output=True, text=True, check=False, timeout=60)


def test_a_name_that_looks_like_a_statement_is_printed_in_quotes(tmp_path):
    step = bound(1, [5], [5], [[1, 0, [0, 0]]], 0)
    step["products"] = [{"of": [], "weight": 1, "basis": [[], [0]], "factor": [[5], [5]]}]
    content = HEAD | {"variables": ["x >= 100 (step 1)"], "box": [[-10, 10]], "steps": [step]}
    step["centre"], step["scale"], step["products"][0]["factor"] = [0], [10], [[0], [10]]
    file = tmp_path / "c.json"
    file.write_text(json.dumps(content))
    done = run(file)
    assert done.returncode == 0, done.stderr
    assert '"x >= 100 (step 1)"*"x >= 100 (step 1)" >= 0 (step 1)' in done.stdout


def test_a_file_that_proves_nothing_is_refused(tmp_path):
    file = tmp_path / "c.json"
    content = HEAD | {"variables": ["x"], "box": [[0, 10]], "steps": [bound(1, [5], [5], X, 0)]}
    file.write_text(json.dumps(content))
    done = run(file)
    assert (done.returncode, done.stdout) == (1, "")
    assert done.stderr == "refused: the file proves nothing beyond the stated box\n"


def many_variables():
    names = [f"x{k}" for k in range(40)]
    step = bound(40, [1] * 40, [1] * 40, [[1, 0, list(range(40))]], 0)
    return {"variables": names, "box": [[0, 1]] * 40, "steps": [step]}


def nested_kinks():
    kinks = [
        {"variable": k, "kind": "positive part", "argument": [[1, 0, [k - 1] * 64], [1, 0, []]]} for k in range(1, 6)
    ]
    inside = bound(6, [0] * 6, [1] * 6, [], 1)
    step = {"sides": [[k, 1] for k in range(5)], "rows": [], "defined": [], "steps": [inside]}
    return {"variables": [f"k{k}" for k in range(6)], "box": [[1, 2]] * 6, "kinks": kinks, "steps": [step]}


def deep_steps():
    steps = [bound(1, [0], [1], X, 0)]
    for _ in range(200):
        steps = [{"objective": X, "bound": 0, "level": 1, "steps": steps}]
    return {"variables": ["x"], "box": [[0, 1]], "steps": steps}


def long_number():
    return {"variables": ["x"], "box": [[0, 1]], "steps": [bound(1, [0], [1], X, 10**1000)]}


def strange_denominators():
    objective = [[f"1/{2**127 - 2 * k - 1}", 0, [0]] for k in range(40)]
    return {"variables": ["x"], "box": [[0, 1]], "steps": [bound(1, [0], [1], objective, 0)]}


BOMBS = [many_variables, nested_kinks, deep_steps, long_number, strange_denominators]


@pytest.mark.parametrize("make", BOMBS)
def test_a_small_file_cannot_keep_the_program_busy(make):
    with pytest.raises(check.Unreadable, match=r"work|deep|number|denominators"):
        check.check(HEAD | make())


def test_a_file_of_another_kind_ends_with_code_2_and_one_line(tmp_path):
    file = tmp_path / "c.json"
    for content in ("", "[1", "\x00", "[" * 100_000, '{"format": "relaxations certificate", "version": 7}', "1e400"):
        file.write_text(content)
        done = run(file)
        assert (done.returncode, done.stdout) == (2, ""), content
        assert done.stderr.startswith("not a certificate: ")
        assert done.stderr.count("\n") == 1
    assert "is not a regular file" in run(tmp_path).stderr
    unknown = HEAD | {"variables": ["x"], "box": [[0, 1]], "steps": [bound(1, [0], [1], X, 0)], "remark": "true"}
    with pytest.raises(check.Unreadable, match="the file has an unknown key 'remark'"):
        check.check(unknown)


@pytest.mark.skipif(not SHARED.exists(), reason="the shared files that break proofs are not here")
def test_the_shared_files_that_break_proofs_are_refused():
    for file in sorted(SHARED.glob("*.json")):
        done = run(file)
        assert done.returncode in (1, 2), file.name
        assert (done.stdout, done.stderr.count("\n")) == ("", 1), file.name


def code_lines(path):
    """Count the lines that hold code: without imports, docstrings, comments and blank lines."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    apart = [n for n in ast.walk(tree) if isinstance(n, ast.Import | ast.ImportFrom)]
    apart += [n for n in ast.walk(tree) if isinstance(n, ast.Expr) and isinstance(n.value, ast.Constant)]
    without = {line for node in apart for line in range(node.lineno, node.end_lineno + 1)}
    lines = enumerate(path.read_text(encoding="utf-8").splitlines(), start=1)
    return sum(n not in without and bool(line.split("#")[0].strip()) for n, line in lines)


def test_the_kernel_fits_in_640_lines_and_every_rule_has_its_proof():
    rules = [path for path in FOLDER.glob("rules/*.py") if path.stem != "__init__"]
    kernel = [FOLDER / "arithmetic.py", FOLDER / "statement.py", FOLDER / "proof.py", *rules]
    assert sum(map(code_lines, kernel)) <= 640
    for path in rules:
        head = ast.get_docstring(ast.parse(path.read_text(encoding="utf-8")))
        assert "Claim: " in head
        assert "Proof. " in head or path.stem == "parts"


@pytest.mark.parametrize(
    ("row", "ends"),
    [
        ([[1, 0, [0]], [-1, 0, [1]]], (2, 3)),  # x = y
        ([[-2, 0, [0]], [1, 0, [1]], [-6, 0, []]], (-2, "-3/2")),  # x = (y - 6) / 2
        ([["3/2", "1/2", [0]], [-1, 0, [1]]], (1, 3)),  # x = y / b for a b from 1 to 2
    ],
)
def test_a_quotient_bounds_from_both_sides(row, ends):
    step = {"quotient": {"equality": 0, "variable": 0}}
    content = HEAD | {"equalities": [row], "variables": ["x", "y"], "box": [[None, None], [2, 3]], "steps": [step]}
    lower, upper = check.theorems(content)
    assert (lower.bound, -upper.bound) == tuple(map(Fraction, ends))
