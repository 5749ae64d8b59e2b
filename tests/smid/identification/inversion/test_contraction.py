"""Bounds by multipliers are true whatever the multipliers are, and the best ones are those of a linear program."""

import numpy as np
import pytest
from scipy import sparse
from scipy.optimize import linprog

from smid.identification.inversion import contraction
from smid.identification.inversion.contraction import NOTHING, Program, contracted
from smid.identification.inversion.record import Group
from smid.identification.inversion.rows import Rows

ALL = [Group((0, 1, 2), None)]


def random_rows(rng, count, unknowns, around=None):
    """Return rows that a point keeps, or any."""
    slopes = rng.normal(size=(count, unknowns)) * 10.0 ** rng.integers(-3, 3, (count, 1))
    size = np.abs(slopes).sum(axis=1)
    radius, centre = rng.uniform(0.05, 0.5, count) * size, rng.uniform(-0.5, 0.5, count) * size
    if around is not None:
        centre = -slopes @ around + rng.uniform(-1, 1, count) * radius
    sources = np.column_stack([np.zeros((count, 3), dtype=np.int64), np.arange(count)])
    return Rows(centre, radius, sparse.csr_array(slopes), sources, -1)


def least(rows, k, sign):
    """Return the least ``sign e_k`` by scipy; None where no point keeps the rows."""
    slopes = rows.slopes.toarray()
    cost = np.zeros(slopes.shape[1])
    cost[k] = sign
    size = np.abs(slopes).max(axis=1)
    sides = np.concatenate([(rows.radius - rows.centre) / size, (rows.radius + rows.centre) / size])
    slopes /= size[:, None]
    found = linprog(cost, np.vstack([slopes, -slopes]), sides, bounds=[(-1, 1)] * len(cost))
    return found.fun if found.status == 0 else None


def proven(rows, proof):
    """Return the bound that some multipliers prove."""
    values = np.zeros(len(rows.centre))
    values[proof.sources[:, 3]] = proof.values
    return Program(rows)._proven(values, proof.unknown, proof.sign)[0]


@pytest.mark.parametrize("seed", range(10))
def test_any_multipliers_give_a_true_bound(seed: int) -> None:
    rng = np.random.default_rng([seed, 1])
    point = rng.uniform(-1, 1, 3)
    program = Program(random_rows(rng, 12, 3, around=point))
    for _ in range(50):
        values = rng.normal(size=12) * 10.0 ** rng.integers(-8, 8) * (rng.random(12) < 0.5)
        for k, sign in ((0, 1), (2, -1), (NOTHING, 1)):
            bound, _ = program._proven(values, k, sign)
            assert bound <= (0.0 if k == NOTHING else sign * point[k])


@pytest.mark.parametrize("seed", range(10))
def test_a_box_is_contracted_to_what_a_linear_program_leaves(seed: int) -> None:
    rng = np.random.default_rng([seed, 2])
    centre, half = rng.normal(size=3), 10.0 ** rng.uniform(-4, 2, 3)
    rows = random_rows(rng, 15, 3, around=rng.uniform(-1, 1, 3))
    found = contracted(rows, centre - half, centre + half, ALL)
    assert not found.empty
    expected = [(centre[k] + half[k] * least(rows, k, 1), centre[k] - half[k] * least(rows, k, -1)) for k in range(3)]
    ends = np.column_stack([found.lower, found.upper])
    assert np.all(np.abs(ends - expected) <= 1e-6 * half[:, None])
    assert np.all((found.lower - 1e-6 * half <= found.inside) & (found.inside <= found.upper + 1e-6 * half))
    # Each end is proven by its own multipliers.
    for proof in found.proof:
        k = proof.unknown
        end = ends[k, 0] if proof.sign > 0 else -ends[k, 1]
        assert proof.sign * centre[k] + half[k] * proven(rows, proof) == pytest.approx(end, abs=1e-9 * half[k] + 1e-12)


def test_only_what_holds_no_point_is_proven_empty_and_all_of_it() -> None:
    rng, verdicts = np.random.default_rng(3), []
    for _ in range(60):
        rows = random_rows(rng, int(rng.integers(2, 8)), 3)
        has_point = least(rows, 0, 1) is not None
        found = contracted(rows, -np.ones(3), np.ones(3), ALL)
        verdicts.append((has_point, found.empty))
        if found.empty and found.proof[-1].unknown == NOTHING:
            assert proven(rows, found.proof[-1]) > 0
    assert set(verdicts) == {(True, False), (False, True)}


def test_a_program_that_the_solver_refuses_proves_nothing_false() -> None:
    """A row that lies beyond what the solver takes for infinite leaves no multipliers, or those of a true proof."""
    slopes = sparse.csr_array(np.array([[1.0, 0.5], [1.0, -1.0]]))
    rows = Rows(np.array([1e20, 0.0]), np.ones(2), slopes, np.array([[0, 0, 0, 0], [0, 0, 0, 1]]), -1)
    program = Program(rows)
    assert program.end(0, 1) is None
    proof = program.emptiness()
    assert proof is None or proven(rows, proof) > 0


def test_a_program_that_does_not_end_proves_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    """The simplex method may cycle for ever: it is stopped after many iterations."""
    monkeypatch.setattr(contraction, "_ITERATIONS", 0)
    rows = random_rows(np.random.default_rng(4), 15, 3, around=np.array([0.5, -0.5, 0.0]))
    found = contracted(rows, -np.ones(3), np.ones(3), ALL)
    assert not found.empty
    assert found.lower.tolist() == [-1.0] * 3
