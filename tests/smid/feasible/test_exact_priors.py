"""Priors keep every number exactly: no closed condition cuts a model off that meets it with equality."""

from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from benchmarks.soundness.prior_cases import PriorCase, prior_case
from smid import Dataset, EmptyFeasibleSetError, FeasibleSet, ModelError, OutputError, identify
from tests.smid.exact_membership import what_excludes

BIG = 2.0**51 + 0.5


def _response(a: list[Fraction], b: list[Fraction], u: list[float]) -> list[Fraction]:
    w: list[Fraction] = []
    for k in range(len(u)):
        past = sum((-a[i] * w[k - 1 - i] for i in range(min(len(a), k))), Fraction(0))
        w.append(past + sum((b[j] * Fraction(u[k - 1 - j]) for j in range(min(len(b), k))), Fraction(0)))
    return w


def test_fixed_coefficients_of_very_different_sizes_are_summed_exactly() -> None:
    u = [float(k) * 2.0**-51 for k in np.random.default_rng(0).integers(-4, 5, 24)]
    b, a = [BIG, 0.3, -BIG], -0.8
    y = [float(w) for w in _response([Fraction(a)], [Fraction(v) for v in b], u)]
    data = Dataset.from_arrays(input={"u": u}, output={"y": y}, sampling_time=1.0)
    # The gain of the truth is 0.3 / 0.2; a sum in floats loses 0.3 beside 2**51, and gives 0.
    fixed = {f"b{k}": value for k, value in enumerate(b)}
    try:
        estimate = identify(OutputError(1, 2, stable=True, fixed=fixed, dc_gain=(0.55, 2.0)), data, 0.05)
    except EmptyFeasibleSetError as error:
        pytest.fail(f"the set holds a1 = {a}: {error}")
    assert estimate["a1"].lower <= a <= estimate["a1"].upper


def test_the_end_that_a_range_of_the_gain_implies_is_rounded_outwards() -> None:
    u = [1.0, -0.5, 0.25, 1.0, -1.0, 0.5, 0.75, -0.25, 1.0, 0.5, -1.0, -0.5, 0.25, 0.0, 1.0, -0.75]
    truth = Fraction(-6, 7)  # of gain 7, the end of the range
    y = [float(w) for w in _response([truth], [Fraction(1)], u)]
    data = Dataset.from_arrays(input={"u": u}, output={"y": y}, sampling_time=1.0)
    estimate = identify(OutputError(1, 0, stable=True, fixed={"b0": 1.0}, dc_gain=(3, 7)), data, 0.05)
    assert Fraction(estimate["a1"].lower) <= truth <= Fraction(estimate["a1"].upper)


@settings(max_examples=300, deadline=None, derandomize=True)
@given(st.integers(0, 10**6))
def test_a_truth_that_meets_the_priors_in_fractions_lies_in_the_problem(seed: int) -> None:
    case = prior_case(seed)
    if case.is_feasible:
        problem = FeasibleSet(case.model(), case.data, case.noise_bound).problem
        assert what_excludes(problem, case.truth | case.noises) == [], case
    elif _is_far_out(case):
        try:
            problem = FeasibleSet(case.model(), case.data, case.noise_bound).problem
        except ModelError:  # what is fixed contradicts a prior
            return
        assert what_excludes(problem, case.truth | case.noises), case


def _is_far_out(case: PriorCase) -> bool:
    """Tell whether a root that should lie in the unit disc is well outside."""
    wanted = (["a"] if case.priors.get("stable") else []) + (["b"] if case.priors.get("minimum_phase") else [])
    numerator, denominator = ([float(v) for k, v in case.truth.items() if k[0] == stem] for stem in "ba")
    roots = {"a": np.roots([1.0, *denominator]), "b": np.roots(numerator)}
    return any(np.abs(roots[stem]).max(initial=0.0) > 1 + 1e-6 for stem in wanted)
