"""Outputs that share nothing are identified apart: the intervals are those of all equations together."""

import json

import numpy as np
import pytest
from scipy.signal import lfilter

from relaxations import check
from relaxations.check import bundle
from relaxations.search.enclosure import Reason
from smid import CentreStatus, Dataset, EmptyFeasibleSetError, OwnModel, identify
from smid.identification.separated import separate
from smid.identification.windows import windowed
from smid.verification import NotProvenError, verify

BOUND = {"y1": 0.05, "y2": 0.02}
TRUTH = {"a": -0.7, "b": 0.5, "c": 1.0, "d": 0.4, "e": -0.3}
LINES = ["w1[t] = -a*w1[t-1] + b*u1[t-1] + c*u2[t-1]", "w2[t] = -d*w2[t-1] + e*u1[t-1]"]
BOX = {"a": [-1, 1], "b": [-3, 3], "c": [-3, 3], "d": [-1, 1], "e": [-3, 3]}


def model(**changed):
    settings = {"equations": LINES, "outputs": {"y1": "w1", "y2": "w2"}, "inputs": ["u1", "u2"], "parameters": BOX}
    return OwnModel(**(settings | changed))


def record(spoilt: float = 0.0) -> Dataset:
    rng = np.random.default_rng(1)
    u = rng.uniform(-1, 1, (2, 40))
    y1 = lfilter([0, 1], [1, -0.7], 0.5 * u[0] + u[1]) + rng.uniform(-0.05, 0.05, 40)
    y2 = lfilter([0, -0.3], [1, 0.4], u[0]) + rng.uniform(-0.02, 0.02, 40)
    y2[20] += spoilt
    return Dataset.from_arrays(input={"u1": u[0], "u2": u[1]}, output={"y1": y1, "y2": y2}, sampling_time=1.0)


def test_parts_share_nothing():
    parts = separate(model())
    assert [[p.name for p in part.parameters] for part in parts] == [["a", "b", "c"], ["d", "e"]]
    assert [part.channels for part in parts] == [("u1", "u2", "y1"), ("u1", "y2")]


@pytest.mark.parametrize(
    "changed",
    [
        {"constraints": ["a + d <= 1"]},
        {"equations": [LINES[0], LINES[1] + " + w1[t-1]"]},
        {"inputs": {"u1": {"noise": True}, "u2": {}}},
        {"equations": [LINES[0], "w2[t] = -d*w2[t-1] + e*u1[t-1] + b*u2[t-1]"]},
        {"equations": [*LINES, "h[t] = a*u1[t]"], "outputs": {"y1": "w1", "y2": "w2", "y3": "h"}},
    ],
)
def test_what_is_shared_keeps_outputs_together(changed):
    assert len(separate(model(**changed))) == (2 if "y3" in changed.get("outputs", ()) else 1)


@pytest.fixture(scope="module")
def apart():
    return identify(model(), record(), BOUND, tolerance=1e-2)


def test_the_intervals_are_those_of_all_outputs_together(apart, tmp_path):
    together = identify(model(), record(), BOUND, tolerance=1e-2, certificate=tmp_path / "proof.json")
    assert (tmp_path / "proof.json").exists()
    assert apart.reason is Reason.TIGHT
    for one, other in zip(apart, together, strict=True):
        assert one.name == other.name
        assert one.lower <= TRUTH[one.name] <= one.upper
        assert (one.lower, one.upper) == pytest.approx((other.lower, other.upper), abs=1e-2 * other.width)
    assert apart.centre_status is not CentreStatus.INFEASIBLE or apart.nearest is not None


def test_inner_ends_are_those_of_points_of_all_parameters(apart):
    points = np.array(apart.enclosure.witnesses)
    assert points.shape[1] == len(TRUTH)
    assert [i.inner_lower for i in apart] == points.min(axis=0).tolist()


def test_one_empty_part_proves_the_whole_set_empty():
    with pytest.raises(EmptyFeasibleSetError, match="on y2") as proof:
        identify(model(), record(spoilt=5.0), BOUND)
    assert min(abs(k - 20) for _, k, _ in proof.value.samples) <= 1


def test_a_part_without_a_box_leaves_the_others_as_they_are():
    free = BOX | {"e": [-np.inf, np.inf]}
    found = identify(model(parameters=free), record(), BOUND, tolerance=1e-2)
    assert found["e"].lower <= TRUTH["e"] <= found["e"].upper


def test_one_file_holds_the_certificates_of_all_parts(tmp_path):
    file, data = tmp_path / "proof.json", record()
    estimate = identify(model(), data, BOUND, certificate=file)
    content = check.read(file)
    assert len(list(bundle.certificates(content))) == 2
    found = verify(file, data, model(), BOUND)
    assert found.intervals == {i.name: (i.lower, i.upper) for i in estimate}
    # Without the certificate of one part its parameters have their priors.
    del content["rounds"][0]["parts"][0]["certificates"][0]
    file.write_text(json.dumps(content), encoding="utf-8")
    fewer = verify(file, data, model(), BOUND).intervals
    assert fewer == found.intervals | {"a": (-1, 1), "b": (-3, 3), "c": (-3, 3)}
    # The equations of one part are not those of the other.
    (own,) = content["rounds"][0]["parts"][0]["certificates"]
    own["equalities"][0], own["equalities"][1] = own["equalities"][1], own["equalities"][0]
    file.write_text(json.dumps(content), encoding="utf-8")
    with pytest.raises(NotProvenError):
        verify(file, data, model(), BOUND)


def test_a_part_that_is_proven_empty_is_certified(tmp_path):
    file, data = tmp_path / "proof.json", record(spoilt=1.0)
    with pytest.raises(EmptyFeasibleSetError):
        identify(model(), data, BOUND, certificate=file)
    assert verify(file, data, model(), BOUND).empty


def test_the_certificates_of_windows_are_verified(tmp_path, monkeypatch):
    monkeypatch.setattr(windowed, "LONG", 100)
    monkeypatch.setattr(windowed, "_SHARE", 1.0)
    rng = np.random.default_rng(1)
    u = np.repeat(rng.uniform(-1, 1, (2, 40)), 4, axis=1)
    y1 = lfilter([0, 1], [1, -0.7], 0.5 * u[0] + u[1]) + rng.uniform(-0.05, 0.05, 160)
    y2 = lfilter([0, -0.3], [1, 0.4], u[0]) + rng.uniform(-0.02, 0.02, 160)
    data = Dataset.from_arrays(input={"u1": u[0], "u2": u[1]}, output={"y1": y1, "y2": y2}, sampling_time=1.0)
    file = tmp_path / "proof.json"
    estimate = identify(model(), data, BOUND, tolerance=0.1, certificate=file)
    assert estimate.windows
    assert verify(file, data, model(), BOUND).intervals == {i.name: (i.lower, i.upper) for i in estimate}
    content = check.read(file)
    (first, _) = bundle.certificates(content)
    first["origin"]["windows"][0]["last"] -= 1
    file.write_text(json.dumps(content), encoding="utf-8")
    with pytest.raises(NotProvenError):
        verify(file, data, model(), BOUND)
