"""The smallest model that explains the data, each smaller one proven not to."""

import numpy as np
import pytest

from smid import Dataset, ModelError, OutputError, error_bound, lowest_order

CANDIDATES = [OutputError(0), OutputError(1, stable=True), OutputError(2, 1, stable=True)]


def record(poles: tuple[float, ...], noise_bound: float, n: int = 20) -> Dataset:
    rng = np.random.default_rng(4)
    u = rng.choice([-1.0, 1.0], n)
    a = np.poly(poles)[1:]
    w = np.zeros(n)
    for k in range(len(a), n):
        w[k] = u[k - 1] - sum(a[i] * w[k - 1 - i] for i in range(len(a)))
    return Dataset.from_arrays(
        input={"u": u}, output={"y": w + rng.uniform(-noise_bound, noise_bound, n)}, sampling_time=1.0
    )


def test_first_order_data() -> None:
    lines: list[str] = []
    found = lowest_order(CANDIDATES, record((0.7,), 0.05), 0.05, progress=lines.append)
    assert [(s.empty, s.feasible) for s in found.steps] == [(True, False), (False, True)]
    assert found.estimate is not None
    assert found.estimate["a1"].lower <= -0.7 <= found.estimate["a1"].upper
    assert found.steps[0].reason.startswith("proven: no parameters explain the data")
    assert [row[1:3] for row in found.table.rows] == [("1", "proven empty"), ("2", "feasible")]
    proven = found.steps[0].least_bound
    assert 0.05 < float(found.table.rows[0][3].removeprefix(">= ")) <= proven
    assert proven <= error_bound(CANDIDATES[0], record((0.7,), 0.05)).upper
    assert (found.channel, found.noise_bound, found.steps[1].least_bound) == ("y", 0.05, None)
    assert lines[0] == "trying output error"


def test_second_order_data_refuse_one_pole_at_small_noise() -> None:
    found = lowest_order(CANDIDATES[1:], record((0.8 + 0.4j, 0.8 - 0.4j), 0.02), 0.02, order=1, rounds=2)
    assert [s.empty for s in found.steps] == [True, False]
    assert found.estimate is not None
    for name, true in {"a1": -1.6, "a2": 0.8}.items():
        assert found.estimate[name].lower <= true <= found.estimate[name].upper


def test_all_proven_empty() -> None:
    found = lowest_order(CANDIDATES[:2], record((0.8 + 0.4j, 0.8 - 0.4j), 0.02), 0.02)
    assert [s.empty for s in found.steps] == [True, True]
    assert found.estimate is None
    assert str(found).count("proven empty") == 2


def test_nothing_to_try_is_refused() -> None:
    with pytest.raises(ModelError, match="no model to try"):
        lowest_order([], record((0.7,), 0.05), 0.05)


def test_settings_reach_the_identification() -> None:
    with pytest.raises(ValueError, match="unknown solver 'none'"):
        lowest_order(CANDIDATES[:1], record((0.7,), 0.05), 0.05, solver="none")
