import numpy as np
import pytest

import smid
from tests.smid.reports.dead_zone_records import diagnosis_of


def record(seed, count=40):
    random = np.random.default_rng(seed)
    u = random.choice([-1.0, 1.0], count)
    w = np.zeros(count)
    for k in range(1, count):
        w[k] = 0.7 * w[k - 1] + 0.5 * u[k - 1]
    y = w + random.uniform(-0.1, 0.1, count)
    return smid.Dataset.from_arrays(
        input={"u": u}, output={"y": y}, sampling_time=0.1, units={"u": "V", "y": "bar"}, name=f"run {seed}"
    )


@pytest.fixture(scope="session")
def data():
    return record(1)


@pytest.fixture(scope="session")
def estimate(data):
    model = smid.OutputError(na=1, stable=True, bounds={"b0": (0.49, 2.0)})  # the data alone would allow less
    return smid.identify(model, data, noise_bound=0.1)


@pytest.fixture(scope="session")
def bound(data):
    return smid.error_bound(smid.OutputError(na=1, stable=True), data)


@pytest.fixture(scope="session")
def validation(estimate):
    return smid.validate(estimate.model, record(2), 0.1)


@pytest.fixture(scope="session")
def named():
    """A diagnosis that names the dead zone of its record."""
    return diagnosis_of(0.3)


@pytest.fixture(scope="session")
def pages(tmp_path_factory, estimate, bound, validation, named):
    """A folder with the pages of the estimate, the diagnosis, a comparison and residuals."""
    folder = tmp_path_factory.mktemp("pages")
    smid.report(estimate, folder / "identification.html", bound, [validation])
    smid.report(named, folder / "diagnosis.html")
    static = smid.OutputError(na=0).with_values({"b0": 0.5})
    smid.report(smid.compare({"first order": estimate, "static": static}, record(2)), folder / "comparison.html")
    smid.report(smid.residuals(static, record(3, 200)), folder / "residuals.html")
    return folder
