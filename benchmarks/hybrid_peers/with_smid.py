"""smid: the network in the balance, a linearly implicit scheme, Levenberg-Marquardt with sensitivities."""

import numpy as np

from smid import Dataset
from smid.hybrid import embedded
from smid.hybrid.free_run_error import FreeRunError
from smid.models import RotatingArm, signal, t


def train(u, y, h, start):
    white = RotatingArm(theta=None, scheme="rosenbrock")
    model = embedded(white, {"speed": -16 * white.parameter("theta").symbol}, [signal("speed")[t] / 80], (5,)).model
    model = model.bound(**{p.name: (-1e4, 1e4) for p in model.parameters if p.name.startswith("N_")})
    record = Dataset.from_arrays(input={"u": u}, output={"y": y}, sampling_time=h)
    problem = FreeRunError(model, record, np.array([16.0] + [1.0] * 16))
    found = problem.values(problem.lower(start, evaluations=100))

    def simulate(u):
        held = Dataset.from_arrays(input={"u": u}, output={"y": u}, sampling_time=h)
        return model.simulate(held, found, "rest").outputs[0]["y"]

    return found["theta"], simulate
