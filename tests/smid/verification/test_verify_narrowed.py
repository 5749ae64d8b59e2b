"""Certificates of boxes that were narrowed without a free run: accepted as they are, refused after any one change."""

import copy
from typing import Any

import numpy as np
import pytest

from relaxations import check
from relaxations.check import runs
from smid import Dataset, EmptyFeasibleSetError, identify, verify
from tests.smid.pendulum import H, pendulum, swung

BOUND, GRAVITY, DAMPING = 0.002, 9.0, 0.4


PRIOR = (1, 100), (0, 10)


def record() -> Dataset:
    """Return a record of the angle."""
    rng = np.random.default_rng(0)
    inputs = np.repeat(rng.uniform(-6, 6, 8), 5)
    angle = swung(inputs, (0.3, 0.0), gravity=GRAVITY, damping=DAMPING)[:, 0] + rng.uniform(-BOUND, BOUND, len(inputs))
    return Dataset.from_arrays(input={"u": inputs}, output={"y": angle}, sampling_time=H)


@pytest.fixture(scope="module")
def found(tmp_path_factory) -> tuple[Any, Any, Any]:
    """Return the content of a certificate, its file, and the estimate."""
    file = tmp_path_factory.mktemp("proofs") / "pendulum.json"
    estimate = identify(pendulum(*PRIOR), record(), BOUND, tolerance=0.5, nodes=1, certificate=file)
    return check.read(file), file, estimate


def test_the_published_ends_are_proven_from_a_wide_box(found) -> None:
    content, file, estimate = found
    assert content["narrowing"]
    told = verify(file, record(), pendulum(*PRIOR), BOUND)
    for name, truth in (("gravity", GRAVITY), ("damping", DAMPING)):
        interval = estimate[name]
        assert told.intervals[name] == (interval.lower, interval.upper)
        assert 0.9 * truth < interval.lower <= truth <= interval.upper < 1.1 * truth


def test_without_its_steps_a_certificate_is_refused(found) -> None:
    content = {**found[0], "narrowing": []}
    with pytest.raises(check.Refused):
        runs.check(content)


def test_an_empty_set_is_proven_from_a_wide_box(tmp_path) -> None:
    file = tmp_path / "empty.json"
    with pytest.raises(EmptyFeasibleSetError):
        identify(pendulum((11, 100), PRIOR[1]), record(), BOUND, tolerance=0.5, nodes=1, certificate=file)
    content = check.read(file)
    assert content["narrowing"]
    assert runs.check(content) is None
    with pytest.raises(check.Refused):
        runs.check({**content, "narrowing": content["narrowing"][:2]})


# ---------------------------------------------------------------- changed certificates


def modulations(content: Any) -> list[list[int]]:
    return [own for step in content["narrowing"] if "bound" in step for _, own in step["bound"]]


def comparisons(content: Any) -> list[Any]:
    return [step for step in content["narrowing"] if "compare" in step]


def _other_signs(content: Any) -> None:
    for own in modulations(content):
        for k in range(0, len(own), 10):
            own[k + 3], own[k + 4] = -own[k + 3], -own[k + 4]


def _next_intervals(content: Any) -> None:
    for own in modulations(content):
        own[2::5] = [min(now + 1, 39) for now in own[2::5]]


def _half_of_a_function(content: Any) -> None:
    for own in modulations(content):
        del own[: len(own) // 10 * 5]


def _other_coefficients(content: Any) -> None:
    for step in content["narrowing"]:
        for side in step.get("bound", ()):
            side[0] = (side[0] + 1) % 2


def _tighter_values(content: Any) -> None:
    for step in comparisons(content):
        step["upper"][1::2] = [(float.fromhex(value) - 0.5).hex() for value in step["upper"][1::2]]


def _values_of_the_next_samples(content: Any) -> None:
    for step in comparisons(content):
        step["lower"][0::2] = [k + 1 for k in step["lower"][0::2] if k < 39] + [39] * (39 in step["lower"][0::2])


def _values_on_the_other_side(content: Any) -> None:
    for step in comparisons(content):
        step["upper"], step["lower"] = step["lower"], step["upper"]


def _one_cell(content: Any) -> None:
    for step in comparisons(content):
        step["edges"] = []


def _dropped_comparisons(content: Any) -> None:
    content["narrowing"] = [step for step in content["narrowing"] if "bound" in step]


def _dropped_bounds(content: Any) -> None:
    content["narrowing"] = comparisons(content)


def _other_law(content: Any) -> None:
    content["model"]["rates"]["speed"] = content["model"]["rates"]["speed"].replace("sin(", "1.5*sin(")


def _longer_interval(content: Any) -> None:
    content["model"]["interval"] = (1.25 * H).hex()


def _wider_noise(content: Any) -> None:
    content["noise_bounds"]["y"] = (1.5 * BOUND).hex()


def _wider_box(content: Any) -> None:
    content["model"]["parameters"]["damping"] = [0, 1000]


def _changed_samples(content: Any) -> None:
    samples = content["experiments"][0]["channels"]["y"]
    samples[:] = [(1.2 * float.fromhex(y)).hex() for y in samples]


def _missing_samples(content: Any) -> None:
    samples = content["experiments"][0]["channels"]["y"]
    samples[10:20] = [None] * 10


def _claimed_empty(content: Any) -> None:
    content["claim"] = None


CHANGES = [
    _other_signs,
    _next_intervals,
    _half_of_a_function,
    _other_coefficients,
    _tighter_values,
    _values_of_the_next_samples,
    _values_on_the_other_side,
    _one_cell,
    _dropped_comparisons,
    _dropped_bounds,
    _other_law,
    _longer_interval,
    _wider_noise,
    _wider_box,
    _changed_samples,
    _missing_samples,
    _claimed_empty,
]


@pytest.mark.parametrize("change", CHANGES)
def test_a_changed_certificate_is_refused(found, change) -> None:
    content = copy.deepcopy(found[0])
    change(content)
    assert content != found[0]
    with pytest.raises(check.Refused):
        runs.check(content)
