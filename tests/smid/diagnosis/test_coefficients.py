"""Free coefficients: they hold every set of parameters, and need few boxes where products of parameters need many."""

import numpy as np
import pytest

from benchmarks.soundness.check_case import is_emptied
from benchmarks.soundness.library_cases import library_case
from smid import Dataset, OwnModel
from smid.diagnosis.proof.coefficients import with_free_coefficients
from smid.identification.inversion.cover import Cover
from smid.identification.inversion.record import Record
from smid.models import Model, simulate

BOUND = {"y": 0.05}
CURVE = OwnModel(
    ["v[t] = u[t] + e", "x[t] = a*v[t] + b*v[t]**2", "w[t] = p*w[t-1] + (1 - p)*x[t-1]"],
    {"y": "w"},
    ["u"],
    {"a": (-10, 10), "b": (-10, 10), "e": (-3, 3), "p": (-1, 1)},
)
TWO_LAGS = OwnModel(
    ["h[t] = p*h[t-1] + k*(1 - p)*u[t-1]", "w[t] = q*w[t-1] + (1 - q)*h[t-1]"],
    {"y": "w"},
    ["u"],
    {"k": (-5, 5), "p": (0, 0.95), "q": (0, 0.95)},
).bound(h=(-20, 20))


PLAY = OwnModel(
    ["v[t] = Max(u[t] - gap, Min(u[t] + gap, v[t-1]))", "w[t] = p*w[t-1] + b*v[t-1]"],
    {"y": "w"},
    ["u"],
    {"gap": (0, 1), "b": (-10, 10), "p": (-1, 1)},
).bound(v=(-20, 20))


def record(model: Model, truth: dict[str, float], error: float = 0.0, levels: int = 3) -> Record:
    rng = np.random.default_rng(0)
    u = np.repeat(rng.integers(0, levels, 10) / 2.0, 6)
    y = simulate(model, {"u": u}, truth, {name: [0.2] for name in model.states})["y"]
    y = y + rng.uniform(-1, 1, len(u)) * BOUND["y"]
    y[20:40] += error * np.sin(np.arange(20))
    return Record(model, Dataset.from_arrays(input={"u": u}, output={"y": y}, sampling_time=1.0), BOUND)


def freed(found: Record) -> Record:
    """Return the record with the most numbers."""
    return with_free_coefficients(found, BOUND)[-1].record


def searched(found: Record) -> Cover:
    cover = Cover(found, 0.0)
    while not (cover.done or cover.points) and cover.contracted < 100:
        cover.step()
    return cover


# Cases with a memory of an input, which has a number for each hold, come last.
@pytest.mark.parametrize("seed", [*range(12), 116, 208, 278, 280, 348, 369, 379, 419, 473, 504, 609, 646])
def test_the_truth_is_never_excluded(seed: int) -> None:
    assert not is_emptied(library_case(True, seed), 0.2)


def test_a_curve_on_few_levels_needs_few_boxes() -> None:
    truth = {"a": 1.0, "b": 0.5, "e": 0.1, "p": 0.8}
    found = freed(record(CURVE, truth))
    assert len(found.tape.parameters) == 4  # the pole, and the curve at three levels
    assert searched(found).points
    assert not searched(freed(record(CURVE, truth, error=0.5))).boxes


def test_a_hidden_lag_is_eliminated() -> None:
    truth = {"k": 1.5, "p": 0.6, "q": 0.3}
    found = freed(record(TWO_LAGS, truth))
    assert not found.hidden
    assert searched(found).boxes
    assert not searched(freed(record(TWO_LAGS, truth, error=2.0))).boxes


def test_a_polynomial_on_many_levels_has_as_many_coefficients_as_powers() -> None:
    found = freed(record(CURVE, {"a": 1.0, "b": 0.5, "e": 0.1, "p": 0.8}, levels=9))
    assert len(found.tape.parameters) == 4  # the pole, and those of one, u and its square


@pytest.mark.parametrize("levels", [2, 4, 6])
def test_what_a_hysteresis_makes_of_an_input_needs_few_boxes(levels: int) -> None:
    """Its gap and its memory are never cut."""
    truth = {"gap": 0.4, "b": 2.0, "p": 0.8}
    found = freed(record(PLAY, truth, levels=levels))
    assert searched(found).boxes
    assert not searched(freed(record(PLAY, truth, error=0.5, levels=levels))).boxes


def test_the_numbers_of_a_signal_are_told_from_its_channels_whatever_these_are_called() -> None:
    """The second input is no number of the play of the first."""
    model = OwnModel(
        ["v[t] = Max(u[t] - gap, Min(u[t] + gap, v[t-1]))", "w[t] = p*w[t-1] + b*v[t-1] + c*v_at_1[t-1]"],
        {"y": "w"},
        ["u", "v_at_1"],
        {"gap": (0, 1), "b": (-10, 10), "p": (-1, 1), "c": (-100, 100)},
    ).bound(v=(-20, 20))
    rng = np.random.default_rng(0)
    inputs = {"u": np.repeat(rng.integers(0, 3, 10) / 2.0, 6), "v_at_1": np.eye(1, 60, 30)[0]}
    y = simulate(model, inputs, {"gap": 0.4, "b": 2.0, "p": 0.8, "c": 90.0}, {"v": [0.2], "w": [0.2]})["y"]
    data = Dataset.from_arrays(input=inputs, output={"y": y}, sampling_time=1.0)
    assert searched(freed(Record(model, data, BOUND))).boxes


def test_a_pole_at_one_stays_there() -> None:
    """The angle behind a lag of an unknown pole and gain: two coefficients of the angle, which add up to one."""
    model = OwnModel(
        ["v[t] = p*v[t-1] + b*u[t-1]", "w[t] = w[t-1] + v[t-1]"], {"y": "w"}, ["u"], {"p": (0, 0.95), "b": (-5, 5)}
    ).bound(v=(-20, 20))
    truth = {"p": 0.8, "b": 0.3}
    found = freed(record(model, truth))
    assert not found.hidden
    assert len(found.tape.parameters) == 2
    assert searched(found).boxes
    assert not searched(freed(record(model, truth, error=0.5))).boxes


def test_what_coefficients_say_of_parameters_is_true_and_saves_boxes() -> None:
    """Free, the powers of the input hide that one bias is behind them all: a bias of the output is excluded by that."""
    model = OwnModel(
        ["v[t] = u[t] + e", "x[t] = a*v[t]**3 + b*v[t]**2", "w[t] = p*w[t-1] + x[t-1]"],
        {"y": "w"},
        ["u"],
        {"a": (-5, 5), "b": (-5, 5), "e": (-3, 3), "p": (-1, 1)},
    )
    truth = {"a": 0.4, "b": -0.3, "e": 0.5, "p": 0.7}

    def told(found: Record) -> Record:
        (free,) = with_free_coefficients(found, BOUND)
        cover = Cover(free.record, 0.0, deepest_first=True)
        cover.step()
        return free.told(found, BOUND, *cover.outer)

    own = record(model, truth, levels=9)
    begin = own.data.experiments[0].values["y"][:1]
    assert any(told(own).fits(np.array([*truth.values(), w])) for w in begin + np.linspace(-0.05, 0.05, 101))
    run = own.data.experiments[0].values
    data = Dataset.from_arrays(input={"u": run["u"]}, output={"y": run["y"] + 0.5}, sampling_time=1.0)
    biased = Record(model, data, BOUND)
    without, withal = searched(biased), searched(told(biased))
    assert withal.done
    assert not withal.boxes
    assert withal.contracted < 0.5 * without.contracted


def test_lines_that_hold_the_same_part_again_and_again_stay() -> None:
    part = "w[t-1]"
    for _ in range(9):
        part = f"({part} - p*sin({part}))"
    model = OwnModel([f"w[t] = {part} + u[t-1]"], {"y": "w"}, ["u"], {"p": (0, 0.1)})
    assert not with_free_coefficients(record(model, {"p": 0.05}), BOUND)
