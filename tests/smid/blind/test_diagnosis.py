"""An effect is hidden and has to be found: the reduced, fixed set of `python -m benchmarks.blind`."""

from __future__ import annotations

from itertools import count
from pathlib import Path

import pytest

from benchmarks.blind.cases import ranked
from benchmarks.blind.diagnose_case import diagnose_case
from benchmarks.blind.effects import EFFECTS

SAMPLES = 600  # enough for every name, and half the time of the 1000 samples of the benchmark

# Every fifteenth effect of the table, each by the first seed that hides it.
NAMES = list(EFFECTS)[::15]
SEEDS = [next(seed for seed in count() if ranked(seed, "single")[0] == name) for name in NAMES]


@pytest.mark.parametrize("seed", SEEDS)
def test_the_hidden_effect_is_named_first(seed: int, tmp_path: Path) -> None:
    outcome = diagnose_case("single", seed, SAMPLES, tmp_path)
    assert outcome.verdict == "named", outcome.message
    assert outcome.named[0] == outcome.truth[0]
    assert outcome.ratio < 1.5


@pytest.mark.parametrize("kind", ["none", "none, bound withheld"])
def test_nothing_is_named_where_nothing_is_wrong(kind: str, tmp_path: Path) -> None:
    assert diagnose_case(kind, 0, SAMPLES, tmp_path).named == ()
