"""Symbols for products of unknowns: rows hold for every run, and what is left over is of third order."""

import numpy as np
import pytest

from relaxations.algebra.affine_arithmetic import RADIUS
from relaxations.check import runs
from relaxations.check.runs.run import PRODUCT
from smid import Dataset
from smid.identification.inversion.certificate import run_certificate
from smid.identification.inversion.cover import Cover
from smid.identification.inversion.record import Record
from smid.models import OwnModel
from smid.models.simulate import simulate

BENT = OwnModel(
    ["w[t] = a*w[t-1] + b*u[t-1] + c*u[t-1]**2", "s[t] = w[t]*(1 + d*w[t])"],
    {"y": "s"},
    ["u"],
    {"a": (0.2, 0.9), "b": (0.2, 3.0), "c": (-1.0, 1.0), "d": (-0.5, 0.5)},
).bound(w=(-2.0, 2.0))
TRUTH = {"a": 0.7, "b": 1.0, "c": 0.3, "d": 0.2}
BOUND = 0.02


def posed(disturbed: float = 0.0, experiments: int = 1) -> Record:
    rng = np.random.default_rng(3)
    u = np.repeat(rng.uniform(-1, 1, 15), 4)
    y = simulate(BENT, {"u": u}, TRUTH, {"w": [0.4]})["s"] + rng.uniform(-BOUND, BOUND, 60)
    y += disturbed * np.sign(np.sin(np.arange(60) / 2))
    runs = [
        Dataset.from_arrays(input={"u": u}, output={"y": y}, sampling_time=1.0, name=str(k)) for k in range(experiments)
    ]
    data = runs[0].with_experiments([run.experiments[0] for run in runs])
    return Record(BENT, data, {"y": BOUND}, whole=True)


def around(record: Record, share: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the truth, and a box around it."""
    truth = np.array([*TRUTH.values(), 0.4])
    lower, upper = record.box
    return truth, np.maximum(lower, truth - share * (upper - lower)), np.minimum(upper, truth + share * (upper - lower))


@pytest.mark.parametrize("share", [0.3, 0.05, 1e-3])
def test_the_truth_keeps_every_row_with_its_own_products(share):
    record = posed().with_products()
    truth, lower, upper = around(record, share)
    rows = record.rows(lower, upper)
    e = (truth - 0.5 * (lower + upper)) / (0.5 * (upper - lower))
    j, k = record.products.pairs.T
    products = np.where(j == k, 2 * e[j] ** 2 - 1, e[j] * e[k])
    slopes, known = rows.slopes.toarray(), np.concatenate([e, products])
    shared = np.abs(slopes[:, len(known) :]).sum(axis=1)
    left = np.abs(rows.centre + slopes[:, : len(known)] @ known)
    assert rows.impossible < 0
    assert len(j) > 5
    assert np.all(left <= rows.radius + shared + 1e-9)


def test_rows_with_the_radius_at_the_middle_are_as_many():
    record = posed().with_products()
    _, lower, upper = around(record, 0.1)
    found, sharp = record.rows(lower, upper), record.rows(lower, upper, at_middle=True)
    assert len(sharp.centre) >= len(found.centre) > 60
    assert np.all(sharp.radius.min() <= found.radius)


def test_which_products_a_run_has():
    record = posed().with_products()
    found = {(record.names[j], record.names[k]) for j, k in record.products.pairs}
    assert {("a", "a"), ("a", "b"), ("a", "c"), ("a", "d"), ("b", "b"), ("b", "c")} <= found
    assert ("d", "d") not in found


def test_what_is_left_over_is_of_third_order():
    left = {}
    for record in (posed(), posed().with_products()):
        for share in (1e-2, 1e-3):
            _, lower, upper = around(record, share)
            found = record._run(record.cut.parts[0], 0, lower, upper)
            left[len(record.products.pairs) > 0, share] = found.outputs[found.places[:, 0] == 0, RADIUS].max() - BOUND
    assert left[False, 1e-3] == pytest.approx(1e-2 * left[False, 1e-2], rel=0.5)
    assert left[True, 1e-3] == pytest.approx(1e-3 * left[True, 1e-2], rel=0.5)
    assert left[True, 1e-2] < 0.2 * left[False, 1e-2]


def test_an_empty_set_takes_fewer_boxes():
    """A curve behind a bias that is unknown: its coefficients and the bias are known together, or not at all."""
    model = OwnModel(
        ["v[t] = u[t] + o", "x[t] = b*v[t] + c*v[t]**2 + d*v[t]**3", "w[t] = a*w[t-1] + x[t-1]"],
        {"y": "w"},
        ["u"],
        {"a": (-1, 1), "o": (-1.5, 1.5), "b": (-4, 4), "c": (-4, 4), "d": (-2, 2)},
    )
    rng = np.random.default_rng(3)
    u = np.repeat(rng.uniform(-1, 1, 20), 4)
    run = simulate(model, {"u": u}, {"a": 0.7, "o": 0.3, "b": 1.0, "c": -0.5, "d": 0.4})["w"]
    y = run + 0.1 * np.sign(np.sin(np.arange(80) / 3)) + rng.uniform(-BOUND, BOUND, 80)
    data = Dataset.from_arrays(input={"u": u}, output={"y": y}, sampling_time=1.0)
    record, contracted = Record(model, data, {"y": BOUND}, whole=True), []
    for own in (record, record.with_products()):
        cover = Cover(own, 0.0, deepest_first=True)
        while not cover.done and cover.contracted < 4000:
            cover.step()
        assert not cover.boxes
        contracted.append(cover.contracted)
    assert 3 * contracted[1] < contracted[0]
    # The checker encloses the products itself, and reads what they are between.
    claim, content = run_certificate(cover, {"y": BOUND}, lambda _: None)
    assert claim is None
    kinds = {row[0] for box in content["boxes"] for step in box.get("passes", ()) for row in step["rows"]}
    assert PRODUCT in kinds
    assert runs.check(content) is None


def test_several_runs_have_none():
    assert posed(experiments=2).with_products().products.pairs.size == 0
