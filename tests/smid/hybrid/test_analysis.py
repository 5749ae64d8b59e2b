"""What a network has to learn, beside SciPy's discretisation and beside the plant itself."""

from dataclasses import replace

import numpy as np
import pytest
import sympy
from scipy import signal as scipy_signal

from smid.hybrid import (
    EXTRA,
    SIMPLE,
    BackCouplings,
    BackCouplingWarning,
    estimate,
    parallel,
    pulse_transfer,
    required,
    series,
    transfer,
)
from smid.hybrid.hybrid_model import bound_to
from smid.models import Line, Measurement, Model, ModelError, OutputError, Reactor, signal, t
from smid.theses.hybrid import Mismatch, reactor_plant, simulate_reactor
from smid.theses.hybrid.reactor import reactor_record, white_reactor
from smid.theses.hybrid.reactor.records import free_run
from smid.theses.hybrid.reactor.requirements import LINEAR

S, Q = sympy.symbols("s q")


def coefficients(expression, symbol):
    return [
        [float(c) for c in sympy.Poly(part, symbol).all_coeffs()] for part in sympy.fraction(sympy.cancel(expression))
    ]


@pytest.mark.parametrize("mismatch", LINEAR)
@pytest.mark.parametrize("sampling_time", [0.2, 1.0, 3.0])
def test_the_pulse_transfer_is_scipys(mismatch, sampling_time):
    plant = reactor_plant(mismatch)
    numerator, denominator, _ = scipy_signal.cont2discrete(coefficients(transfer(plant), S), sampling_time)
    z = np.exp(1j * np.linspace(0.1, 3.0, 7))
    ours = sympy.lambdify(Q, pulse_transfer(plant, sampling_time))(1 / z)
    np.testing.assert_allclose(ours, np.polyval(numerator[0], z) / np.polyval(denominator, z), rtol=1e-9)


def test_equal_poles():
    x, v, u = signal("x"), signal("v"), signal("u")
    lines = (Line(v[t], u[t] - v[t], rate=True), Line(x[t], v[t] - x[t], rate=True))
    twice = Model("twice", (), lines, (Measurement("y", "x", None),))
    numerator, denominator, _ = scipy_signal.cont2discrete(coefficients(transfer(twice), S), 0.5)
    z = np.exp(1j * np.linspace(0.1, 3.0, 7))
    ours = sympy.lambdify(Q, pulse_transfer(twice, 0.5))(1 / z)
    np.testing.assert_allclose(ours, np.polyval(numerator[0], z) / np.polyval(denominator, z), rtol=1e-9)


def test_the_first_value_of_the_thesis():
    needed = required(reactor_plant("time_constant"), white_reactor("time_constant"), "series", 1.0)
    assert needed.step_response(1, 0.3)[0] == pytest.approx(0.8769, abs=5e-5)  # (b.4)


@pytest.mark.parametrize("mismatch", LINEAR)
def test_back_couplings_of_the_linear_mismatches(mismatch):
    needed = [
        required(reactor_plant(mismatch), white_reactor(mismatch), topology, 1.0).couplings
        for topology in ("series", "parallel")
    ]
    assert needed == [EXTRA, BackCouplings(2, 2)]


@pytest.mark.parametrize("mismatch", LINEAR)
@pytest.mark.parametrize("topology", ["series", "parallel"])
def test_an_affine_network_of_the_required_transfer_function_is_the_plant(mismatch, topology):
    needed = required(reactor_plant(mismatch), white_reactor(mismatch), topology, 1.0)
    numerator, denominator = (part[::-1] for part in coefficients(sympy.N(needed.pulse, 30), Q))
    numerator += [0.0] * (needed.couplings.inputs + 1 - len(numerator))
    weights = [b / denominator[0] for b in numerator] + [-a / denominator[0] for a in denominator[1:]] + [0.0]
    join = {"series": series, "parallel": parallel}[topology]
    data = reactor_record(mismatch)
    hybrid = bound_to(join(white_reactor(mismatch), needed.couplings, ()), data)
    names = [p.name for p in hybrid.term.parameters]
    exact = hybrid.model.with_values(dict(zip(names, weights, strict=True)))
    run = free_run(replace(hybrid, model=exact), data)
    np.testing.assert_allclose(run, data.values("y"), atol=2e-6)  # the white model's own integration


def test_a_response_is_that_of_plant_over_model():
    needed = required(reactor_plant("two_in_succession"), white_reactor("two_in_succession"), "parallel", 1.0)
    u = np.full(30, 0.5)
    plant = simulate_reactor("two_in_succession", u, 1.0, start=0.0)
    white = simulate_reactor(Mismatch(), u, 1.0, start=0.0)
    np.testing.assert_allclose(needed.step_response(30, 0.5), plant - white, atol=1e-8)


def test_too_few_back_couplings_are_told_with_their_number():
    data = reactor_record("time_constant").crop(0, 60)
    with pytest.warns(BackCouplingWarning, match=r"needs 1 and 1: give BackCouplings\(1, 1\)"):
        estimate(
            series(white_reactor("time_constant"), SIMPLE, (1,)),
            data,
            plant=reactor_plant("time_constant"),
            error="prediction",
            starts=1,
            iterations=2,
            seed=1,
        )
    found = estimate(
        series(white_reactor("time_constant"), EXTRA, (1,)),
        data,
        plant=reactor_plant("time_constant"),
        error="prediction",
        starts=1,
        iterations=2,
        seed=1,
    )
    assert found.model.values


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: transfer(reactor_plant("power")), "not linear"),
        (lambda: transfer(OutputError()), "discrete-time model"),
        (lambda: required(Reactor(2.0), Reactor(4.0), "beside", 1.0), "topology"),
        (lambda: pulse_transfer(OutputError().with_line("u", signal("r")[t] + signal("v")[t]), 1.0), "one of each"),
    ],
)
def test_what_cannot_be_analysed_is_refused(make, message):
    with pytest.raises(ModelError, match=message):
        make()
