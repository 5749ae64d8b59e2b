"""The variants in which a case is diagnosed say the same of the plant: the base model fits each of them alike."""

import numpy as np
import pytest

from benchmarks.blind.cases import draw
from benchmarks.invariances import OUTPUT, VariantResult, in_other_units, in_two, page, renamed, reordered, scaled
from smid import Dataset, Model
from smid.fitting.binding import bind
from smid.fitting.fit import fit


def _error(model: Model, data: Dataset) -> float:
    bound = bind(model, data)
    return float(np.std(np.concatenate(fit(bound, data).residual(data, bound.output_channels[0]))))


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_the_base_model_fits_every_variant_alike(seed: int) -> None:
    case = draw(seed, 1, 600)
    data = in_two(case.data)
    expected = _error(case.model, data)
    assert _error(*renamed(case.model, data)) == pytest.approx(expected, rel=1e-5)
    assert _error(case.model, reordered(data)) == pytest.approx(expected, rel=1e-5)
    assert _error(in_other_units(case.model, data), scaled(data)) / OUTPUT == pytest.approx(expected, rel=1e-5)
    other = renamed(case.model, data)[0]
    assert {p.name for p in other.parameters}.isdisjoint(p.name for p in case.model.parameters)
    assert set(other.channels).isdisjoint(case.model.channels)
    assert {line.signal for line in other.lines}.isdisjoint(line.signal for line in case.model.lines)


def test_the_page_counts_what_differs() -> None:
    def result(variant: str, named: str, rmse: float) -> VariantResult:
        return VariantResult(3, variant, ("gain",), (named,), rmse, 1.0)

    text = page([result("as it is", "gain", 1.0), result("names", "gain", 1.02), result("units", "time_constant", 1.0)])
    assert "| names | 1 | 1 | 0 |" in text
    assert "| units | 1 | 0 | 0 |" in text
    assert "Seed 3, hidden gain, units: time_constant (1) instead of gain (1)." in text
