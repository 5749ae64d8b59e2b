"""Probabilities from merits: which effects are named, ambiguous, in doubt."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from smid.diagnosis.search.posterior import NAMED, posterior, shares
from smid.diagnosis.search.ranking import Visited


class Stub:
    """A set of effects that nothing is asked of but its names."""

    def __init__(self, *names: str) -> None:
        self.names = tuple(sorted(names))


def sets(**merits: float) -> list[Visited]:
    """Sets by their names joined with an underscore; "none" is the empty set."""
    found = [Visited(Stub(*(name.split("_") if name != "none" else ())), merit) for name, merit in merits.items()]
    return sorted(found, key=lambda v: -v.merit)


def apart(_first: Visited, _second: Visited) -> bool:
    return False


def test_what_holds_the_evidence_is_named():
    found = posterior(sets(none=0.0, lag=30.0, bias=10.0), apart)
    assert found.chosen.names == ("lag",)
    assert found.probability["lag"] > NAMED
    assert (found.alternatives, found.doubts) == ((), ())


def test_two_that_share_it_are_ambiguous_and_the_likelier_is_first():
    found = posterior(sets(none=0.0, lag=30.0, delay=29.5, bias=5.0), apart)
    assert found.alternatives == ("lag", "delay")
    assert found.chosen.names == ("lag",)
    assert not found.doubts


def test_one_equation_under_two_names_is_no_ambiguity():
    found = posterior(sets(none=0.0, lag=30.0, delay=29.5), lambda _first, _second: True)
    assert found.alternatives == ()
    assert found.chosen.names == ("lag",)
    assert [one.names for one in found.synonyms] == [("delay",)]


def test_a_further_effect_that_is_likelier_than_not_stays_in_doubt():
    found = posterior(sets(none=0.0, lag=30.0, bias_lag=31.0), apart)
    assert found.chosen.names == ("lag",)
    assert found.doubts == ("bias",)
    assert found.probability["bias"] == pytest.approx(1 / (1 + np.exp(-1.0)), rel=1e-6)


def test_an_effect_that_is_there_twice_needs_the_evidence_for_both():
    once = posterior(sets(none=0.0, drift=30.0, drift_drift=31.0), apart)
    twice = posterior(sets(none=0.0, drift=30.0, drift_drift=40.0), apart)
    assert once.chosen.names == ("drift",)
    assert twice.chosen.names == ("drift", "drift")


@given(st.lists(st.floats(-1e3, 1e3), min_size=1, max_size=6))
def test_shares_add_up_and_follow_the_merits(merits):
    weights = shares([Visited(Stub(), m) for m in sorted(merits, reverse=True)])
    assert weights.sum() == pytest.approx(1.0)
    assert (np.diff(weights) <= 1e-15).all()
