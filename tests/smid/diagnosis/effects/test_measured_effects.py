"""Laws tried on measured records, which may not be passed on: they lie beside the checkout or the tests are skipped."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from benchmarks.measured_cases import two_tanks
from smid import Dataset, OutputError
from smid.data import load_record
from smid.diagnosis.effects.output_saturation import EFFECT as OVERFLOW
from smid.diagnosis.effects.square_root_outflow import EFFECT as ROOT
from smid.diagnosis.effects.stiffness import EFFECT as STIFFNESS
from smid.diagnosis.search.trial import Base, fitted_base, try_effect
from smid.models import Model, simulate
from smid.models.edit_lines import rename_channels

FOLDER = Path(__file__).resolve().parents[5] / "shared" / "data"


def record(name: str) -> Dataset:
    if not (FOLDER / name).is_dir():
        pytest.skip(f"no measured record at ../shared/data/{name}")
    return load_record(name, FOLDER)


def fitted(model: Model, data: Dataset) -> Base:
    (u,), y = data.inputs, data.output
    used = tuple(np.ones(run.n_samples, bool) for run in data.experiments)
    return fitted_base(rename_channels(model, {"u": u, "y": y}), data, used, u, y)


def test_silverbox_has_a_cubic_spring() -> None:
    """Fitted to 4000 samples of the multisine; the arrow, beyond their range, tests the law."""
    data = record("silverbox")
    base = fitted(OutputError(2, 2, delay=0, offset=True, stable=True), data.select("multisine").crop(0, 4000))
    trial = try_effect(STIFFNESS, base)
    assert trial is not None
    assert trial.label == "square and cube on w"
    assert trial.values["spring_cube"] > 0
    arrow = data.select("arrow").experiments[0].values
    before, after = (
        float(np.sqrt(np.mean((simulate(f.model, arrow)[data.output] - arrow[data.output])[100:] ** 2)))
        for f in (base.fit, trial.fit)
    )
    assert after < 0.6e-3
    assert after < 0.05 * before


def test_cascaded_tanks_empty_with_the_root_once_the_overflow_is_known() -> None:
    data = record("cascaded_tanks").select("estimation")
    base = fitted(replace(two_tanks(), sampling_time=data.sampling_time), data)
    overflow = try_effect(OVERFLOW, base)
    assert overflow is not None
    root = try_effect(ROOT, base.extended(overflow))
    assert root is not None
    assert root.values["root_share"] > 0.9
    assert root.fit.cost < overflow.fit.cost
