"""A certified polygon holds the pair of every parameter vector that fits, and touches the set."""

from dataclasses import replace
from itertools import combinations

import jsonschema
import numpy as np
import pytest
from scipy.optimize import linprog

import smid
from benchmarks.bands import feasible_models, random_problem, simulate
from smid import ModelError, OutputError, identify, projections, schemas
from smid.reports.documents import projections_document
from tests.smid.responses.first_order_record import BOUND, U


@pytest.mark.parametrize(("kind", "seed"), [("output error", 1), ("errors in variables", 2)])
def test_truth_and_sampled_models_that_fit_lie_in_the_polygons(kind, seed):
    problem = random_problem(kind, seed)
    found = identify(problem.model, problem.data, problem.bounds)
    a, b = feasible_models(problem, found, 1000, seed)
    names = [f"a{k + 1}" for k in range(a.shape[1])] + [f"b{k}" for k in range(b.shape[1])]
    sampled = dict(zip(names, np.vstack([np.hstack([a, b]), [*problem.a, *problem.b]]).T, strict=True))
    pairs = projections(found)
    assert [pair.names for pair in pairs] == list(combinations(names, 2))
    for pair in pairs:
        values = np.stack([sampled[name] for name in pair.names], 1)
        assert (values @ pair.directions.T <= pair.ends).all()
        assert (pair.points @ pair.directions.T <= pair.ends).all()
        # The check can fail, and the polygon is more than the box.
        assert not ((values + 2 * np.ptp(values, axis=0)) @ pair.directions.T <= pair.ends).all(axis=1).any()
        assert pair.area_percent < 99
        assert pair.gap_percent < 5


def test_the_edges_are_the_range_over_the_feasible_set(record, estimate):
    # At fixed a1 the outputs are linear in b0 and the first output; the rest is a scan.
    y, count, seen = record.values("y"), len(U), []
    for a1 in np.linspace(estimate["a1"].lower, estimate["a1"].upper, 200):
        driven = simulate(np.array([[a1]]), np.ones((1, 1)), 1, U[None], np.zeros((1, 1)))[0]
        columns = np.column_stack([(-a1) ** np.arange(count), driven])
        rows, room = np.vstack([columns, -columns]), np.concatenate([y + BOUND, BOUND - y])
        for sign in (1, -1):
            found = linprog([0, sign], rows, room, bounds=[(None, None)] * 2)
            if found.status == 0:
                seen.append((a1, found.x[1]))
    pair = projections(estimate, directions=16)["a1", "b0"]
    reached = np.array(seen) @ pair.directions.T
    width = reached.max(axis=0) - reached.min(axis=0)
    assert (reached.max(axis=0) <= pair.ends + 1e-9 * np.abs(pair.directions).sum(axis=1)).all()
    assert (pair.ends <= reached.max(axis=0) + 0.03 * width).all()


def test_corners_are_those_of_the_half_planes(estimate):
    pair = projections(estimate)["a1", "b0"]
    tight = (pair.corners @ pair.directions.T >= pair.ends - 1e-9 * np.abs(pair.ends)).sum(axis=1)
    assert (tight >= 2).all()
    assert ((pair.corners @ pair.directions.T) <= pair.ends + 1e-9).all()
    box = replace(pair, directions=pair.directions[:4], ends=pair.ends[:4])
    assert box.area_percent == pytest.approx(100)
    half = replace(
        box, directions=np.vstack([box.directions, [1.0, 0.0]]), ends=np.append(box.ends, estimate["a1"].centre)
    )
    assert half.area_percent == pytest.approx(50, abs=1e-6)


def test_time_that_is_up_leaves_certified_boxes(estimate):
    found = projections(estimate, seconds=1e-9)
    assert not found.complete
    assert found.pairs[0].area_percent == pytest.approx(100)
    assert "stopped early" in str(found)
    lines = []
    whole = projections(estimate, progress=lines.append)
    assert whole.complete
    assert lines[-1].startswith("4 of 4 bounds")


def test_a_report_and_its_json(estimate, tmp_path):
    found = projections(estimate)
    page = smid.report(found, tmp_path / "pairs.html").read_text(encoding="utf-8")
    assert "pairs of parameters" in page
    assert page.count("<svg ") == 1
    jsonschema.validate(projections_document(found), schemas()["smid.projection/1"])
    assert smid.load(smid.report(found, tmp_path / "pairs.json")) == found
    assert len(found.plot().axes) == 1


def test_mistakes_are_told_in_one_line(record, estimate):
    known = identify(OutputError(fixed={"a1": -0.7}), record, 0.1)
    unproven = replace(estimate, enclosure=None)
    for call, words in (
        (lambda: projections(estimate, directions=6), "directions = 6: give a multiple of four"),
        (lambda: projections(estimate, ["a1", "c"]), "'c' is no parameter of the model: choose among a1, b0"),
        (lambda: projections(estimate, ["a1"]), "a pair needs two parameters"),
        (lambda: projections(known, ["a1", "b0"]), "'a1' is no parameter of the model: choose among b0"),
        (lambda: projections(known), "a pair needs two parameters"),
        (lambda: projections(unproven), "the intervals of this estimate are not proven"),
    ):
        with pytest.raises(ModelError, match=words) as told:
            call()
        assert "\n" not in str(told.value)
    with pytest.raises(KeyError, match="no pair"):
        projections(estimate)["a1", "c"]
