"""A plant behind a dead zone, and what a diagnosis that is not told of it finds."""

import numpy as np

import smid
from smid.diagnosis import diagnose

EFFECTS = ["input_dead_zone", "input_delay", "missing_input"]


def record(dead, count=420):
    """A first-order plant (a1 = -0.85, b0 = 0.6) behind a dead zone, in A."""
    random = np.random.default_rng(0)
    u = np.repeat(random.uniform(-1, 1, count // 10), 10)
    v = np.sign(u) * np.maximum(np.abs(u) - dead, 0)
    w = np.zeros(count)
    for k in range(1, count):
        w[k] = 0.85 * w[k - 1] + 0.6 * v[k - 1]
    return smid.Dataset.from_arrays(
        input={"current": u},
        output={"pressure": w + random.uniform(-0.05, 0.05, count)},
        sampling_time=0.01,
        units={"current": "A", "pressure": "bar"},
        name="run",
    )


def diagnosis_of(dead):
    return diagnose(smid.OutputError(stable=True), record(dead), 0.06, EFFECTS, certify=False, workers=1)
