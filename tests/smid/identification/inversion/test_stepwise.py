"""Stepwise runs: a record that no parameters explain needs few boxes, and the checker accepts the proof."""

import numpy as np
import pytest

from relaxations.check import runs
from relaxations.check.runs.run import STEPWISE
from smid import Dataset
from smid.identification.inversion.certificate import run_certificate
from smid.identification.inversion.cover import Cover
from smid.identification.inversion.record import Record
from smid.models import OwnModel
from smid.models.simulate import simulate

BOUND = 0.02
SECOND = OwnModel(
    ["w[t] = a*w[t-1] + c*w[t-2] + b*u[t-1]"], {"y": "w"}, ["u"], {"a": (-2, 2), "c": (-1, 1), "b": (-10, 10)}
)


def posed(gaps: bool) -> Record:
    """Return a record on which a disturbance acts that the model has not."""
    t = np.arange(120)
    u, rng = np.sin(t / 9.0) + np.sin(t / 23.0), np.random.default_rng(0)
    acting = u + 0.08 * np.sign(np.sin(t / 4.0))
    y = simulate(SECOND, {"u": acting}, {"a": 1.5, "c": -0.6, "b": 0.1})["w"] + rng.uniform(-BOUND, BOUND, 120)
    y[40 : 43 if gaps else 40] = np.nan
    data = Dataset.from_arrays(input={"u": u}, output={"y": y}, sampling_time=1.0)
    return Record(SECOND, data, {"y": BOUND})


def emptied(record: Record) -> Cover:
    cover = Cover(record, 0.0)
    while not cover.done and cover.contracted < 2000:
        cover.step()
    return cover


@pytest.mark.parametrize("gaps", [False, True])
def test_errors_that_rows_share_take_fewer_boxes(gaps):
    record = posed(gaps)
    assert record.stepwise
    stepwise = emptied(record)
    assert not stepwise.boxes
    record.stepwise = False
    anchored = emptied(record)
    assert 3 * stepwise.contracted < anchored.contracted


def test_the_checker_computes_such_rows_itself():
    cover = emptied(posed(True))
    claim, content = run_certificate(cover, {"y": BOUND}, lambda _: None, None)
    assert claim is None
    assert content is not None
    kinds = {row[0] for box in content["boxes"] for step in box.get("passes", ()) for row in step["rows"]}
    assert STEPWISE in kinds
    assert runs.check(content) is None
