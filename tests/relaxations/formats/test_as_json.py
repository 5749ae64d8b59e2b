"""Problems in JSON come back bit by bit, and a damaged file is told with the place."""

import copy
import json

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from relaxations import library
from relaxations.algebra.ball_arithmetic import Balls
from relaxations.algebra.polynomial import Polynomials
from relaxations.errors import ProblemError
from relaxations.formats.as_json import read_json, write_json
from relaxations.formats.expressions import problem_of, variables
from relaxations.problem.problem import PolynomialProblem

FINITE = st.floats(allow_nan=False, allow_infinity=False)


def families(n):
    term = st.tuples(
        st.lists(st.integers(0, n - 1), max_size=3).map(lambda key: tuple(sorted(key))),
        FINITE.filter(bool),
        st.floats(0, allow_nan=False, allow_infinity=False),
    )
    return st.lists(st.lists(term, max_size=4, unique_by=lambda t: t[0]), max_size=3).map(family)


def family(members):
    rows = [row for row, terms in enumerate(members) for _ in terms]
    keys = [key for terms in members for key, *_ in terms]
    factors = np.full((len(keys), max((len(key) for key in keys), default=0)), -1, dtype=np.int64)
    for factor, key in zip(factors, keys, strict=True):
        factor[len(factor) - len(key) :] = key
    mids = np.array([mid for terms in members for _, mid, _ in terms], float)
    rads = np.array([rad for terms in members for *_, rad in terms], float)
    return Polynomials(len(members), np.array(rows, dtype=np.int64), factors, Balls(mids, rads))


def is_same(one, two):
    return one.n_rows == two.n_rows and all(
        a.tobytes() == b.tobytes() and a.shape == b.shape
        for a, b in (
            (one.rows, two.rows),
            (one.factors, two.factors),
            (one.coefficients.mid, two.coefficients.mid),
            (one.coefficients.rad, two.coefficients.rad),
        )
    )


@settings(max_examples=40, deadline=None, derandomize=True)
@given(st.data())
def test_any_problem_comes_back_bit_by_bit(tmp_path_factory, data):
    n = data.draw(st.integers(1, 3))
    ends = [sorted(data.draw(st.tuples(*[st.floats(allow_nan=False)] * 2))) for _ in range(n)]
    names = tuple(data.draw(st.lists(st.text(max_size=4), min_size=n, max_size=n)))
    lower, upper = np.array([low for low, _ in ends]), np.array([high for _, high in ends])
    # An end at the wrong infinity means no more than none.
    lower[lower == np.inf], upper[upper == -np.inf] = 0.0, np.inf
    problem = PolynomialProblem(names, lower, upper, data.draw(families(n)), data.draw(families(n)))
    goals = data.draw(families(n))
    objective = goals.take(np.array([0])) if goals.n_rows else None
    file = tmp_path_factory.mktemp("json") / "problem.json"
    write_json(file, problem, objective)
    again, goal = read_json(file)
    assert again.names == names
    assert again.lower.tobytes() == lower.tobytes()
    assert again.upper.tobytes() == upper.tobytes()
    assert is_same(again.equalities, problem.equalities)
    assert is_same(again.inequalities, problem.inequalities)
    assert (goal is None) == (objective is None)
    assert goal is None or is_same(goal, objective)


def test_the_library_comes_back_bit_by_bit(tmp_path):
    for name in library.names():
        stated = library.load(name)
        write_json(tmp_path / "p.json", stated.problem, stated.objective)
        again, goal = read_json(tmp_path / "p.json")
        assert is_same(again.equalities, stated.problem.equalities)
        assert is_same(again.inequalities, stated.problem.inequalities)
        assert is_same(goal, stated.objective)
        assert again.lower.tobytes() == stated.problem.lower.tobytes()


@pytest.fixture
def document(tmp_path):
    x, y = variables("x y")
    write_json(tmp_path / "p.json", *problem_of(x * y / 3, [x**2 + y**2 <= 1, x == y**2]))
    return json.loads((tmp_path / "p.json").read_text())


DAMAGED = {
    "another format": (lambda d: d.update(format="x"), "this is not a 'relaxations problem'"),
    "another version": (lambda d: d.update(version=9), "version 9 is unknown"),
    "a missing key": (lambda d: d.pop("box"), "box is missing"),
    "no names": (lambda d: d.update(variables=[]), "variables: a list of names is expected"),
    "a pair of three": (lambda d: d["box"][0].append(1), "box: a list of pairs is expected"),
    "too few pairs": (lambda d: d["box"].pop(), "2 names, 1 lower and 1 upper bounds"),
    "crossed bounds": (lambda d: d["box"].__setitem__(0, [2, 1]), r"the box of x is \[2.0, 1.0\]"),
    "no number": (
        lambda d: d["equalities"][0][0].__setitem__(0, "ten"),
        "equality 0, term 0: 'ten' is not a finite",
    ),
    "digits in doubt": (lambda d: d["equalities"][0][0].__setitem__(0, "10"), "'10' is not a finite number"),
    "a truth value": (lambda d: d["equalities"][0][0].__setitem__(0, True), "True is not a finite number"),
    "infinity": (lambda d: d["equalities"][0][0].__setitem__(0, float("inf")), "inf is not a finite number"),
    "a negative radius": (
        lambda d: d["objective"][0].__setitem__(1, -1),
        "objective 0, term 0: the radius -1.0",
    ),
    "a variable too many": (
        lambda d: d["inequalities"][0][1].__setitem__(2, [2]),
        "inequality 0, term 1: 2 is no",
    ),
    "a variable from the end": (
        lambda d: d["inequalities"][0][1].__setitem__(2, [-1]),
        "-1 is not the number of a",
    ),
    "a term of two": (lambda d: d["inequalities"][0][0].pop(), r"\[coefficient, radius, variables\] is expected"),
    "a list missing": (lambda d: d.update(equalities=3), "equality: a list of polynomials is expected"),
}


@pytest.mark.parametrize("name", DAMAGED)
def test_a_damaged_file_is_refused_with_the_place(tmp_path, document, name):
    damage, message = DAMAGED[name]
    changed = copy.deepcopy(document)
    damage(changed)
    (tmp_path / "p.json").write_text(json.dumps(changed))
    with pytest.raises(ProblemError, match=message) as error:
        read_json(tmp_path / "p.json")
    assert "p.json" in str(error.value)


def test_what_is_no_json_is_told_with_its_line(tmp_path):
    (tmp_path / "p.json").write_text('{\n "version": 1\n "box"')
    with pytest.raises(ProblemError, match=r"p\.json, line 3: not valid JSON"):
        read_json(tmp_path / "p.json")
    with pytest.raises(ProblemError, match=r"none\.json cannot be read"):
        read_json(tmp_path / "none.json")


def test_numbers_may_be_plain(tmp_path, document):
    document["objective"] = [[0.5, 0, [0, 1]], [2, 0, []]]
    (tmp_path / "p.json").write_text(json.dumps(document))
    _, goal = read_json(tmp_path / "p.json")
    assert sorted(goal.coefficients.mid) == [0.5, 2.0]
