"""The library of named problems: its statements are those published, its optima are reached and never crossed."""

import json
from pathlib import Path

import numpy as np
import pytest
import sympy

from relaxations import check, library
from relaxations.errors import ProblemError
from relaxations.problem.problem import from_sympy
from relaxations.proof.bounding import relax
from relaxations.proof.certificate_file import write_certificate
from relaxations.proof.proof_steps import Bound

SMALL = [
    name
    for name in library.names()
    if library.load(name).is_bounded and library.load(name).problem.n_variables <= 5 and "smid" not in name
]


@pytest.mark.parametrize("name", library.names())
def test_a_known_minimiser_is_feasible_and_attains_the_optimum(name):
    known = library.load(name)
    problem = known.problem
    # Published points have few digits: what they miss is measured against the size of the terms.
    for minimiser in known.minimisers:
        point = np.array(minimiser)
        assert (problem.lower - 1e-3 <= point).all()
        assert (point <= problem.upper + 1e-3).all()
        for family, sign in ((known.objective, 0), (problem.equalities, 0), (problem.inequalities, 1)):
            size = np.zeros(family.n_rows)
            powers = np.prod(np.where(family.factors >= 0, np.abs(point[family.factors]), 1.0), axis=1)
            np.add.at(size, family.rows, np.abs(family.coefficients.mid) * powers)
            value = family.evaluate(point) - (known.optimum if family is known.objective else 0.0)
            missed = np.abs(value) if sign == 0 else -value
            assert (missed <= 1e-3 * (1 + size)).all()


def test_the_statements_are_those_that_sympy_reads():
    compared = 0
    file = Path(library.__file__).with_name("problems.json")
    for entry in json.loads(file.read_text()):
        symbols = sympy.symbols(entry["variables"])
        names = dict(zip(entry["variables"], symbols, strict=True))

        def exact(text, names=names):
            return sympy.nsimplify(sympy.sympify(text, locals=names), rational=True)

        if len(json.dumps([entry["objective"], entry["inequalities"], entry["equalities"]])) > 250:
            continue  # sympy takes many seconds to expand the longer ones
        problem, objective = from_sympy(
            exact(entry["objective"]),
            [exact(text) for text in entry["inequalities"]],
            [exact(text) for text in entry["equalities"]],
            symbols,
        )
        stated = library.load(entry["name"])
        compared += 1
        for ours, theirs in (
            (stated.objective, objective),
            (stated.problem.equalities, problem.equalities),
            (stated.problem.inequalities, problem.inequalities),
        ):
            # sympy multiplies decimals as floats before they become fractions.
            assert ours.coefficients.mid == pytest.approx(theirs.coefficients.mid, rel=1e-12)
            assert (ours.factors == theirs.factors).all()
            assert (ours.rows == theirs.rows).all()
    assert compared >= 20


@pytest.mark.parametrize("name", SMALL)
def test_a_certified_bound_lies_below_the_optimum_and_its_file_is_accepted(tmp_path, name):
    known = library.load(name)
    least = max(1, -(-max(known.problem.degree, known.objective.degree) // 2))
    relaxed = relax(known.problem, "sparse", max(least, 2), objective=known.objective)
    certified = relaxed.bound(known.objective)
    size = max(1.0, abs(known.optimum))
    assert certified.bound <= known.optimum + 1e-7 * size
    write_certificate(tmp_path / "c.json", known.problem, [Bound.of(relaxed, known.objective, certified)])
    (theorem,) = check.check(check.read(tmp_path / "c.json"))
    assert float(theorem.bound) == certified.bound


def test_every_problem_names_its_source():
    assert len(library.names()) == 100
    for name in library.names():
        known = library.load(name)
        assert known.name == name
        assert known.source
        assert known.verification
        assert np.isfinite(known.optimum)


def test_an_unknown_name_is_refused():
    with pytest.raises(ProblemError, match="holds no problem 'rastrigin'"):
        library.load("rastrigin")
