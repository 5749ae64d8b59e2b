"""What an interval states of the rates holds for the motion that another method computes, over boxes of any width."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from smid import Dataset, OwnModel
from smid.identification.inversion.record import Record
from smid.identification.inversion.rows import BALANCES
from smid.models import Reactor
from smid.signals import qprs
from smid.theses.hybrid import Mismatch, simulate_reactor
from tests.smid.identification.inversion.kept import is_kept


def _record(model, u, y, bound, seed):
    noise = np.random.default_rng(seed).uniform(-bound, bound, y.shape)
    channels = dict(zip((m.channel for m in model.measurements), (y + noise).reshape(len(u), -1).T, strict=True))
    data = Dataset.from_arrays(input={"u": u}, output=channels, sampling_time=model.sampling_time)
    return Record(model, data, dict.fromkeys(channels, bound))


def _balances(record, lower, upper):
    rows = record.rows(lower, upper)
    assert rows.impossible < 0
    return rows.where(rows.sources[:, 0] == BALANCES)


@settings(max_examples=15, deadline=None)
@given(
    st.integers(0, 2**32 - 1),
    st.floats(0.5, 6.0),
    st.floats(0.3, 4.0),
    st.sampled_from([1.0, 1.7, 2.0, 3.0]),
    st.sampled_from([0.3, 1.0, 2.0]),
)
def test_the_true_reactor_keeps_every_balance(seed, tau, a, power, h):
    u = qprs(25, seed=seed, levels=(0.2, 0.4, 0.9), sampling_time=h, periods=(h, 3 * h))
    model = Reactor(None, None, power, scheme="enclosed", sampling_time=h)
    y = simulate_reactor(Mismatch(tau=tau, a=a, x=power), u, h)
    record = _record(model, u, y, 0.001, seed)
    truth = np.array([tau, a, power, y[0]])
    random = np.random.default_rng(seed)
    for share in (1.0, 0.1, 1e-3):
        lower = truth + share * random.uniform(0, 1, 4) * (record.lower - truth)
        upper = truth + share * random.uniform(0, 1, 4) * (record.upper - truth)
        # The plant is integrated with a tolerance of 1e-10.
        assert is_kept(_balances(record, lower, upper), truth, lower, upper, 1e-8)


@pytest.mark.parametrize("seed", range(3))
def test_coupled_states_keep_every_balance(seed):
    # A rate of the second state reads the first one: a box for it is found by trial.
    model = OwnModel(
        ["d/dt h = k*u - c*sqrt(h)", "d/dt g = c*sqrt(h) - d*sqrt(g)"],
        {"y": "h", "z": "g"},
        ["u"],
        {"k": (0.1, 1), "c": (0.05, 0.5), "d": (0.05, 0.5)},
        scheme="enclosed",
        sampling_time=0.5,
    )
    random = np.random.default_rng(seed)
    truth = np.array([0.4, 0.3, 0.25])
    u, states = np.repeat(random.uniform(0.5, 1.5, 10), 4), [np.array([1.0, 2.0])]
    for held in u[:-1]:

        def rates(_, x, held=held):
            flow = truth[1] * np.sqrt(x[0])
            return [truth[0] * held - flow, flow - truth[2] * np.sqrt(x[1])]

        states.append(solve_ivp(rates, (0, 0.5), states[-1], rtol=1e-11, atol=1e-12).y[:, -1])
    record = _record(model, u, np.array(states), 0.01, seed)
    point = np.concatenate([truth, states[0]])
    for share in (0.5, 0.05, 1e-3):
        lower = point + share * random.uniform(0, 1, 5) * (record.lower - point)
        upper = point + share * random.uniform(0, 1, 5) * (record.upper - point)
        found = _balances(record, lower, upper)
        assert share < 0.5 or set(found.sources[:, 2]) == {0, 1}
        assert is_kept(found, point, lower, upper, 1e-9)
