"""The answer of a study compares runs that differ in one factor only."""

from concurrent.futures import ThreadPoolExecutor

import smid
from smid.data import Dataset
from smid.models import OutputError
from smid.study.answer import answer


def record():
    u = [1.0, 0, 1, 1, 0, 0, 1, 0]
    y = [0.0, 1, 0.5, 1.3, 1.6, 0.8, 0.4, 1.2]
    return Dataset.from_arrays(input={"u": u}, output={"y": y}, sampling_time=1.0)


def study_of(noise_bound, orders):
    with ThreadPoolExecutor(1) as executor:
        return smid.order_study(OutputError(stable=True), record(), noise_bound, orders=orders, executor=executor)


def width(noise_bound):
    estimate = smid.identify(OutputError(stable=True), record(), noise_bound)
    return [interval.width for interval in estimate]


def test_it_is_the_median_ratio_of_the_widths():
    study = study_of((0.1, 0.2), [1])
    ratios = [wide / narrow for narrow, wide in zip(width(0.1), width(0.2), strict=True)]
    median = sum(ratios) / 2
    assert study.answer == (
        f"Widths of the intervals, median: {median:.3g} times wider with noise bound 0.2 than with noise bound 0.1."
    )
    assert str(study).endswith(f"{study.answer} {study.conclusion}")
    assert answer(study.done[:1]) == ""


def test_an_order_that_changes_nothing_is_said_to():
    study = study_of(0.1, [2, 1])
    assert study.answer == "Widths of the intervals, median: the same with order 2 as with order 1."
