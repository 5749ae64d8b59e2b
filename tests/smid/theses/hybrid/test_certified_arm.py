"""Certified intervals of the arm hold the arm that made the data, and each step cuts off nothing that is feasible."""

from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import sparse
from scipy.optimize import linprog

from relaxations.algebra.intervals import Intervals
from smid.data import DataError, Dataset
from smid.models import ModelError
from smid.signals import TABLE_F1, tailored
from smid.theses.hybrid.arm.exact_motion import ARM, exact_motion
from smid.theses.hybrid.certified import certify_arm
from smid.theses.hybrid.certified.arm import arm_record
from smid.theses.hybrid.certified.box import CONSTANTS, ArmBox
from smid.theses.hybrid.certified.relations import arm_problem
from smid.theses.hybrid.certified.speeds import enclose_speeds

H = 0.02
NUMBERS = st.floats(-1e3, 1e3)


def _record(u, noise_bound, seed, values=None, start=(0.0, 0.0)):
    motion = exact_motion(u, H, values=values, start=start)
    noise = np.random.default_rng(seed).uniform(-noise_bound, noise_bound, len(u))
    data = Dataset.from_arrays(input=u, output=motion[:, 0] + noise, sampling_time=H)
    return data, motion, noise


def _creeping(n):
    return tailored(
        n,
        sampling_time=H,
        frequency=0.25,
        amplitude=0.3,
        level=0.06,
        switching=-0.05,
        half_period=0.8,
        shares=(0.3, 0.2),
    )


def _violation(problem, known):
    """Return by how much the inequalities are violated at best where the first variables are known."""
    family = problem.inequalities
    variable = family.factors[:, -1]
    free = variable >= 0
    shape = (family.n_rows, problem.n_variables)
    matrix = sparse.csr_matrix((family.coefficients.mid[free], (family.rows[free], variable[free])), shape)
    constant = np.bincount(family.rows[~free], family.coefficients.mid[~free], family.n_rows)
    count = len(known)
    right = constant + matrix[:, :count] @ known
    left = sparse.hstack([-matrix[:, count:], -np.ones((family.n_rows, 1))]).tocsr()
    boxes = [*zip(problem.lower[count:], problem.upper[count:], strict=True), (0, None)]
    cost = np.append(np.zeros(problem.n_variables - count), 1.0)
    return linprog(cost, A_ub=left, b_ub=right, bounds=boxes).fun


@given(st.tuples(NUMBERS, NUMBERS), st.tuples(NUMBERS, NUMBERS), st.floats(0, 1), st.floats(0, 1))
def test_an_enclosure_holds_what_its_operations_give(first, second, where, there):
    a, b = Intervals.of(min(first), max(first)), Intervals.of(min(second), max(second))
    x = Fraction(min(max(min(first) + where * (max(first) - min(first)), min(first)), max(first)))
    y = Fraction(min(max(min(second) + there * (max(second) - min(second)), min(second)), max(second)))
    for found, exact in (
        (a + b, x + y),
        (a - b, x - y),
        (a * b, x * y),
        (a / 3.0, x / 3),
        (a.square(), x * x),
        (a.signed_square(), x * abs(x)),
        (a.hull(b), y),
    ):
        assert Fraction(float(found.lower)) <= exact <= Fraction(float(found.upper))


@settings(max_examples=20, deadline=None)
@given(
    st.integers(0, 2**32 - 1),
    st.floats(5, 60),
    st.floats(0.0005, 0.01),
    st.floats(0.1, 0.6),
    st.floats(0.0, 1.0),
    st.floats(-20, 20),
    st.sampled_from(["six_equal", "one_sine", "creeping"]),
)
def test_the_true_arm_satisfies_every_relation(seed, theta, b, wd, extra, speed, name):
    values = {"theta": theta, "b": b, "Wd": wd, "Ws": wd + extra, "eps": 0.03, "c": ARM["c"]}
    u = _creeping(120) if name == "creeping" else TABLE_F1[name].signal(120, H)
    data, motion, noise = _record(u, 0.003, seed, values, (0.3, speed))
    record = arm_record(data, 0.003, values["c"], values["eps"])
    random = np.random.default_rng(seed)
    truth = np.array([values[k] for k in CONSTANTS])
    box = ArmBox.of(
        {k: (v * random.uniform(0.3, 1.0), v * random.uniform(1.0, 3.0)) for k, v in zip(CONSTANTS, truth, strict=True)}
    )
    unknown = Intervals.of(np.full(120, -np.inf), np.full(120, np.inf))
    speeds = enclose_speeds(record, box.products, unknown)
    tighter = ArmBox.of({k: (v * 0.99, v * 1.01) for k, v in zip(CONSTANTS, truth, strict=True)})
    for known, now in ((speeds, box), (enclose_speeds(record, tighter.products, speeds), tighter)):
        assert (known.lower <= motion[:, 1]).all()
        assert (motion[:, 1] <= known.upper).all()
        problem = arm_problem(record, now.products, known)
        products = np.concatenate([truth[:1], truth[0] * truth[1:]])
        # The exact motion carries rounding errors of its own, of the angle over its smallest difference.
        assert _violation(problem, np.concatenate([products, noise])) <= 1e-9


@pytest.mark.parametrize("seed", range(2))
def test_intervals_hold_the_arm_whatever_the_noise(seed):
    data, motion, _ = _record(_creeping(200), 0.002, seed)
    found = certify_arm(data, 0.002)
    assert found.holds(ARM)
    assert ((found.speeds.lower <= motion[:, 1]) & (motion[:, 1] <= found.speeds.upper)).all()
    assert found.relative_width("theta") < 0.02
    assert found.relative_width("Wd") < 0.05
    assert found.to_dict()["intervals"]["b"]["lower"] == found.intervals["b"][0]
    assert "1/(kg m2)" in str(found)


def test_a_fast_sine_tells_nothing_of_sticking_and_a_creeping_arm_does():
    # The sine crosses zero speed within a fraction of a sample.
    near = {"theta": (15, 30), "b": (0, 0.01), "Wd": (0, 2)}
    fast = certify_arm(_record(TABLE_F1["six_unequal"].signal(150, H), 0.002, 1)[0], 0.002, prior=near)
    slow = certify_arm(_record(_creeping(200), 0.002, 1)[0], 0.002, prior=near)
    assert not fast.determined("Ws")
    assert fast.intervals["Ws"][1] == 10
    assert "as large as the prior allows" in str(fast)
    assert slow.determined("Ws")
    assert fast.determined("theta")
    assert slow.determined("theta")


def test_a_prior_without_the_arm_and_a_disturbed_record_are_proven_infeasible():
    data, motion, _ = _record(TABLE_F1["six_unequal"].signal(150, H), 0.002, 0)
    with pytest.raises(DataError, match="proven: no arm within the prior"):
        certify_arm(data, 0.002, prior={"theta": (40, 60), "b": (0, 0.01)})
    shaken = motion[:, 0] + 0.05 * np.sin(9 * H * np.arange(150))
    disturbed = Dataset.from_arrays(input=data.values(data.input), output=shaken, sampling_time=H)
    with pytest.raises(DataError, match="extend the law"):
        certify_arm(disturbed, 0.002, prior={"theta": (15, 30)})


def test_bad_input_is_refused():
    data, _, _ = _record(TABLE_F1["six_equal"].signal(20, H), 0.002, 0)
    for bound in (0.0, -1.0, np.nan):
        with pytest.raises(DataError, match="positive number of rad"):
            certify_arm(data, bound)
    with pytest.raises(DataError, match="6 samples for 4 constants"):
        certify_arm(data.crop(stop=6), 0.002)
    with pytest.raises(ModelError, match="prior of theta"):
        certify_arm(data, 0.002, prior={"theta": (0.0, 5.0)})
    with pytest.raises(ModelError, match="constant of the arm"):
        certify_arm(data, 0.002, prior={"mass": (0.0, 5.0)})
    with pytest.raises(DataError, match="2 experiments"):
        certify_arm(data.with_experiments([replace(data.experiments[0], name=name) for name in "ab"]), 0.002)
