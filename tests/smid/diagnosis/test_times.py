"""Every time that a diagnosis tells is a time of the record, also of one that was cropped."""

from dataclasses import replace

import numpy as np
import pytest

from smid import Dataset, OutputError, diagnose
from smid.diagnosis.evidence.faults import data_faults

BEGIN, CHANGE, STEP = 400, 553, 0.5  # samples of the whole record, and s


@pytest.fixture(scope="module")
def cropped():
    """The end of a record whose plant doubles its gain."""
    random = np.random.default_rng(4)
    u = np.repeat(random.choice([-1.0, 1.0], 80), 10)
    w = np.zeros(u.size)
    for k in range(1, u.size):
        w[k] = 0.8 * w[k - 1] + (0.4 if k > CHANGE else 0.2) * u[k - 1]
    y = w + random.uniform(-0.02, 0.02, u.size)
    return Dataset.from_arrays(input={"u": u}, output={"y": y}, sampling_time=STEP).crop(BEGIN)


def change_time(diagnosis):
    (moment,) = [p for cause in diagnosis.causes for p in cause.parameters if p.name == "change_time"]
    return moment


def test_a_change_and_a_misfit_have_the_times_of_the_record(cropped):
    def diagnosed(data):
        return diagnose(OutputError(delay=1), data, 0.03, ["parameter_change"], certify=False, workers=1)

    diagnosis = diagnosed(cropped)
    moment = change_time(diagnosis)
    assert any(f"At {moment.value:.3g} s" in cause.sentence for cause in diagnosis.causes)
    (run,) = cropped.experiments
    from_zero = change_time(diagnosed(replace(cropped, experiments=(replace(run, start_time=0.0),))))
    begin = STEP * BEGIN
    assert [moment.value, moment.lower, moment.upper] == pytest.approx(
        [begin + from_zero.value, begin + from_zero.lower, begin + from_zero.upper], abs=1e-3
    )
    intervals = diagnosis.misfit.violations.intervals
    assert begin <= intervals[0].start <= intervals[-1].stop < STEP * (BEGIN + cropped.n_samples)
    for axes in diagnosis.plot().axes:
        left, right = axes.get_xlim()
        assert begin - 2 <= left < right <= STEP * (BEGIN + cropped.n_samples) + 2


def test_a_glitch_in_the_data_has_the_time_of_the_record():
    random = np.random.default_rng(0)
    u = random.standard_normal(400)
    y = np.convolve(u, 0.8 ** np.arange(20))[:400] + 0.1 * random.standard_normal(400)
    y[250] += 9
    data = Dataset.from_arrays(input={"u": u}, output={"y": y}, sampling_time=STEP).crop(100)
    (glitch,) = [fault for fault in data_faults(data) if fault.kind == "outliers"]
    assert f"at {STEP * 250:g} s" in glitch.sentence
