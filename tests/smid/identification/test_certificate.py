"""The proof of an estimate in a file: it proves the published ends, from the priors alone."""

from typing import Any

import numpy as np
import pytest
import sympy

from benchmarks.records import errors_in_variables, hammerstein, output_error
from benchmarks.soundness.piecewise_problems import piecewise_problem
from relaxations import check
from smid import (
    Dataset,
    EmptyFeasibleSetError,
    Estimate,
    FeasibleSet,
    Hammerstein,
    Model,
    ModelError,
    OutputError,
    Parameter,
    identify,
)

KNOWN = {
    "output error": output_error(12),
    "Hammerstein, boxes by products": hammerstein(10),
    "errors in variables": errors_in_variables(6, poles=1),
}


def proven(document: Any, estimate: Estimate) -> dict[str, tuple[float, float]]:
    """Return the least and largest value of each parameter that a file allows, its prior box included."""
    theorems = check.check(document)
    ends = {}
    for i in estimate.intervals:
        k = document["variables"].index(i.name)
        low, high = ([float(t.bound) for t in theorems if t.objective.mid == {(k,): sign}] for sign in (1, -1))
        prior = prior_of(document, k)
        ends[i.name] = max([*low, prior[0]]), min([*(-h for h in high), prior[1]])
    return ends


def prior_of(document: Any, k: int) -> tuple[float, float]:
    low, high = document["box"][k]
    return -np.inf if low is None else float.fromhex(low), np.inf if high is None else float.fromhex(high)


LONG = {
    "errors in variables, by cuts": errors_in_variables(160, poles=1),
    "Hammerstein, by cuts and the lift": hammerstein(310),
}


@pytest.mark.parametrize("name", [*KNOWN, *LONG])
def test_the_published_ends_are_proven_from_the_priors(tmp_path, name: str) -> None:
    known, file = (KNOWN | LONG)[name], tmp_path / "proof.json"
    estimate = identify(known.model, known.data, known.noise_bound, certificate=file)
    assert estimate.derived
    assert ("cuts" in estimate.enclosure.how) == (name in LONG)
    priors = FeasibleSet(known.model, known.data, known.noise_bound).problem
    document = check.read(file)
    assert [prior_of(document, k) for k in range(priors.n_variables)] == list(
        zip(priors.lower, priors.upper, strict=True)
    )
    ends = proven(document, estimate)
    for i in estimate.intervals:
        assert (i.lower, i.upper) == ends[i.name]


@pytest.mark.parametrize("kind", ["two-sided dead zone", "soft threshold", "delay", "coulomb", "gap and limit"])
def test_the_ends_of_a_piecewise_model_are_proven(tmp_path, kind: str) -> None:
    known, file = piecewise_problem(kind, 4, 14, share=0.3 if kind == "coulomb" else 0.04), tmp_path / "proof.json"
    estimate = identify(known.model, known.data, known.noise_bound, tolerance=0.2, order=1, certificate=file)
    document = check.read(file)
    assert len(document["kinks"]) >= 4
    ends = proven(document, estimate)
    for i in estimate.intervals:
        assert (i.lower, i.upper) == ends[i.name]
        prior = prior_of(document, document["variables"].index(i.name))
        assert prior[0] <= i.lower <= i.upper <= prior[1]
        assert prior != (i.lower, i.upper)


def rectified(n: int) -> tuple[Model, Dataset]:
    """Return a gain of no known size behind a threshold, and data of it."""
    u = 0.3 + 0.6 * np.sin(1.3 * np.arange(n))
    y = np.zeros(n)
    for k in range(1, n):
        y[k] = 0.6 * y[k - 1] + 1.1 * max(0.0, u[k - 1] - 0.2)
    d = Parameter("d", 0, 0.5)
    model = OutputError(stable=True).insert_before("u", lambda x: sympy.Max(0, x - d.symbol), parameters=[d])
    return model, Dataset.from_arrays(input={"u": u}, output={"y": y}, sampling_time=1.0)


def test_a_derived_box_beside_kinks_is_proven(tmp_path) -> None:
    model, data = rectified(24)
    estimate = identify(model, data, 0.05, tolerance=0.2, certificate=tmp_path / "proof.json")
    assert estimate.derived == ("b0",)
    ends = proven(check.read(tmp_path / "proof.json"), estimate)
    assert all((i.lower, i.upper) == ends[i.name] for i in estimate.intervals)


def test_an_empty_set_beside_kinks_is_proven_and_names_its_samples(tmp_path) -> None:
    model, data = rectified(24)
    y = data.values("y").copy()
    y[19] += 1.0  # where the input is below the threshold, which was all that was needed
    broken = Dataset.from_arrays(input={"u": data.values("u")}, output={"y": y}, sampling_time=1.0)
    with pytest.raises(EmptyFeasibleSetError) as caught:
        identify(model, broken, 0.05, certificate=tmp_path / "proof.json")
    assert caught.value.samples[0][1] == 19
    assert any(theorem.empty for theorem in check.check(check.read(tmp_path / "proof.json")))


@pytest.mark.parametrize("method", ["lift", "benders"])
@pytest.mark.parametrize("name", ["output error", "Hammerstein, boxes by products"])
def test_an_empty_set_is_proven_in_the_file(tmp_path, name: str, method: str) -> None:
    known, file = KNOWN[name], tmp_path / "proof.json"
    bound = {c: 0.3 * b for c, b in known.noise_bound.items()}
    with pytest.raises(EmptyFeasibleSetError):
        identify(known.model, known.data, bound, method=method, certificate=file)
    assert any(theorem.empty for theorem in check.check(check.read(file)))


def test_what_cannot_be_written_is_refused_before_any_work(tmp_path) -> None:
    u, y = [1.0, 0, 1, 1, 0, 0.7, 1, 0], [0.0, 0.5, 0.25, 0.62, 0.81, 0.4, 0.4, 0.7]
    data = Dataset.from_arrays(input={"u": u}, output={"y": y}, sampling_time=1.0)
    model = OutputError(stable=True)
    with pytest.raises(ModelError, match="make the folder first"):
        identify(model, data, 0.1, certificate=tmp_path / "nowhere" / "proof.json")
    d = Parameter("d", 0, 0.8)
    kinked = Hammerstein(1, (1,), stable=True)
    kinked = kinked.insert_before("u", lambda x: sympy.Max(0, x - d.symbol), parameters=[d])
    with pytest.raises(ModelError, match=r"a box for gamma1 beside Max, Min, Abs or sign cannot be written"):
        identify(kinked, data, 0.1, certificate=tmp_path / "proof.json")
