"""The parameters that made the data lie inside every published interval, whatever the solver said."""

import numpy as np
import pytest

import relaxations.proof.bounding
from benchmarks.soundness.random_problems import random_problem
from relaxations.proof.certificate import Certificate
from smid import EmptyFeasibleSetError, identify

PROBLEMS, CHUNK = 25, 5  # `python -m benchmarks.soundness` runs thousands


def escapes(seed: int, **settings: object) -> list[str]:
    """Return what a problem's intervals get wrong."""
    problem = random_problem(seed)
    estimate = identify(problem.model, problem.data, problem.noise_bound, **settings)  # type: ignore[arg-type]
    wrong = []
    for interval in estimate.intervals:
        true = problem.truth[interval.name]
        if not interval.lower <= true <= interval.upper:
            wrong.append(f"seed {seed}, {problem.kind}: {interval.name} = {true} outside {interval}")
        if not np.isnan(interval.inner_lower) and not (
            interval.lower <= interval.inner_lower <= interval.inner_upper <= interval.upper
        ):
            wrong.append(f"seed {seed}, {problem.kind}: a witness outside the certified ends in {interval}")
    return wrong


@pytest.mark.parametrize("first", range(0, PROBLEMS, CHUNK))
def test_truth_lies_inside_every_interval(first: int) -> None:
    """Orders, rounds and noise shapes vary with the seed; nothing may leave the intervals."""
    wrong = []
    for seed in range(first, first + CHUNK):
        wrong += escapes(seed, order=1 if seed % 4 else None, rounds=1 + seed % 3, tolerance=1e-2)
    assert not wrong, wrong


def test_a_weakened_certificate_is_caught(monkeypatch: pytest.MonkeyPatch) -> None:
    """Leave the residual out of the bound, as trusting the solver does, and the check above must fail."""
    honest = relaxations.proof.bounding.certify

    def careless(relaxation, objective, multipliers):  # type: ignore[no-untyped-def]
        proof = honest(relaxation, objective, multipliers)
        return Certificate(proof.bound + proof.residual, proof.residual, multipliers)

    monkeypatch.setattr(relaxations.proof.bounding, "certify", careless)

    def caught(seed: int) -> bool:
        try:
            return bool(escapes(seed, order=1, rounds=3))
        except EmptyFeasibleSetError:  # a false proof as well
            return True

    assert any(caught(seed) for seed in range(40, 60))
