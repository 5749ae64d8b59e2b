"""CasADi: its integrator from sample to sample, and Gauss-Newton's Hessian in IPOPT, as in its example sysid.py."""

import os

import casadi as ca
import numpy as np

SCHEME = os.environ.get("CASADI_SCHEME", "rk")
OPTIONS = {"rk": {"number_of_finite_elements": 4}, "cvodes": {"abstol": 1e-7, "reltol": 1e-6}}

# IPOPT's watchdog takes steps that diverge in free run.
IPOPT = {"max_iter": 100, "print_level": 0, "sb": "yes", "watchdog_shortened_iter_trigger": 0}


def train(u, y, h, start):
    state, voltage, theta = ca.MX.sym("x", 2), ca.MX.sym("u"), ca.MX.sym("p", 17)
    hidden = ca.tanh(theta[1:6] * state[1] / 80 + theta[6:11])
    friction = 16 * (ca.dot(theta[11:16], hidden) + theta[16])
    rate = ca.vertcat(state[1], 16 * theta[0] * (15.96 * voltage - friction))
    dae = {"x": state, "u": voltage, "p": theta, "ode": rate}
    step = ca.integrator("step", SCHEME, dae, 0, h, OPTIONS[SCHEME])
    one = ca.Function("one", [state, voltage, theta], [step(x0=state, u=voltage, p=theta)["xf"]])

    def run(u, theta):
        n = len(u) - 1
        states = one.mapaccum(n)(ca.MX.zeros(2), ca.DM(u[:-1]).T, ca.repmat(theta, 1, n))
        return ca.horzcat(0, states[0, :]).T

    error = run(u, theta) - y
    slope = ca.jacobian(error, theta)
    factor = ca.MX.sym("sigma")
    hessian = ca.Function("H", [theta, ca.MX(), factor, ca.MX()], [factor * ca.triu(slope.T @ slope)])
    options = {"hess_lag": hessian, "print_time": False, "ipopt": IPOPT}
    solver = ca.nlpsol("fit", "ipopt", {"x": theta, "f": ca.dot(error, error) / 2}, options)
    found = solver(x0=start)["x"]
    return 16 * float(found[0]), lambda u: np.array(ca.evalf(run(u, found))).ravel()
