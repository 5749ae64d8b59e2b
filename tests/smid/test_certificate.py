"""The proof of an estimate in a file: it proves the published ends, from the priors alone."""

from typing import Any

import numpy as np
import pytest
import sympy

from benchmarks.frontier.records import errors_in_variables, hammerstein, output_error
from relaxations import check
from smid import Dataset, EmptyFeasibleSetError, Estimate, FeasibleSet, ModelError, OutputError, identify

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
    kinked = OutputError(bounds={"a1": (-0.9, 0), "b0": (0, 2)}).insert_before("y", lambda w: sympy.Max(0, w))
    with pytest.raises(ModelError, match=r"Max, Min, Abs or sign cannot be written"):
        identify(kinked, data, 0.1, certificate=tmp_path / "proof.json")
