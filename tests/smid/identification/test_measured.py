"""A measured record from end to end. The records may not be passed on: they lie beside the checkout or are skipped."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from benchmarks.measured import HAIR_DRYER, held_out_fit
from relaxations.points.witness import verify
from relaxations.search.enclosure import Proof
from smid import FeasibleSet, OutputError, error_bound, identify, validate

FOLDER = Path(__file__).resolve().parents[4] / "shared" / "data"


@pytest.mark.skipif(
    not (FOLDER / HAIR_DRYER.file).is_file(), reason=f"no measured record at ../shared/data/{HAIR_DRYER.file}"
)
def test_hair_dryer() -> None:
    identification, held_out = HAIR_DRYER.load(FOLDER).split(0.5)
    data = identification.crop(0, 100)
    model = OutputError(1, 1, delay=3, offset=True, stable=True)
    bound = error_bound(model, data)
    assert 0 < bound.lower <= bound.upper < np.abs(data.values("y") - data.values("y").mean()).max()
    estimate = identify(model, data, 1.1 * bound.upper, tolerance=1e-2)
    assert estimate.derived == ("b0", "b1", "offset")
    feasible = FeasibleSet(model, data, 1.1 * bound.upper)
    for interval in estimate.intervals:
        assert (interval.proof_lower, interval.proof_upper) == (Proof.PROVEN, Proof.PROVEN)
        assert interval.lower <= interval.inner_lower <= interval.inner_upper <= interval.upper
        assert interval.gap <= 2e-2 * interval.width
    assert estimate.enclosure is not None
    for point in estimate.enclosure.witnesses:
        assert verify(feasible.problem, feasible.problem.variable(0), point) is not None
    # The central model is feasible, so it explains its own record; over the other half it must beat the mean.
    parameters = estimate.parameters
    for name, value in parameters.items():
        assert estimate[name].lower <= value <= estimate[name].upper
    assert held_out_fit(estimate.model, held_out) > 0
    assert validate(estimate.model, replace(held_out, n_init=20)).scores[0].fit_percent > 0
