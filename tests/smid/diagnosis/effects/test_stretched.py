"""A line of order two in stretched time is the plant sampled at another interval; where it is not stretched, itself."""

import numpy as np
import pytest
import sympy
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.signal import cont2discrete

from smid import OutputError
from smid.diagnosis.effects.parts.extremes import larger
from smid.diagnosis.effects.parts.plant import state_lines
from smid.diagnosis.effects.parts.stretched import stretched
from smid.models import Model, Parameter, signal, simulate, t


def sampled(interval: float, damping: float) -> dict[str, float]:
    """Return the parameters of x'' + 2 z x' + x = u, its input held over each interval."""
    over, under, _ = cont2discrete(([1.0], [1.0, 2 * damping, 1.0]), interval, "zoh")
    return {"a1": under[1], "a2": under[2], "b0": over[0, 1], "b1": over[0, 2]}


def held(seed: int) -> np.ndarray:
    """Return an input that is zero at first, then holds levels."""
    return np.concatenate([np.zeros(5), np.repeat(np.random.default_rng(seed).uniform(-1, 1, 20), 5)])


def put(model: Model, pace: sympy.Expr) -> Model:
    """Stretch the time of a model's only line."""
    (state,) = state_lines(model)
    found = stretched(model, state, lambda _: pace, [Parameter("m", 0.1, 5.0)])
    assert found is not None
    return found


@given(interval=st.floats(0.1, 0.8), damping=st.floats(0.2, 3.0), m=st.floats(0.5, 2.5))
@settings(deadline=None)
def test_a_steady_pace_is_another_sampling_interval(interval: float, damping: float, m: float) -> None:
    u = held(1)
    model = put(OutputError(na=2, nb=1), sympy.Symbol("m", real=True))
    found = simulate(model, {"u": u}, {**sampled(interval, damping), "m": m})["w"]
    wanted = simulate(OutputError(na=2, nb=1), {"u": u}, sampled(m * interval, damping))["w"]
    # The series of p^m = (1 - (1 - p))^m is cut off after its fourth term, at every step.
    poles = np.roots([1.0, *(sampled(interval, damping)[name] for name in ("a1", "a2"))])
    cut_off = [abs(float(sympy.binomial(m, k))) * np.abs(1 - poles).max() ** k for k in range(5, 60)]
    assert np.abs(found - wanted).max() < 1e-9 + 10 * sum(cut_off) / (1 - np.abs(poles).max() ** m)


def test_what_is_inside_a_function_stays_as_it_is_written() -> None:
    """To expand it takes minutes where effects are nested, and no time limit ends that."""
    u = signal("u")
    b0 = sympy.Symbol("b0", real=True)
    limited = larger(0, b0 * (u[t - 1] - b0))
    stretched_model = put(OutputError(na=2, nb=1).add_term("w", limited), sympy.Symbol("m", real=True))
    assert stretched_model.lines[0].expression.atoms(sympy.Max) == {limited}


@pytest.mark.parametrize("m", [1, 2, 3])
def test_whole_paces_are_exact(m: int) -> None:
    u = held(2)
    found = simulate(put(OutputError(na=2, nb=1), sympy.Integer(m)), {"u": u}, {**sampled(0.3, 0.4), "m": 1.0})["w"]
    wanted = simulate(OutputError(na=2, nb=1), {"u": u}, sampled(0.3 * m, 0.4))["w"]
    assert np.allclose(found, wanted, atol=1e-12)
