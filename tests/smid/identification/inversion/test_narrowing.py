"""Boxes narrowed without a free run keep every run that fits: speeds, rows and intervals hold the truth."""

import math
from dataclasses import replace

import numpy as np
import pytest
import sympy
from hypothesis import given, settings
from hypothesis import strategies as st

from relaxations.check import Refused
from relaxations.check.runs import read
from relaxations.check.runs.fixed import ONE
from relaxations.check.runs.narrowing import narrowed_by
from smid import Dataset, EmptyFeasibleSetError, ModelError, OwnModel, identify
from smid.fitting.binding import bind
from smid.identification.inversion.certificate import run_statement
from smid.identification.inversion.frame import middle_and_half
from smid.identification.inversion.narrowed import Steps
from smid.identification.inversion.narrowing import Narrowing
from smid.identification.inversion.record import Record
from smid.identification.inversion.terms import Terms
from smid.models import Reactor
from smid.signals import TABLE_F1, tailored
from smid.theses.hybrid.arm.exact_motion import ARM, exact_motion
from smid.theses.hybrid.arm.proven import CONSTANTS, prove_arm, white_law
from tests.smid.pendulum import H, pendulum, swung

NEAR = {"theta": (15, 30), "b": (0, 0.01), "Wd": (0, 2), "Ws": (0, 10)}


def creeping(n):
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


def arm_record(u, bound, seed, values=None, start=(0.0, 0.0)):
    motion = exact_motion(u, H, values=values, start=start)
    noise = np.random.default_rng(seed).uniform(-bound, bound, len(u))
    return Dataset.from_arrays(input=u, output=motion[:, 0] + noise, sampling_time=H), motion


def narrowing_of(model, data, bound):
    bounds = {data.outputs[0]: bound}
    return Narrowing.of(Record(bind(model, data), data, bounds), bounds)


def last(steps):
    *_, found = steps
    return found


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_a_rate_is_its_coefficients_times_its_functions(seed):
    random = np.random.default_rng(seed)
    model = bind(pendulum((1, 20), (0, 2)), Dataset.from_arrays(input=np.ones(3), output=np.ones(3), sampling_time=H))
    terms = Terms.of(model)
    angle, speed, gravity, damping, u = random.uniform(-3, 3, 5)
    box = np.array([[gravity, gravity], [damping, damping]])
    states = np.array([[[angle, angle + 0.1], [speed, speed]]])
    functions, _ = terms.functions.over(box, states, np.array([1]), np.array([[u, np.nan]]), terms.count)
    values = terms.values.affine(box)[:, 0]
    found = sum(
        np.array([functions.lower[0, own.function], functions.upper[0, own.function]])[:: int(np.sign(value) or 1)]
        * value
        for own in terms.rates[1]
        for value in [values[own.coefficient]]
    )
    inside = angle + 0.1 * random.uniform()
    assert found[0] - 1e-9 <= u - gravity * math.sin(inside) - damping * speed <= found[1] + 1e-9
    assert terms.integral == (-1, 0)
    assert terms.alone == (False, False)


@settings(max_examples=6, deadline=None)
@given(
    st.integers(0, 2**32 - 1),
    st.floats(5, 60),
    st.floats(0.0005, 0.01),
    st.floats(0.1, 0.6),
    st.floats(0.0, 1.0),
    st.floats(-20, 20),
    st.sampled_from(["six_equal", "one_sine", "creeping"]),
)
def test_the_true_arm_keeps_every_bound_and_every_row(seed, theta, b, wd, extra, speed, name):
    values = {"theta": theta, "b": b, "Wd": wd, "Ws": wd + extra, "eps": 0.03, "c": ARM["c"]}
    u = creeping(80) if name == "creeping" else TABLE_F1[name].signal(80, H)
    data, motion = arm_record(u, 0.003, seed, values, (0.3, speed))
    random = np.random.default_rng(seed)
    for least, most in ((0.3, 3.0), (0.99, 1.01)):
        prior = {k: (values[k] * random.uniform(least, 1), values[k] * random.uniform(1, most)) for k in CONSTANTS}
        narrowing = narrowing_of(white_law(prior), data, 0.003)
        known = next(narrowing.steps())
        at, during = known.states[0].at, known.states[0].during
        assert not known.empty
        assert np.all((at.lower <= motion.T) & (at.upper >= motion.T))
        assert np.all((during.lower <= motion[1:].T) & (during.upper >= motion[:-1].T))
        # The rows, at the true unknowns: their products, and of each interval the moment of the speed.
        start = narrowing._start()
        box, products = start.box, start.products
        rows, lower, upper = narrowing._integrals[0].rows(box, products, known.states[0])
        names = [p.name for p in narrowing._record.model.parameters]
        symbols = {sympy.Symbol(k, real=True): values[k] for k in names}
        true = np.concatenate(
            [
                [values[k] for k in names],
                [float(product.subs(symbols)) for product in narrowing.terms.coefficients],
                motion.T.ravel(),
                np.zeros(len(u) - 1),
                0.5 * (motion[1:, 1] + motion[:-1, 1]) - np.diff(motion[:, 0]) / H,
            ]
        )
        middle, half = middle_and_half(lower, upper)
        count = len(names) + len(products.lower)
        told = (half > 0) & (np.arange(len(half)) < count + 2 * len(u))
        assert np.all(np.abs((true - middle)[told]) <= half[told] * (1 + 1e-9) + 1e-9)
        share = np.divide(true - middle, half, out=np.zeros_like(half), where=half > 0)
        # The exact motion carries rounding errors of its own.
        size = np.abs(rows.centre) + abs(rows.slopes) @ np.abs(share) + rows.radius
        assert np.all(np.abs(rows.centre + rows.slopes @ share) <= rows.radius + 1e-9 * (1 + size))


def test_the_constants_of_the_arm_are_proven_from_its_angle():
    data, motion = arm_record(creeping(150), 0.002, 1)
    narrowing = narrowing_of(white_law(), data, 0.002)
    found = last(narrowing.steps())
    ends = dict(zip([p.name for p in narrowing._record.model.parameters], found.box.tolist(), strict=True))
    assert all(low <= ARM[name] <= high for name, (low, high) in ends.items())
    at = found.states[0].at
    assert np.all((at.lower <= motion.T) & (at.upper >= motion.T))
    assert ends["theta"][1] < 1.02 * ends["theta"][0]
    assert ends["Wd"][1] < 1.05 * ends["Wd"][0]
    assert ends["Ws"][1] < 1.3 * ends["Ws"][0]
    lower, upper = narrowing.ends(found)
    first = narrowing._record.names.index("speed[0]")
    assert lower[first] <= motion[0, 1] <= upper[first] < lower[first] + 1


def test_a_prior_without_the_arm_and_a_disturbed_record_are_proven_infeasible():
    data, motion = arm_record(TABLE_F1["six_unequal"].signal(150, H), 0.002, 0)
    with pytest.raises(EmptyFeasibleSetError, match="no parameters within their boxes explain the data"):
        prove_arm(data, 0.002, prior={"theta": (40, 60), "b": (0, 0.01)})
    shaken = motion[:, 0] + 0.05 * np.sin(9 * H * np.arange(150))
    disturbed = Dataset.from_arrays(input=data.values(data.input), output=shaken, sampling_time=H)
    with pytest.raises(EmptyFeasibleSetError, match="extend the model"):
        prove_arm(disturbed, 0.002, prior=NEAR)


def test_the_checker_takes_the_steps_again_and_refuses_other_slices():
    data, motion = arm_record(creeping(50), 0.002, 1)
    bounds = {data.outputs[0]: 0.002}
    prior = {"theta": (20, 23), "b": (0.002, 0.004), "Wd": (0.3, 0.6), "Ws": (0, 10)}
    record = Record(bind(white_law(prior), data), data, bounds)
    statement = {"format": read.FORMAT, "version": read.VERSION, **run_statement(record, bounds), "boxes": []}
    content = {**statement, "claim": None}
    steps = Steps(Narrowing.of(record, bounds), read.document(content).stated, lambda _: None)

    def ends(narrowing):
        document = read.document({**content, "narrowing": narrowing})
        return narrowed_by(document.stated, document.narrowing)

    assert ends(steps.content) == steps.known.ends
    for name, (low, high) in zip([p.name for p in record.model.parameters], steps.known.box, strict=True):
        assert low <= ARM[name] * ONE <= high
    (tube,) = steps.known.tubes
    for own, values in zip(tube, motion.T.tolist(), strict=True):
        assert all(low <= x * ONE <= high for low, x, high in zip(own.low, values, own.high, strict=True))
    # The friction at rest is shaved.
    (first, *_) = [k for k, step in enumerate(steps.content) if "cut" in step]
    for change in ({"steps": []}, {"cut": [*steps.content[first]["cut"][:2], -steps.content[first]["cut"][2]]}):
        with pytest.raises(Refused):
            ends([*steps.content[:first], {**steps.content[first], **change}])


@pytest.mark.parametrize("start", [(0.2, 0.0), (3.0, -1.0)])
def test_a_pendulum_is_known_from_its_angle(start):
    rng = np.random.default_rng(5)
    u = np.repeat(rng.uniform(-6, 6, 15), 10)
    motion = swung(u, start)
    y = motion[:, 0] + rng.uniform(-0.002, 0.002, len(u))
    data = Dataset.from_arrays(input=u, output=y, sampling_time=H)
    found = last(narrowing_of(pendulum((0.1, 100), (0, 50)), data, 0.002).steps())
    (low, high), (least, most) = found.box
    assert 8 < low <= 9.0 <= high < 10
    assert least <= 0.4 <= most < 0.8
    # Two experiments prove no less than either.
    half = [
        replace(run, name=name)
        for name, part in (("first", (0, 75)), ("second", (75, 150)))
        for run in data.crop(*part).experiments
    ]
    both = last(narrowing_of(pendulum((0.1, 100), (0, 50)), data.with_experiments(half), 0.002).steps())
    alone = last(narrowing_of(pendulum((0.1, 100), (0, 50)), data.with_experiments(half[:1]), 0.002).steps())
    assert alone.box[0, 0] - 1e-6 <= both.box[0, 0] <= 9.0 <= both.box[0, 1] <= alone.box[0, 1] + 1e-6


def test_a_hidden_speed_needs_no_bounds_where_its_integral_is_measured():
    rng = np.random.default_rng(2)
    u = np.repeat(rng.uniform(-6, 6, 6), 10)
    motion = swung(u, (0.5, 0.0))
    y = motion[:, 0] + rng.uniform(-0.002, 0.002, len(u))
    data = Dataset.from_arrays(input=u, output=y, sampling_time=H)
    found = identify(pendulum((0.1, 100), (0, 50)), data, 0.002, tolerance=0.5, nodes=1)
    assert found["gravity"].lower <= 9.0 <= found["gravity"].upper < 12
    assert found["damping"].lower <= 0.4 <= found["damping"].upper < 2


def test_a_speed_that_stays_unknown_is_named():
    # Nothing is known of the position between two samples, nor of the rate of the speed: it may be anything.
    model = OwnModel(
        ["d/dt x[t] = v[t]", "d/dt v[t] = u[t] + mu*(1 - x[t]**2)*v[t] - x[t]"],
        {"y": "x"},
        ["u"],
        {"mu": (0, 5)},
        scheme="enclosed",
    )
    data = Dataset.from_arrays(input=np.arange(20.0), output=np.ones(20), sampling_time=H)
    with pytest.raises(ModelError, match=r"give it bounds, as in model.bound\(v="):
        identify(model, data, 0.01)


def test_two_states_may_have_the_same_rate():
    rng = np.random.default_rng(3)
    u = np.repeat(rng.uniform(-6, 6, 6), 10)
    motion = swung(u, (0.5, 0.0))
    noise = rng.uniform(-0.002, 0.002, (2, len(u)))
    outputs = {"y": motion[:, 0] + noise[0], "z": motion[:, 0] - 2.0 + noise[1]}
    data = Dataset.from_arrays(input={"u": u}, output=outputs, sampling_time=H)
    model = OwnModel(
        [
            "d/dt angle[t] = speed[t]",
            "d/dt other[t] = speed[t]",
            "d/dt speed[t] = u[t] - gravity*sin(angle[t]) - damping*speed[t]",
        ],
        {"y": "angle", "z": "other"},
        ["u"],
        {"gravity": (0.1, 100), "damping": (0, 50)},
        scheme="enclosed",
    )
    bounds = {"y": 0.002, "z": 0.002}
    found = last(Narrowing.of(Record(bind(model, data), data, bounds), bounds).steps())
    (low, high), (least, most) = found.box
    assert 7 < low <= 9.0 <= high < 11
    assert least <= 0.4 <= most


def test_only_models_whose_states_are_shown_are_narrowed():
    data = Dataset.from_arrays(input=np.ones(20), output=np.ones(20), sampling_time=H)
    reactor = Reactor(tau=None, a=None, scheme="enclosed")
    assert narrowing_of(reactor, data, 0.01) is None
    discretised = replace(pendulum((1, 2), (0, 1)), scheme="rk4")
    assert narrowing_of(discretised, data, 0.01) is None
