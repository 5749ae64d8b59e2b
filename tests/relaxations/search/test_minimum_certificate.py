"""Certificates of minima: the file proves the lower end that is returned."""

from fractions import Fraction

import pytest

from relaxations import check, library
from relaxations.formats.expressions import problem_of, variables
from relaxations.search.minimum import MinimumReason, minimise

x, y, z = variables("x y z")
CUBE = [end for v in (x, y, z) for end in (v >= -1, v <= 1)]
CASES = {
    "one order": (x**2 - x, [x >= 0, x <= 2]),
    "branches": (x * y + y * z + z * x, CUBE),
    "a vanishing product": (x + 2 * y, [x * y == 0, x**2 + y**2 <= 1, x >= -1, x <= 1, y >= -1, y <= 1]),
    "a curve": (x + y, [x * y == 1, x >= 0.25, x <= 4, y >= 0.25, y <= 4]),
    "empty": (x + y, [x**2 + y**2 <= 1, x + y >= 2, x >= -1, x <= 1, y >= -1, y <= 1]),
}


def assert_proven(file, found):
    """Assert that a file proves the lower end of a minimum."""
    theorems = check.check(check.read(file))
    if found.reason is MinimumReason.EMPTY:
        assert any(theorem.empty for theorem in theorems)
        return
    terms = {
        tuple(v for v in factor if v >= 0): Fraction(mid)
        for factor, mid in zip(found.objective.factors.tolist(), found.objective.coefficients.mid.tolist(), strict=True)
    }
    proven = [theorem.bound for theorem in theorems if theorem.objective.mid == terms]
    assert max(proven) == Fraction(found.lower)


@pytest.mark.parametrize("order", [1, None])
@pytest.mark.parametrize("name", CASES)
def test_the_file_proves_the_lower_end(tmp_path, name, order):
    objective, constraints = CASES[name]
    problem = problem_of(objective, constraints)
    found = minimise(*problem, order=order, nodes=60, tolerance=1e-3, certificate=tmp_path / "c.json")
    assert found.reason in (MinimumReason.TIGHT, MinimumReason.EMPTY) or order == 1
    assert_proven(tmp_path / "c.json", found)


@pytest.mark.parametrize("name", ["gms_st_e01", "gms_Bex2_1_2"])
def test_the_minima_of_named_problems_are_proven(tmp_path, name):
    case = library.load(name)
    found = minimise(case.problem, case.objective, certificate=tmp_path / "c.json")
    assert found.lower <= case.optimum + 1e-7 * max(1.0, abs(case.optimum))  # known to about seven digits
    assert_proven(tmp_path / "c.json", found)


def test_nothing_is_written_where_the_box_says_as_much(tmp_path):
    (tmp_path / "c.json").write_text("an old proof")
    found = minimise(*problem_of(x, [x >= 1, x <= 2]), certificate=tmp_path / "c.json")
    assert found.lower == pytest.approx(1.0)
    assert not (tmp_path / "c.json").exists()
