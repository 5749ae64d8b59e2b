"""Certificates in files: honest ones are accepted, and whatever is accepted is true of the problem in the file."""

import copy
import json
import subprocess
import sys
from fractions import Fraction
from functools import partial
from math import prod

import numpy as np
import pytest
import sympy
from hypothesis import given, settings
from hypothesis import strategies as st

from relaxations import check
from relaxations.errors import ProblemError
from relaxations.moments.conic import Multipliers
from relaxations.moments.parametric_lift import lift
from relaxations.problem.problem import from_sympy, polynomials_from_sympy
from relaxations.proof.bounding import relax
from relaxations.proof.certificate import certify
from relaxations.proof.certificate_file import write_certificate
from relaxations.proof.proof_steps import Bound, Branches, Hull, Kinks, Part, Quotient, Reach, Row, Sides
from relaxations.search.boxes import derive_box
from relaxations.search.branching import branch_and_bound
from relaxations.search.enclosure import Reason
from relaxations.search.hierarchy import intervals

x, y = sympy.symbols("x y")
METHODS = ["lift", "sparse", "dense", "terms", "chordal", "textbook"]


def quadratic():
    """Return a nonconvex quadratic with coefficients that no float holds."""
    return from_sympy(x * y + y**2 / 3 - x / 7, [1 - x**2 - y**2, x - y / 9], [], [x, y], {x: (-1, 2), y: (-2, 1)})


def cubic():
    return from_sympy(y - 2 * x, [x * y + sympy.Rational(1, 7)], [x**3 - y], [x, y], {x: (-1, 2), y: (-2, 1)})


def empty():
    equalities = [x + y - 2]
    return from_sympy(None, [sympy.Rational(3, 2) - x**2 - y**2], equalities, [x, y], {x: (-2, 2), y: (-1, 3)})


PROBLEMS = {"quadratic": quadratic, "cubic": cubic}


def written(path, problem, objective, method="sparse", order=2):
    relaxed = relax(problem, method, order, objective=objective)
    certified = relaxed.bound(objective)
    write_certificate(path, problem, [Bound.of(relaxed, objective, certified)])
    return certified


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("name", PROBLEMS)
def test_an_honest_certificate_is_accepted(tmp_path, name, method):
    file = tmp_path / "certificate.json"
    certified = written(file, *PROBLEMS[name](), method)
    (theorem,) = check.check(check.read(file))
    assert theorem.bound == Fraction(certified.bound)
    assert not theorem.empty
    # Exact arithmetic pays for no rounding, and finds next to nothing more than ball arithmetic did.
    assert_no_more_is_proven(check.read(file), 1e-9)


def assert_no_more_is_proven(document, margin):
    """Assert that the same step does not prove a bound that is larger by a margin."""
    claimed = Fraction(float.fromhex(document["steps"][0]["bound"]))
    document["steps"][0]["bound"] = (float(claimed) + margin).hex()
    with pytest.raises(check.Refused, match="bound <= r_0"):
        check.theorems(document)


@pytest.mark.parametrize("method", METHODS)
def test_a_proof_of_emptiness_is_accepted(tmp_path, method):
    file = tmp_path / "certificate.json"
    assert written(file, *empty(), method).bound == np.inf
    (theorem,) = check.check(check.read(file))
    assert theorem.empty


@pytest.mark.parametrize("order", [1, 2])
def test_the_lift_of_identification_problems_is_accepted(tmp_path, output_error, hammerstein, order):
    for model in (output_error(8, seed=1), hammerstein(7, seed=2)):
        for k, sign in ((0, 1.0), (1, -1.0)):
            objective = model.problem.variable(k, sign)
            certified = written(tmp_path / "c.json", model.problem, objective, "lift", order)
            (theorem,) = check.theorems(check.read(tmp_path / "c.json"))
            assert theorem.bound == Fraction(certified.bound)
            assert theorem.bound <= sign * model.truth[k]


def proven_ends(theorems, k):
    """Return the best ends of a variable among the theorems, as floats."""
    ends = [[float(t.bound) for t in theorems if t.objective.mid == {(k,): Fraction(sign)}] for sign in (1, -1)]
    return max(ends[0]), -max(ends[1])


def test_the_contractions_of_published_ends_are_accepted(tmp_path, output_error):
    model, steps = output_error(12, seed=3), []
    found = intervals(model.problem, [0, 1], record=steps.append)
    assert found.rounds > 1
    write_certificate(tmp_path / "c.json", model.problem, steps)
    theorems = check.check(check.read(tmp_path / "c.json"))
    for k, interval in enumerate(found.intervals):
        assert proven_ends(theorems, k) == (interval.lower, interval.upper)
    # The last step rests on the box of the first ones.
    with pytest.raises(ProblemError, match=r"step 1: .* fails for (a|b1)"):
        write_certificate(tmp_path / "c.json", model.problem, steps[-1:])


def test_the_branches_of_published_ends_are_accepted(tmp_path, hammerstein):
    model, steps = hammerstein(12, seed=0), []
    found = intervals(model.problem, range(4), order=1, rounds=2, tolerance=1e-3, nodes=60, record=steps.append)
    assert any(isinstance(step, Branches) for step in steps)
    write_certificate(tmp_path / "c.json", model.problem, steps)
    theorems = check.check(check.read(tmp_path / "c.json"))
    for k, interval in enumerate(found.intervals):
        ends = [(interval.lower, interval.upper), (model.problem.lower[k], model.problem.upper[k])]
        for end, own, box in zip((0, 1), *ends, strict=True):
            assert own == box or proven_ends(theorems, k)[end] == own


@pytest.mark.parametrize("method", ["contraction", "contradiction"])
def test_an_empty_set_is_proven_in_steps(tmp_path, output_error, method):
    steps = []
    if method == "contraction":
        problem = with_noise(output_error(15, seed=2), 0.02)
    else:  # y >= 0.1 x and y <= -0.1 x - 0.5 leave nothing on [0, 1]: two bounds of y, each on its own
        problem, _ = from_sympy(
            None, [y - x / 10, -y - x / 10 - sympy.Rational(1, 2)], [], [x, y], {x: (0, 1), y: (-1, 1)}
        )
    found = intervals(problem, [1], witnesses=False, record=steps.append)
    assert found.reason is Reason.EMPTY
    write_certificate(tmp_path / "c.json", problem, steps)
    assert any(theorem.empty for theorem in check.check(check.read(tmp_path / "c.json")))


def with_noise(model, bound):
    lower, upper = model.problem.lower.copy(), model.problem.upper.copy()
    lower[2:], upper[2:] = -bound, bound
    return model.problem.with_box(lower, upper)


def branched():
    """Return the quadratic with a bound that only branches prove, at order 1."""
    problem, objective = quadratic()
    return problem, branches_of(problem, objective, "sparse", 10)


def cases():
    """Return a problem with a product that vanishes, branched by its cases."""
    problem, objective = from_sympy(
        x + 2 * y, [1 - x**2 - y**2], [x * y / 3], [x, y], {x: (-1, sympy.Rational(3, 2)), y: (-2, 1)}
    )
    return problem, branches_of(problem, objective, "sparse", 12)


def branches_of(problem, objective, method, nodes):
    relaxed = partial(relax, method=method, order=1, objective=objective)
    steps = []
    branch_and_bound(
        problem,
        objective,
        np.arange(2),
        relaxed,
        start=relaxed(problem).bound(objective).bound,
        goal=lambda _: np.inf,
        nodes=nodes,
        report=lambda *_: None,
        record=steps.append,
    )
    assert len(steps) == 1
    return steps


def unbounded():
    """Return a problem whose x has no box, and the box that was derived, with a bound that rests on it."""
    problem, _ = from_sympy(None, [x - y / 7], [2 * x + y - 1], [x, y], {y: (sympy.Rational(-1, 2), 1)})
    steps = []
    box = derive_box(problem, np.ones(2), record=steps.append)
    assert box.derived == ("x",)
    assert isinstance(steps[0], Reach)
    intervals(box.problem, [0], record=steps.append)
    return problem, steps


def divided():
    """Return a problem whose x is 1 / y, with y away from zero."""
    problem, _ = from_sympy(None, [], [x * y - 1], [x, y], {y: (sympy.Rational(1, 3), 1)})
    alone, objective = from_sympy(y, [], [], [y], {y: (sympy.Rational(1, 3), 1)})
    relaxed = relax(alone, "dense", 1)
    return problem, [Bound.of(relaxed, objective, relaxed.bound(objective)), Quotient(problem, 0, 0)]


def cut():
    """Return a problem that is affine in y, and the range of x by cuts, in several boxes."""
    problem, _ = from_sympy(
        None,
        [x * y - sympy.Rational(1, 3), sympy.Rational(3, 2) - x**2 - y * x**2 / 2 - y],
        [],
        [x, y],
        {x: (-1, 2), y: (-2, 1)},
    )
    steps = []
    assert intervals(problem, [0], method="benders", tolerance=1e-2, record=steps.append).reason is Reason.TIGHT
    return problem, steps


def kinked():
    """Return x + y <= 3/2 with y = max(0, 2 x - 1), and the largest x: open, on each side, and where it is decided."""
    argument, limit = 2 * x - 1, [sympy.Rational(3, 2) - x - y]
    problem, _ = from_sympy(None, limit, [], [x, y], {x: (-1, 2), y: (0, None)})
    hull = (Row("above", "y"), Row("chord", "y", (-3.0, 3.0)))
    chord = 3 * (argument + 3) - 6 * y
    steps = [
        Sides(*largest_x([*limit, y - argument, chord], {x: (-1, 2), y: (0, 3)}, hull)),
        Hull(
            problem,
            np.array([0]),
            (
                Part(1, 0.0, 0.0, (Sides(*largest_x([limit[0].subs(y, 0), -argument], {x: (-1, 2)}, side, -1)),), -1),
                Part(
                    1, 0.0, 0.0, (Sides(*largest_x([limit[0].subs(y, argument), argument], {x: (-1, 2)}, side, 1)),), 1
                ),
            ),
        ),
        Hull(
            problem,
            np.array([0]),
            (
                Part(0, -1.0, 0.5, (Sides(*largest_x([limit[0].subs(y, 0)], {x: (-1, 0.5)}, (), -1)),)),
                Part(0, 0.5, 2.0, (Sides(*largest_x([limit[0].subs(y, argument)], {x: (0.5, 2)}, (), 1)),)),
            ),
        ),
    ]
    return problem, steps, Kinks(np.array([1]), np.array([False]), polynomials_from_sympy([argument], [x, y]))


side = (Row("side", "y"),)


def largest_x(inequalities, box, rows, known=0):
    """Return problem, known sides, rows, definitions and steps: the upper end of x."""
    problem, objective = from_sympy(-x, inequalities, [], list(box), box)
    relaxed = relax(problem, "sparse", 1)
    proven = Bound.of(relaxed, objective, relaxed.bound(objective))
    return problem, (("y", known),) if known else (), rows, (), (proven,)


def signed():
    """Return x + y / 2 <= 1 with y = sign(x - 1/3), so that x <= 1/2."""
    third, limit = sympy.Rational(1, 3), [1 - x - y / 2]
    problem, _ = from_sympy(None, limit, [], [x, y], {x: (-1, 2), y: (-1, 1)})
    low, high = 2 * (x - third) + 2 * (1 - y), 2 * (y + 1) - 2 * (x - third)
    rows = (Row("low", "y", (-2.0,)), Row("high", "y", (2.0,)))
    steps = [
        Sides(*largest_x([*limit, low, high], {x: (-1, 2), y: (-1, 1)}, rows)),
        Hull(
            problem,
            np.array([0]),
            (
                Part(0, -1.0, 0.375, ()),
                Part(0, 0.375, 2.0, (Sides(*largest_x([limit[0].subs(y, 1)], {x: (0.375, 2)}, (), 1)),)),
            ),
        ),
    ]
    return problem, steps, Kinks(np.array([1]), np.array([True]), polynomials_from_sympy([x - third], [x, y]))


PROOFS = {"branched": branched, "cases": cases, "unbounded": unbounded, "divided": divided, "cut": cut}
PROOFS |= {"kinked": kinked, "signed": signed}
KEYS = {"branched": "parts", "cases": "equality", "unbounded": "reach", "divided": "quotient", "cut": "weights"}
KEYS |= {"kinked": "hull", "signed": "sides"}


@pytest.mark.parametrize("name", PROOFS)
def test_every_kind_of_step_is_accepted_and_true(tmp_path, name):
    write_certificate(tmp_path / "c.json", *PROOFS[name]())
    document = check.read(tmp_path / "c.json")
    assert KEYS[name] in {path[-1] for path in keys_of(document["steps"])}
    assert sum(is_feasible(document, point) for point in POINTS) > 2
    assert_true(document, check.check(document))


def test_the_check_agrees_with_the_package_on_any_multipliers(tmp_path):
    problem, objective = quadratic()
    relaxed = relax(problem, "sparse", 2)
    scaled = relaxed.scaling.polynomials(objective)
    rng = np.random.default_rng(5)
    for size in (1e-8, 1.0, 1e8):
        dual = Multipliers(
            size * rng.normal(size=relaxed.relaxation.n_equalities),
            tuple(size * rng.normal(size=(b.count, b.size, 3)) for b in relaxed.relaxation.blocks),
        )
        certificate = certify(relaxed.relaxation, scaled, dual)
        write_certificate(tmp_path / "c.json", problem, [Bound(relaxed, objective, certificate)])
        (theorem,) = check.theorems(check.read(tmp_path / "c.json"))
        assert theorem.bound == Fraction(certificate.bound)
        assert_no_more_is_proven(check.read(tmp_path / "c.json"), 1e-12 * abs(certificate.bound))


# ---------------------------------------------------------------- what is refused


@pytest.fixture(scope="module")
def document(tmp_path_factory):
    file = tmp_path_factory.mktemp("certificates") / "certificate.json"
    written(file, *quadratic())
    return check.read(file)


def raise_bound(d):
    d["steps"][0]["bound"] = (float.fromhex(d["steps"][0]["bound"]) + 1e-6).hex()


def shrink_scale(d):
    d["steps"][0]["scale"][1] = (0.999 * float.fromhex(d["steps"][0]["scale"][1])).hex()


def negative_weight(d):
    d["steps"][0]["products"][0]["weight"] = -1


def negative_radius(d):
    d["inequalities"][0][0][1] = "-1/3"


REFUSED = {
    "a bound too high": (raise_bound, r"step 1: bound <= r_0 - sum \|r_i\| fails: -0\.\d+ > -0\.\d+"),
    "a box not covered": (shrink_scale, r"step 1: (centre - scale <= lower|upper <= centre \+ scale) fails for y"),
    "a negative weight": (negative_weight, r"step 1: product 0: weight >= 0 fails: -1"),
    "a negative radius": (negative_radius, r"inequalities 0: radius >= 0 fails"),
    "another version": (lambda d: d.update(version=2), r"the version is 2, this program checks version 1"),
    "another format": (lambda d: d.update(format="x"), r"its 'format' is not 'relaxations certificate'"),
    "no steps": (lambda d: d.update(steps=[]), r"there are no steps"),
    "no box": (lambda d: d["box"].__setitem__(0, [None, 1]), r"x has no finite box"),
    "too few bounds": (lambda d: d["box"].pop(), r"box has 1 entries instead of 2"),
    "a variable from the end": (
        lambda d: d["steps"][0]["objective"][0].__setitem__(2, [-1]),
        r"-1 is not a number from 0 to 1",
    ),
    "an unknown constraint": (
        lambda d: d["steps"][0]["products"][0].update(of=[["inequality", 2]]),
        r"inequality 2 is not among the 2 that are stated",
    ),
    "an unknown kind": (lambda d: d["steps"][0]["products"][0].update(of=[["good", 0]]), r"'good' is none of"),
    "a decimal as text": (lambda d: d["steps"][0].update(bound="-0.5"), r"step 1, bound: '-0.5' is not a number"),
    "not a number": (lambda d: d["steps"][0].update(bound="nan"), r"'nan' is not a number"),
    "a truth value": (lambda d: d["steps"][0].update(bound=True), r"True is not a number"),
    "a division by zero": (lambda d: d["steps"][0].update(bound="1/0"), r"'1/0' is not a number"),
    "a ragged factor": (lambda d: d["steps"][0]["products"][0]["factor"][0].append(0), r"rows differ in length"),
}


@pytest.mark.parametrize("name", REFUSED)
def test_a_tampered_file_is_refused_with_the_reason(document, name):
    tamper, message = REFUSED[name]
    changed = copy.deepcopy(document)
    check.check(changed)
    tamper(changed)
    with pytest.raises(check.Refused, match=message):
        check.check(changed)


def keys_of(node, path=()):
    """Return the paths of all keys of objects in a document."""
    if isinstance(node, dict):
        return [p for key, value in node.items() for p in ((*path, key), *keys_of(value, (*path, key)))]
    if isinstance(node, list):
        return [p for k, value in enumerate(node) for p in keys_of(value, (*path, k))]
    return []


def test_every_missing_key_is_refused_by_name(document):
    paths = keys_of(document)
    assert {p[-1] for p in paths} >= {"box", "steps", "bound", "weight", "factor"}
    for path in paths:
        changed = copy.deepcopy(document)
        node = changed
        for key in path[:-1]:
            node = node[key]
        del node[path[-1]]
        reason = "is not a certificate" if path == ("format",) else f"has no '{path[-1]}'"
        with pytest.raises(check.Unreadable, match="the version is None" if path == ("version",) else reason):
            check.check(changed)


def leaves(node, path=()):
    """Return the paths of everything in a document that is neither an object nor a list."""
    if isinstance(node, (dict, list)):
        items = node.items() if isinstance(node, dict) else enumerate(node)
        return [p for key, value in items for p in leaves(value, (*path, key))]
    return [path]


def value_of(polynomial, point):
    """Return the interval of ``[[mid, rad, variables], ...]`` at a rational point."""
    low = high = Fraction(0)
    for mid, rad, variables in polynomial:
        power = prod((point[v] for v in variables), start=Fraction(1))
        centre, reach = number(mid) * power, number(rad) * abs(power)
        low, high = low + centre - reach, high + centre + reach
    return low, high


def number(value):
    return Fraction(float.fromhex(value)) if isinstance(value, str) and "x" in value else Fraction(value)


def is_feasible(document, point):
    """Say whether a point is feasible for some choice of coefficients inside their balls."""
    inside = all(
        (low is None or number(low) <= v) and (high is None or v <= number(high))
        for v, (low, high) in zip(point, document["box"], strict=True)
    )
    return (
        inside
        and all(value_of(g, point)[1] >= 0 for g in document["inequalities"])
        and all(low <= 0 <= high for low, high in (value_of(h, point) for h in document["equalities"]))
        and all(is_kink(kink, point) for kink in document.get("kinks", []))
    )


def is_kink(kink, point):
    """Say whether a kink has the value of its argument, for some choice of coefficients."""
    (low, high), value = value_of(kink["argument"], point), point[kink["variable"]]
    if kink["kind"] == "positive part":
        return max(low, 0) <= value <= max(high, 0)
    return (value == 1 and high > 0) or (value == -1 and low < 0) or (value == 0 and low <= 0 <= high)


GRID = [Fraction(k, 6) for k in range(-18, 19)]


POINTS = [(a, b) for a in GRID for b in GRID]


def assert_true(document, theorems):
    """Hold every theorem against the points that are feasible for the problem in the file."""
    for point in POINTS:
        if is_feasible(document, point):
            for theorem in theorems:
                objective = [[mid, theorem.objective.rad.get(m, 0), m] for m, mid in theorem.objective.mid.items()]
                assert value_of(objective, point)[1] >= theorem.bound


@pytest.fixture(scope="module")
def documents(document, tmp_path_factory):
    found = [document]
    for name, make in PROOFS.items():
        file = tmp_path_factory.mktemp("proofs") / f"{name}.json"
        write_certificate(file, *make())
        found.append(check.read(file))
    return found


@settings(max_examples=200, deadline=None, derandomize=True)
@given(st.data())
def test_what_is_accepted_after_tampering_is_true_of_the_problem_in_the_file(documents, data):
    changed = copy.deepcopy(data.draw(st.sampled_from(documents)))
    for _ in range(data.draw(st.integers(1, 3))):
        path = data.draw(st.sampled_from(leaves(changed)))
        node = changed
        for key in path[:-1]:
            node = node[key]
        old = node[path[-1]]
        if isinstance(old, str) and "0x" in old:
            change = data.draw(st.sampled_from([0.0, -1e-9, 1e-9, 1e-3, -1e-2, 0.5, 1.0, -3.0]))
            node[path[-1]] = (float.fromhex(old) * (1 + change) + data.draw(st.sampled_from([0.0, change]))).hex()
        elif isinstance(old, int):
            node[path[-1]] = data.draw(st.integers(-1, 2))
        elif data.draw(st.booleans()) and isinstance(node, list):
            del node[path[-1]]
        else:
            node[path[-1]] = data.draw(st.sampled_from(["inside", "above", "below", "side", "sign", "", None]))
    try:
        theorems = check.check(changed)
    except check.Refused:
        return
    assert_true(changed, theorems)


def lose(*path):
    def tamper(document):
        node = document
        for key in path[:-1]:
            node = node[key]
        del node[path[-1]]

    return tamper


def put(value, *path):
    def tamper(document):
        node = document
        for key in path[:-1]:
            node = node[key]
        node[path[-1]] = value

    return tamper


FIRST_CUT = ("steps", 0, "parts", 1, "steps", 0)
TAMPERED = {
    "a bound of branches too high": (1, put("0x1.0p-2", "steps", 0, "bound"), r"part 1: bound >= 0.25 fails: -"),
    "a part lost": (1, lose("steps", 0, "parts", 1), r"the parts cover the box: upper <= last upper end fails for"),
    "the first part lost": (1, lose("steps", 0, "parts", 0), r"the parts cover the box: lower end <= upper end before"),
    "a gap between parts": (
        1,
        put(-1, "steps", 0, "parts", 0, "box", 1),
        r"the parts cover the box: lower end <= upper",
    ),
    "a part without proof": (
        1,
        put([], "steps", 0, "parts", 0, "steps"),
        r"part 1: bound >= -0\.\d+ fails: -1\.7",
    ),
    "a case lost": (2, lose("steps", 0, "parts", 0), r"step 1: no part covers (x|y) = 0"),
    "cases of no product": (
        2,
        put([["1", 0, []], ["1", 0, [0]]], "equalities", 0),
        r"equality 0 is not a single monomial",
    ),
    "a face lost": (3, lose("steps", 0, "reach", "faces", 0), r"step 1: face x = 1 is missing"),
    "a face without proof": (
        3,
        put([], "steps", 0, "reach", "faces", 0, "steps"),
        r"face x = 1: s > 0 is not proven: 0",
    ),
    "a size of zero": (3, put(0, "steps", 0, "reach", "variables", 0, 1), r"step 1: size > 0 fails for x: 0"),
    "no box to ride with": (
        3,
        put([0], "steps", 0, "reach", "riding"),
        r"step 1: x has a size, so it cannot ride along",
    ),
    "a divisor not bounded": (4, lose("steps", 0), r"no step before it keeps what x is multiplied by from zero"),
    "a cut with a negative multiplier": (
        5,
        put([[0, "-0x1.0p-2"]], "cuts", 0, "inequalities"),
        r"multiplier >= 0 fails: -0.25",
    ),
    "an unknown cut": (5, lose("cuts"), r"cut \d is not among the 0 that are stated"),
    "cuts that say nothing": (5, put([], "cuts", 0, "inequalities"), r"bound <= r_0 - sum \|r_i\| fails"),
    "an objective of inner variables": (
        5,
        put(1, *FIRST_CUT, "objective", 0, 2, 0),
        r"the objective holds an inner variable",
    ),
    "a negative weight of a cut": (5, put("-0x1.0p-2", *FIRST_CUT, "weights", 0, 1), r"weight >= 0 fails: -0.25"),
    "a cut without a box": (5, put([None, 1], "box", 1), r"y has no finite box"),
    "a cut that is curved": (5, put([["1", 0, [1, 1]]], "inequalities", 0), r"is not affine in the inner variables"),
    "a side not decided": (6, put([[0, 1]], "steps", 0, "sides"), r"step 1: the box does not decide on y, side 1"),
    "the other side": (
        6,
        put(-1, "steps", 2, "parts", 1, "steps", 0, "sides", 0, 1),
        r"part 2, step 1: the box does not decide on y, side -1",
    ),
    "a side that no part chose": (6, put(["side", 0], "steps", 0, "rows", 0), r"row 0: no part chooses this side"),
    "one side only": (6, lose("steps", 1, "parts", 0), r"step 2: the parts are not both sides of one kink"),
    "a hull that does not cover": (6, lose("steps", 2, "parts", 0), r"the parts cover the box: lower end <= upper end"),
    "a chord too short": (
        6,
        put("-0x1.0p+1", "steps", 0, "rows", 1, 2),
        r"row 1: the box does not keep the argument from below it",
    ),
    "a chord too low": (
        6,
        put("0x1.0p+1", "steps", 0, "rows", 1, 3),
        r"row 1: the box does not keep the argument from above it",
    ),
    "a row of a sign": (6, put(["low", 0, -3], "steps", 0, "rows", 1), r"'low' with 1 ends is not a row of this kink"),
    "a kink of itself": (6, put([[1, 0, [1]]], "kinks", 0, "argument"), r"kink 0: it reads one that is not before it"),
    "another argument": (6, put([[2, 0, [0]]], "kinks", 0, "argument"), r"step 1: row 1: the box does not keep"),
    "no kinks": (6, lose("kinks"), r"kink \d is not among the 0 that are stated"),
    "sides of a sign": (
        7,
        put([{"kink": 0, "side": 1, "steps": []}], "steps", 1, "parts"),
        r"a sign that is zero belongs to neither side",
    ),
    "a hull of a sign too short": (7, put(-1, "steps", 0, "rows", 0, 2), r"row 0: the box does not keep"),
    "another quotient": (4, put([["1", 0, [0, 0]]], "equalities", 0), r"the equality is not affine in x"),
}


@pytest.mark.parametrize("name", TAMPERED)
def test_a_tampered_proof_is_refused_with_the_reason(documents, name):
    which, tamper, message = TAMPERED[name]
    changed = copy.deepcopy(documents[which])
    tamper(changed)
    with pytest.raises(check.Refused, match=message):
        check.check(changed)


def test_the_tampering_test_sees_feasible_points_and_both_outcomes(document):
    assert any(is_feasible(document, (a, b)) for a in GRID for b in GRID)
    # A looser bound and a further square stay true; a lost square does not.
    looser = copy.deepcopy(document)
    looser["steps"][0]["bound"] = "-5"
    assert check.theorems(looser)[0].bound == -5
    lost = copy.deepcopy(document)
    lost["steps"][0]["products"].pop()
    lost["steps"][0]["products"].pop(0)
    with pytest.raises(check.Refused, match="fails"):
        check.check(lost)


# ---------------------------------------------------------------- the program


def run(*arguments):
    return subprocess.run(
        [sys.executable, "-m", "relaxations.check", *map(str, arguments)], capture_output=True, text=True, check=False
    )


def test_the_program_accepts_refuses_and_cannot_read(tmp_path, document):
    good, bad, broken = tmp_path / "good.json", tmp_path / "bad.json", tmp_path / "broken.json"
    good.write_text(json.dumps(document))
    changed = copy.deepcopy(document)
    raise_bound(changed)
    bad.write_text(json.dumps(changed))
    broken.write_text(good.read_text()[:-20])
    done = run(good)
    assert (done.returncode, done.stderr) == (0, "")
    assert "accepted: 2 variables" in done.stdout
    # The decimal that is printed as the bound is one.
    printed = Fraction(done.stdout.split(" >= ")[1].split()[0])
    assert printed <= number(document["steps"][0]["bound"])
    done = run(bad)
    assert (done.returncode, done.stdout) == (1, "")
    assert done.stderr.startswith("refused: step 1: bound <= r_0 - sum |r_i| fails: ")
    for arguments in ((broken,), (tmp_path / "missing.json",), ()):
        done = run(*arguments)
        assert done.returncode == 2
        assert "Traceback" not in done.stderr


@pytest.mark.parametrize("text", ["[]", "3", '{"format": "relaxations certificate", "format": 1}', '{"version": 1.5}'])
def test_json_of_another_shape_is_refused(tmp_path, text):
    file = tmp_path / "c.json"
    file.write_text(text)
    with pytest.raises(check.Refused):
        check.check(check.read(file))


def test_the_program_imports_nothing_else_of_the_package_and_no_library(tmp_path, document):
    file = tmp_path / "c.json"
    file.write_text(json.dumps(document))
    program = (
        "import runpy, sys; sys.argv = ['check', sys.argv[1]]\n"
        "try:\n    runpy.run_module('relaxations.check', run_name='__main__', alter_sys=True)\n"
        "except SystemExit as e:\n    assert e.code == 0, e.code\n"
        "own = sorted(m for m in sys.modules if m.split('.')[0] == 'relaxations')\n"
        "own = [m for m in own if m.split('.')[1:2] not in ([], ['check'])]\n"
        "foreign = sorted({m.split('.')[0] for m in sys.modules} & {'numpy', 'scipy', 'sympy', 'cvxpy', 'clarabel'})\n"
        "print(own, foreign, file=sys.stderr)"
    )
    done = subprocess.run([sys.executable, "-c", program, file], capture_output=True, text=True, check=True)
    own = done.stderr.strip()
    assert own == "[] []"


# ---------------------------------------------------------------- what is not written


def test_a_certificate_of_another_objective_is_not_written(tmp_path):
    problem, objective = quadratic()
    relaxed = relax(problem, "sparse", 2)
    certificate = relaxed.bound(objective).certificate
    with pytest.raises(ProblemError, match="give each the objective that its certificate was made for"):
        write_certificate(tmp_path / "c.json", problem, [Bound(relaxed, problem.variable(0), certificate)])
    assert not (tmp_path / "c.json").exists()


def test_a_relaxation_with_a_row_of_unknown_origin_is_not_written(tmp_path):
    problem, objective = cubic()
    relaxed = relax(problem, "lift", 2)
    other, _ = from_sympy(None, [x * y + sympy.Rational(1, 3)], [x**3 - 2 * y], [x, y], {x: (-1, 2), y: (-2, 1)})
    strange = type(relaxed)(
        relaxed.problem,
        relaxed.scaling,
        relaxed.scaled,
        lift(relaxed.scaling.apply(other), 2),
        relaxed.program,
        relaxed.solver,
    )
    certificate = relaxed.bound(objective).certificate
    with pytest.raises(ProblemError, match="not checkable"):
        write_certificate(tmp_path / "c.json", problem, [Bound(strange, objective, certificate)])


def test_a_bound_that_proves_nothing_is_not_written(tmp_path):
    problem, objective = quadratic()
    relaxed = relax(problem, "sparse", 1)
    dual = Multipliers(np.zeros(0), tuple(np.full((b.count, b.size, 1), np.nan) for b in relaxed.relaxation.blocks))
    nothing = certify(relaxed.relaxation, relaxed.scaling.polynomials(objective), dual)
    with pytest.raises(ProblemError, match="it proves nothing to be written"):
        write_certificate(tmp_path / "c.json", problem, [Bound(relaxed, objective, nothing)])
