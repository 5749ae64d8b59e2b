"""A thinner certificate proves nearly the same bound with fewer and shorter numbers."""

import numpy as np
import pytest

from relaxations.check import check, read
from relaxations.proof.bounding import NOTHING, relax
from relaxations.proof.certificate import certify
from relaxations.proof.certificate_file import write_certificate
from relaxations.proof.proof_steps import Bound
from relaxations.proof.thinned import LONG, thinned


def zeros(proof):
    return sum(int((own == 0).all(axis=1).sum()) for own in proof.multipliers.factors)


@pytest.fixture(scope="module")
def relaxed(output_error):
    model = output_error(LONG, seed=1)
    return relax(model.problem, "lift", 1)


@pytest.mark.parametrize("share", [1e-4, 1e-2])
def test_the_bound_loses_no_more_than_asked(relaxed, share):
    objective = relaxed.problem.variable(1)
    loss = share * float(relaxed.problem.upper[1] - relaxed.problem.lower[1])
    full, thin = relaxed.bound(objective), relaxed.bound(objective, loss=loss)
    assert full.bound - loss <= thin.bound
    assert zeros(thin.certificate) > zeros(full.certificate) + LONG / 2
    assert all((own == own.astype(np.float32)).all() for own in thin.certificate.multipliers.factors)
    scaled = relaxed.scaling.polynomials(objective)
    assert certify(relaxed.relaxation, scaled, thin.certificate.multipliers).bound == thin.bound


def test_the_file_is_shorter_and_accepted(relaxed, tmp_path):
    objective, sizes = relaxed.problem.variable(1), []
    for loss in (0.0, 1e-3):
        proof, file = relaxed.bound(objective, loss=loss), tmp_path / "proof.json"
        write_certificate(file, relaxed.problem, [Bound.of(relaxed, objective, proof)])
        assert check(read(file))[0].bound == proof.bound
        sizes.append(file.stat().st_size)
    assert sizes[1] < 0.6 * sizes[0]


def test_a_short_certificate_and_one_without_a_bound_stay(output_error):
    short = relax(output_error(20, seed=1).problem, "lift", 1)
    proof = short.bound(short.problem.variable(1)).certificate
    assert thinned(short.relaxation, NOTHING, proof, 1.0) is proof
