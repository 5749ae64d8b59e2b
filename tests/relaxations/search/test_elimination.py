"""The linear program in few unknowns agrees with the one in all, and its multipliers make the same cut."""

import numpy as np
import pytest

from relaxations.search.benders import program
from relaxations.search.benders.cuts import Cuts
from relaxations.search.benders.elimination import FEWEST, eliminated
from relaxations.search.benders.split import Split
from relaxations.search.boxes import BLOCKS, LENGTHS, LONG, derive_box


@pytest.fixture
def model(output_error):
    return output_error(FEWEST + 100, seed=1, pole=-0.98)


@pytest.mark.parametrize("outer", [[0], [0, 1]])
@pytest.mark.parametrize("away", [0.0, 0.003, -0.01])
def test_both_programs_agree(model, monkeypatch, outer, away):
    split = Split.of(model.problem, np.array(outer))
    p = np.array(model.truth[: len(outer)], dtype=float)
    p[0] += away
    constant, matrix = split.equalities.at(split.values(p))
    slack, _ = split.inequalities.at(split.values(p))
    assert eliminated(constant, matrix, slack) is not None
    fast = program.ask(split, p)
    monkeypatch.setattr(program, "eliminated", lambda *_: None)
    slow = program.ask(split, p)
    assert fast.excess == pytest.approx(slow.excess, abs=1e-6)
    assert np.abs(constant + matrix @ fast.inner).max() < 1e-8
    assert np.abs(fast.inner).max() <= 1 + fast.excess + 1e-8
    # The cut misses the point by as much as the noises exceed their bounds.
    (left,), _ = Cuts.of(split, fast.multipliers[None]).tangents(p)
    assert left == pytest.approx(-fast.excess, abs=1e-6)


def test_a_short_record_and_many_inner_variables_are_left_to_the_solver(model, output_error):
    short = Split.of(output_error(20).problem, np.array([0]))
    values = short.values(np.array([-0.5]))
    assert eliminated(*short.equalities.at(values), short.inequalities.at(values)[0]) is None
    # A pole outside the unit circle: the response grows beyond all digits.
    split = Split.of(model.problem, np.array([0]))
    values = split.values(np.array([-1.2]))
    assert eliminated(*split.equalities.at(values), split.inequalities.at(values)[0]) is None


def test_a_part_of_a_long_record_gives_a_box(output_error):
    model = output_error(LONG * LENGTHS[-1] + 200, seed=2)
    lower, upper = model.problem.lower.copy(), model.problem.upper.copy()
    lower[1], upper[1] = -np.inf, np.inf
    steps = []
    found = derive_box(model.problem.with_box(lower, upper), np.ones(len(lower)), record=steps.append)
    assert found.derived == ("b1",)
    assert -20 < found.problem.lower[1] <= model.truth[1] <= found.problem.upper[1] < 20
    assert found.problem.n_variables == model.problem.n_variables
    assert steps[-1].problem.equalities.n_rows <= BLOCKS * (LENGTHS[0] + 2)
