"""An effect is hidden and has to be found: the reduced, fixed set of `python -m benchmarks.blind`."""

from __future__ import annotations

from itertools import count

import pytest

from benchmarks.blind.cases import ranked
from benchmarks.blind.diagnose_case import diagnose_case
from benchmarks.blind.effects import EFFECTS

# Every fifth effect of the table but one that takes a minute, each by the first seed that hides it.
NAMES = [name for name in list(EFFECTS)[::5] if name != "rate_limit"]
SEEDS = [next(seed for seed in count() if ranked(seed, "single")[0] == name) for name in NAMES]


@pytest.mark.parametrize("seed", SEEDS)
def test_the_hidden_effect_is_named_first(seed: int) -> None:
    outcome = diagnose_case("single", seed, 1000)
    assert outcome.verdict == "named", outcome.message
    assert outcome.named[0] == outcome.truth[0]
    assert outcome.ratio < 1.5


@pytest.mark.parametrize("kind", ["none", "none, bound withheld"])
def test_nothing_is_named_where_nothing_is_wrong(kind: str) -> None:
    outcomes = [diagnose_case(kind, seed, 1000) for seed in range(20 if kind == "none" else 2)]
    assert [o.named for o in outcomes] == [()] * len(outcomes)


def test_two_hidden_effects_are_both_named() -> None:
    outcome = diagnose_case("pair", 0, 1000)
    assert set(outcome.named) == set(outcome.truth)
