"""GAMS's scalar format: what is read is what is written, and what cannot be read is told with its line."""

from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from relaxations import library
from relaxations.errors import ProblemError
from relaxations.formats.expressions import Expression, variables
from relaxations.formats.gams import parse_gams, read_gams
from relaxations.formats.text import parse
from relaxations.library import _entries
from relaxations.proof.bounding import relax

# Written by hand after the layout that GAMS Convert produces.
MODEL = """$offlisting
*  NLP written in the layout of GAMS Convert
*  Solve m using NLP minimizing objvar;

$ontext
Variables nonsense;
$offtext

Variables  x1 'first; of two',X2,objvar
           ,x4;

Positive Variables X2;

Equations  e1,e2,e3
           ,e4;

e1..  - (x1*(2*x1 - 0.5*x2) + sqr(x2) + POWER(x1,3)) + x2**2*2 + 0.25*x1^2/2
      + objvar =E= 1.5;

e2..    x1 + 10*x2 =L= 6.5E0;
e3.. (x1 - 1)*(x2 - 1) =G= -.5;
E4.. x4 - x1 =e= 0;

* set non default bounds
x1.lo = -1; x1.up = 3E0;
x2.up = 0.1; x4.lo = -inf;

* set non default levels
x1.l = 0.3; objvar.l = -2;

Model m / all /;
m.limrow=0; m.limcol=0;
option optcr = 0;

$if NOT '%gams.u1%' == '' $include '%gams.u1%'

Solve m using NLP minimizing objvar;
"""


def terms_of(polynomials, row, names):
    """Return {names: coefficient} of one member, midpoints taken as exact."""
    return {
        tuple(sorted(names[v] for v in factor if v >= 0)): mid
        for r, factor, mid in zip(
            polynomials.rows.tolist(), polynomials.factors.tolist(), polynomials.coefficients.mid.tolist(), strict=True
        )
        if r == row
    }


def test_a_model_of_every_construct_is_read():
    problem, objective = parse_gams(MODEL)
    names = problem.names
    assert names == ("x1", "X2", "x4")
    assert terms_of(objective, 0, names) == {
        (): 1.5,
        ("x1", "x1"): 2 - 0.125,
        ("X2", "x1"): -0.5,
        ("X2", "X2"): -1.0,
        ("x1", "x1", "x1"): 1.0,
    }
    assert terms_of(problem.inequalities, 0, names) == {(): 6.5, ("x1",): -1.0, ("X2",): -10.0}
    assert terms_of(problem.inequalities, 1, names) == {(): 1.5, ("X2", "x1"): 1.0, ("x1",): -1.0, ("X2",): -1.0}
    assert terms_of(problem.equalities, 0, names) == {("x4",): 1.0, ("x1",): -1.0}
    assert problem.lower[:2].tolist() == [-1.0, 0.0]
    assert problem.upper[0] == 3.0
    # The decimal 0.1 lies below the nearest float, which therefore is the bound.
    assert problem.upper[1] == 0.1
    assert Fraction(problem.upper[1]) >= Fraction(1, 10)
    # x4 has no bounds of its own; they follow from e4.
    assert (problem.lower[2], problem.upper[2]) == (-1.0, 3.0)


def gams_of(entry):
    """Write a problem of the library as a scalar model, lines broken as GAMS Convert breaks them."""
    own = [*entry["variables"], "objvar"]
    rows = [f"{entry['objective']} - objvar =E= 0"]
    rows += [f"{text} =G= 0" for text in entry["inequalities"]] + [f"{text} =E= 0" for text in entry["equalities"]]
    lines = ["Variables " + "\n   ,".join(own) + ";", "Equations " + ",".join(f"e{k}" for k in range(len(rows))) + ";"]
    lines += [f"e{k}.. {row.replace(' + ', chr(10) + '  + ')};" for k, row in enumerate(rows)]
    for v, (low, high) in entry["bounds"].items():
        lines += [f"{v}.lo = {low};"] if low is not None else []
        lines += [f"{v}.up = {high};"] if high is not None else []
    return "\n".join([*lines, "Model m / all /;", "Solve m using NLP minimizing objvar;"])


GLOBALLIB = [name for name in library.names() if name.startswith("gms_")]


@pytest.mark.parametrize("name", GLOBALLIB)
def test_the_problems_of_globallib_are_read_as_the_library_states_them(name):
    entry, stated = _entries()[name], library.load(name)
    problem, objective = parse_gams(gams_of(entry))
    assert problem.names == stated.problem.names
    assert terms_of(objective, 0, problem.names) == terms_of(stated.objective, 0, problem.names)
    at = [np.random.default_rng(1).uniform(-1, 1, problem.n_variables) for _ in range(3)]
    for ours, theirs in (
        (problem.equalities, stated.problem.equalities),
        (problem.inequalities, stated.problem.inequalities),
    ):
        # A constraint on one variable alone has become a bound.
        kept = [row for row in range(theirs.n_rows) if not is_bound(theirs, row)]
        assert ours.n_rows == len(kept)
        for point in at:
            assert ours.evaluate(point) == pytest.approx(theirs.evaluate(point)[kept], rel=1e-12)
    assert (problem.lower >= stated.problem.lower).all()
    assert (problem.upper <= stated.problem.upper).all()


def is_bound(polynomials, row):
    own = polynomials.factors[polynomials.rows == row]
    degrees = (own >= 0).sum(axis=1)
    return degrees.max() == 1 and (degrees == 1).sum() == 1


@settings(max_examples=80, deadline=None, derandomize=True)
@given(
    st.dictionaries(
        st.lists(st.sampled_from("xyz"), max_size=4).map(lambda m: tuple(sorted(m))),
        st.decimals(-1000, 1000, allow_nan=False, places=3),
        max_size=6,
    )
)
def test_polynomials_survive_being_printed(terms):
    expression = Expression({m: Fraction(c) for m, c in terms.items() if c})
    names = dict(zip("xyz", variables("x y z"), strict=True))
    assert parse(str(expression), names).terms == expression.terms
    text = " + ".join("*".join([f"({c})", *m]) for m, c in terms.items()) or "0"
    assert parse(text, names).terms == expression.terms


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("-2**2", -4),
        ("2**3**2", 512),
        ("2*-3", -6),
        ("8/2/2", 2),
        ("1 - 2 - 3", -4),
        ("sqr(1 + 2)*power(2, 3)", 72),
        ("1.5E1 + .5 + 1.", "33/2"),
        ("-(-(1))", 1),
        ("2^-0", 1),
    ],
)
def test_precedence(text, value):
    assert parse(text, {}).constant == Fraction(value)


def replaced(old, new):
    assert MODEL.count(old) == 1
    return MODEL.replace(old, new)


MALFORMED = {
    "a function": (replaced("sqr(x2)", "log(x2)"), r"line 17: log of 1 arguments cannot be read"),
    "a division": (replaced("0.25*x1^2/2", "1/x1"), r"line 17: division by x1, which is not a constant"),
    "an unknown name": (replaced("10*x2", "10*x9"), r"line 20: 'x9' is not a variable"),
    "an open parenthesis": (replaced("(x2 - 1)", "(x2 - 1"), r"line 21: the expression ends|line 21: '\)' is expected"),
    "two operators": (replaced("x1 + 10", "x1 + * 10"), r"line 20: a number, a name or a parenthesis is expected"),
    "no relation": (replaced("=L= 6.5E0", ""), r"line 20: equation 'e2' needs one of =E=, =L= and =G="),
    "nothing on the right": (replaced("=L= 6.5E0", "=L="), r"line 20: equation 'e2' has nothing right of =L="),
    "another relation": (replaced("=L=", "=N="), r"line 20: =N= is not supported"),
    "an undeclared equation": (replaced("E4..", "e5.."), r"line 22: equation 'e5' is not declared"),
    "an equation twice": (replaced("E4..", "e3.."), r"line 22: equation 'e3' is defined twice"),
    "an equation missing": (replaced("E4.. x4 - x1 =e= 0;", ""), r"equation 'e4' is declared and not defined"),
    "integers": (replaced("Positive Variables X2", "Integer Variables X2"), r"line 12: Integer variables are not cont"),
    "a parameter": (replaced("option optcr = 0", "Parameter p"), r"line 33: .*'Parameter' is not part of the scalar"),
    "an odd sign": (replaced("option optcr = 0", "x1 ? 3"), r"line 33: '\?' cannot be read"),
    "a bound of nothing": (replaced("x1.lo = -1", "x7.lo = -1"), r"line 25: 'x7' is neither a variable nor a model"),
    "a bound that is not a number": (replaced("x1.lo = -1", "x1.lo = x2"), r"line 25: 'x2' is not a variable"),
    "an unknown attribute": (replaced("x1.lo = -1", "x1.low = -1"), r"line 25: a bound is written x1.lo"),
    "no semicolon": (MODEL.rstrip().removesuffix(";"), r"line 37: the statement 'Solve' has no semicolon"),
    "no objective": (MODEL[: MODEL.rindex("Solve")], r"the objective is missing"),
    "another objective": (
        MODEL[: MODEL.rindex("objvar")] + "cost;",
        r"line 37: the objective 'cost' is not a variable",
    ),
    "another model": (
        MODEL[: MODEL.rindex("m using")] + "k using NLP minimizing objvar;",
        r"line 37: 'k' is not a model",
    ),
    "bounds that cross": (replaced("x1.up = 3E0", "x1.up = -3"), r"leave x1 the empty box \[-1.0, -3.0\]"),
}


@pytest.mark.parametrize("name", MALFORMED)
def test_what_is_malformed_is_told_with_its_line(name):
    text, message = MALFORMED[name]
    with pytest.raises(ProblemError, match=message):
        parse_gams(text)


def test_maximising_is_minimising_the_negative():
    text = (
        "Variables x, z; Equations e1; e1.. z =E= x - x*x; x.lo = 0; x.up = 1; Model m /all/; Solve m {} z using NLP;"
    )
    low, goal = parse_gams(text.format("minimizing"))
    high, negative = parse_gams(text.format("maximizing"))
    assert relax(low, "dense", 1).bound(goal).bound == pytest.approx(0, abs=1e-7)
    assert relax(high, "dense", 1).bound(negative).bound == pytest.approx(-0.25, abs=1e-7)


def test_an_objective_variable_with_bounds_stays_a_variable():
    text = "Variables x, z; Equations e1; e1.. z =E= x*x; x.lo = -1; x.up = 1; z.lo = 0.5; Model m /e1/;"
    problem, objective = parse_gams(text + "Solve m using NLP minimizing z;")
    assert problem.names == ("x", "z")
    assert relax(problem, "dense", 1).bound(objective).bound == pytest.approx(0.5, abs=1e-7)


def test_a_file_is_read_and_named_in_errors(tmp_path):
    file = tmp_path / "model.gms"
    file.write_text(MODEL)
    assert read_gams(file)[0].names == ("x1", "X2", "x4")
    file.write_text(MALFORMED["a function"][0])
    with pytest.raises(ProblemError, match=r"model\.gms: line 17: log"):
        read_gams(file)
    with pytest.raises(ProblemError, match=r"missing\.gms cannot be read"):
        read_gams(tmp_path / "missing.gms")
