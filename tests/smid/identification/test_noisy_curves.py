"""Noises that pass a curve or multiply each other: Wiener, noisy inputs of curves, noisy schedules."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from benchmarks.soundness.cases import CURVES, KINDS, empty_case
from benchmarks.soundness.curve_problems import curve_problem
from relaxations import check
from relaxations.check.arithmetic import Refused
from relaxations.search.hierarchy import intervals
from smid import EmptyFeasibleSetError, FeasibleSet, identify, verify

SETS, CHUNK = 102, 17


@pytest.mark.parametrize("first", range(0, SETS, CHUNK))
def test_the_truth_is_inside_and_inner_ends_within_outer_ones(first: int) -> None:
    for seed in range(first, first + CHUNK):
        known = curve_problem(seed, n_samples=7)
        feasible = FeasibleSet(known.model, known.data, known.noise_bound)
        targets = range(len(feasible.model.parameters))
        found = intervals(feasible.problem, targets, tolerance=0.5, order=1, rounds=1, witnesses=seed % 10 == 0)
        assert found.empty is None, seed
        for i in found.intervals:
            assert i.lower <= known.truth[i.name] <= i.upper, (seed, i.name)
            assert np.isnan(i.inner_lower) or i.lower <= i.inner_lower <= i.inner_upper <= i.upper, (seed, i.name)


@pytest.mark.parametrize("kind", CURVES)
def test_verified_points_satisfy_every_equation_and_bound(kind: str) -> None:
    """The points hold the noises of the curves too, within rounding."""
    known = curve_problem(4, kind, 12, inside=True)
    feasible = FeasibleSet(known.model, known.data, known.noise_bound)
    enclosure = identify(known.model, known.data, known.noise_bound, tolerance=0.2).enclosure
    assert enclosure is not None
    assert enclosure.witnesses
    problem = feasible.problem
    for point in enclosure.witnesses:
        size = np.abs(point).max() + 1
        assert np.abs(problem.equalities.evaluate(point)).max() < 1e-9 * size
        assert (point >= problem.lower - 1e-12 * size).all()
        assert (point <= problem.upper + 1e-12 * size).all()


@pytest.mark.parametrize("kind", CURVES)
def test_the_proof_is_checked_and_follows_from_model_and_record(kind: str, tmp_path: Path) -> None:
    known = curve_problem(4, kind, 8, inside=True)
    file = tmp_path / "proof.json"
    estimate = identify(known.model, known.data, known.noise_bound, tolerance=0.5, order=1, rounds=2, certificate=file)
    found = verify(file, known.data, known.model, known.noise_bound)
    assert not found.empty
    for interval in estimate.intervals:
        assert found.intervals[interval.name] == (interval.lower, interval.upper)


@pytest.fixture(scope="module")
def proof(tmp_path_factory: pytest.TempPathFactory) -> dict:
    known = curve_problem(4, "hammerstein, noisy input", 8)
    file = tmp_path_factory.mktemp("proof") / "proof.json"
    identify(known.model, known.data, known.noise_bound, tolerance=0.5, order=1, rounds=1, certificate=file)
    return check.read(file)


def _fixed_rows(document: dict) -> list[dict]:
    return [row for step in document["steps"] if "fixed" in step for row in step["fixed"]]


def test_a_row_with_too_small_a_slack_is_refused(proof: dict) -> None:
    loose = next(row for row in _fixed_rows(proof) if float.fromhex(row["slack"]) > 0)
    true, loose["slack"] = loose["slack"], (0.999 * float.fromhex(loose["slack"])).hex()
    with pytest.raises(Refused, match="slack >= "):
        check.check(proof)
    loose["slack"] = true
    check.check(proof)


def test_a_row_at_the_wrong_end_or_of_the_wrong_sign_is_refused(proof: dict) -> None:
    tight = next(row for row in _fixed_rows(proof) if float.fromhex(row["slack"]) == 0)
    tight["sign"] = -tight["sign"]
    with pytest.raises(Refused, match="slack >= "):
        check.check(proof)
    tight["sign"] = -tight["sign"]
    place = tight["values"][0]
    place[1] = (-float.fromhex(place[1])).hex()
    with pytest.raises(Refused, match="slack >= "):
        check.check(proof)
    place[1] = (-float.fromhex(place[1])).hex()


@pytest.mark.parametrize("kind", CURVES)
def test_an_output_out_of_reach_proves_the_set_empty(kind: str) -> None:
    case = empty_case(KINDS.index(kind))
    with pytest.raises(EmptyFeasibleSetError) as error:
        identify(case.model, case.data, case.noise_bound, order=1)
    assert "proven: no parameters explain the data" in str(error.value)


@pytest.mark.parametrize(("kind", "complicating"), [("wiener", ("alpha",)), ("lpv, noisy schedule", ("a0", "a1"))])
def test_fifty_samples_have_tight_ends(kind: str, complicating: tuple[str, ...]) -> None:
    known = curve_problem(4, kind, 50, inside=True)
    found = identify(known.model, known.data, known.noise_bound, tolerance=0.05)
    assert found.enclosure is not None
    assert found.enclosure.complicating == complicating
    for i in found.intervals:
        assert i.lower <= known.truth[i.name] <= i.upper
        assert i.gap <= 0.05 * i.width
