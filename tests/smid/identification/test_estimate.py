"""What an estimate prints and gives away: nothing that is not proven."""

import json
from decimal import Decimal

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from relaxations.search.enclosure import Proof
from smid import Estimate, ParameterInterval, identify
from smid.identification.estimate import round_down, round_up, shown_digits
from tests.smid.first_order import first_order

FLOATS = st.floats(allow_nan=False, allow_infinity=False)


@given(FLOATS, st.integers(1, 17))
def test_printed_ends_are_rounded_outwards(value: float, digits: int) -> None:
    low, high = Decimal(round_down(value, digits)), Decimal(round_up(value, digits))
    exact = Decimal(value)
    assert low <= exact <= high
    for printed in (low, high):
        assert len(printed.as_tuple().digits) <= digits
    if exact:  # and no further than one unit of the last digit
        unit = Decimal(1).scaleb(exact.adjusted() - digits + 1)
        assert high - low <= unit


@given(st.lists(FLOATS, min_size=2, max_size=2).map(sorted))
def test_an_interval_is_printed_with_enough_digits(ends: list[float]) -> None:
    if not np.isfinite(ends[1] - ends[0]):
        return
    interval = ParameterInterval("p", "", ends[0], ends[1], ends[0], ends[1], Proof.PROVEN, Proof.PROVEN)
    digits = shown_digits(interval)
    assert 4 <= digits <= 16
    assert float(round_down(interval.lower, digits)) <= interval.lower
    assert float(round_up(interval.upper, digits)) >= interval.upper


@pytest.mark.parametrize("value", [np.inf, -np.inf, 0.0])
def test_ends_without_digits_print_plainly(value: float) -> None:
    assert round_down(value, 5) == round_up(value, 5) == f"{value:g}"


@pytest.fixture(scope="module")
def estimate() -> Estimate:
    problem = first_order("output error", 12, 1)
    return identify(problem.model, problem.data, problem.noise_bound)


def test_parameters_by_name(estimate: Estimate) -> None:
    assert estimate["b0"] is estimate.intervals[1]
    with pytest.raises(KeyError, match="no parameter 'b1': the model has a1, b0"):
        estimate["b1"]


def test_the_dictionary_is_json(estimate: Estimate) -> None:
    plain = json.loads(json.dumps(estimate.to_dict(), allow_nan=False))
    assert plain["schema"] == Estimate.SCHEMA
    assert plain["noise_bound"] == {"y": 0.1}
    assert plain["derived_boxes"] == ["b0"]
    assert plain["relaxation"]["complicating"] == ["a1"]
    assert plain["data"]["checksum"] == estimate.data.checksum
    for entry, interval in zip(plain["parameters"], estimate.intervals, strict=True):
        # All digits: a proven end survives the file.
        assert (entry["lower"], entry["upper"]) == (interval.lower, interval.upper)
        assert entry["gap"] == interval.gap
        assert entry["proof_lower"] == "proven"
    assert plain["model"]["values"] == estimate.parameters


def test_the_table_shows_proven_ends(estimate: Estimate) -> None:
    rows = {line.split()[0]: line.split() for line in str(estimate).splitlines() if line.split()[0] in ("a1", "b0")}
    for interval in estimate.intervals:
        _, lower, upper, *_ = rows[interval.name]
        assert Decimal(lower) <= Decimal(interval.lower)
        assert Decimal(upper) >= Decimal(interval.upper)
    assert "output error on 12 samples, |noise of y| <= 0.1" in str(estimate)
    for interval in estimate.intervals:
        assert f">{interval.name}</td>" in estimate._repr_html_()


def test_centre_width_and_gap() -> None:
    interval = ParameterInterval("p", "bar", -1.0, 3.0, -0.5, 2.75, Proof.PROVEN, Proof.BOX)
    assert (interval.centre, interval.width, interval.gap) == (1.0, 4.0, 0.5)
    without = ParameterInterval("p", "bar", -1.0, 3.0, np.nan, np.nan, Proof.PROVEN, Proof.BOX)
    assert np.isnan(without.gap)
    assert without.to_dict()["gap"] is None
    # The middle of a huge interval must not overflow.
    assert ParameterInterval("p", "", -1e308, 1.6e308, 0, 0, Proof.PROVEN, Proof.PROVEN).centre == pytest.approx(3e307)
