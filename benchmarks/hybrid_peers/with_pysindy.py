"""PySINDy: sparse regression of the acceleration on voltage and terms of the friction; then SciPy's solver."""

import numpy as np
import pysindy
from scipy.integrate import solve_ivp
from scipy.signal import savgol_filter


def train(u, y, h, _start):
    speed, acceleration = (savgol_filter(y, 7, 4, deriv=k, delta=h) for k in (1, 2))
    middle = np.concatenate([u[:1], (u[1:] + u[:-1]) / 2])
    terms = [lambda v: v, lambda v: np.tanh(v / 0.03), lambda v: v * np.abs(v), lambda v: v**3]
    friction = pysindy.CustomLibrary(terms, [lambda n, k=k: f"f{k}({n})" for k in range(4)])
    motor = pysindy.PolynomialLibrary(1, include_bias=False)
    library = pysindy.GeneralizedLibrary([friction, motor], inputs_per_library=[[0], [1]])
    model = pysindy.SINDy(optimizer=pysindy.STLSQ(threshold=1e-3), feature_library=library)
    model.fit(speed[:, None], t=h, x_dot=acceleration[:, None], u=middle[:, None])
    *friction_of, drive = model.coefficients()[0]

    def simulate(u):
        def rate(_, x, voltage):
            return [x[1], drive * voltage + sum(c * term(x[1]) for c, term in zip(friction_of, terms, strict=True))]

        state, angles = np.zeros(2), []
        for voltage in u:
            angles.append(state[0])
            run = solve_ivp(rate, (0, h), state, "LSODA", args=(voltage,), rtol=1e-4, atol=1e-6)
            state = run.y[:, -1]
        return angles

    return drive / 15.96, simulate
