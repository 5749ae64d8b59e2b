"""Records of known parameters, for the tests of this folder."""

import numpy as np

from smid.data import Dataset
from smid.recursive import Arx

STRUCTURES = {
    "one pole": Arx(stable=False),
    "three poles": Arx(na=3, nb=2, delay=2, stable=False),
    "Hammerstein": Arx(na=1, powers=(3, 2, 1), input_scale=0.5, stable=False),
    "offset, no pole": Arx(na=0, nb=1, delay=0, offset=True, stable=False),
}
TRUE = {
    "one pole": [-0.8, 0.5],
    "three poles": [-1.1, 0.6, -0.2, 1.0, 0.5, 0.3],
    "Hammerstein": [-0.7, 0.4, -0.3, 1.0],
    "offset, no pole": [2.0, -1.0, 3.0],
}


def arx_record(arx, parameters, n, seed, noise=0.1, u=None):
    """Equation-error data; parameters of shape (n_parameters,) or, for ones that vary, (n, n_parameters)."""
    rng = np.random.default_rng(seed)
    u = rng.uniform(-2, 2, n) if u is None else np.asarray(u, float)
    theta = np.broadcast_to(parameters, (n, len(arx.names)))
    y = noise * rng.normal(size=n)
    for k in range(arx.max_lag, n):
        outputs = y[k - arx.na : k][::-1].tolist()
        inputs = (arx.input_scale * u[k - arx.delay - arx.nb : k + 1][::-1]).tolist()
        y[k] += np.dot(arx.row(outputs, inputs), theta[k])
    return u, y


def as_data(u, y, **options):
    return Dataset.from_arrays(input={"u": u}, output={"y": y}, sampling_time=0.01, units={"y": "bar"}, **options)


def run(estimator, u, y):
    for sample in zip(u, y, strict=True):
        estimator.update(*sample)
    return estimator
