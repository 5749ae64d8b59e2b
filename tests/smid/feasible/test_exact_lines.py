"""Lines, sensors and rates keep every number exactly: a rational truth solves the polynomials in fractions."""

from collections.abc import Callable
from dataclasses import dataclass
from fractions import Fraction

import numpy as np
import pytest
import sympy

from smid import Dataset, FeasibleSet, Hammerstein, ModelError, OutputError, Wiener
from smid.models import Line, Measurement, Model, Parameter
from smid.models.expressions import from_text, to_text
from smid.models.symbols import signal, t
from tests.smid.exact_membership import what_excludes

F = Fraction
THIRD = F(1, 3)
N, BOUND = 12, 0.05


@dataclass(frozen=True)
class Plant:
    """A model, a rational truth, and its output over an input, written by hand in fractions."""

    model: Model
    truth: dict[str, Fraction]
    run: Callable[[list[Fraction]], list[Fraction]]


def _recursion(step: Callable[[Fraction, Fraction], Fraction]) -> Callable[[list[Fraction]], list[Fraction]]:
    def run(u: list[Fraction]) -> list[Fraction]:
        w = [F(1, 7)]
        for k in range(1, len(u)):
            w.append(step(w[-1], u[k - 1]))
        return w

    return run


w, u = signal("w"), signal("u")
k, d = Parameter("k", 0, 1), Parameter("d", 0, 1)
PLANTS = {
    "a number put into a line of decimals": Plant(
        OutputError(1, 0)
        .replace_line("w", -0.7 * sympy.Symbol("a1") * w[t - 1] + 0.3 * sympy.Symbol("b0") * u[t - 1])
        .fix(b0=0.1),
        {"a1": -THIRD},
        _recursion(lambda w, u: F(0.7) * THIRD * w + F(0.3) * F(0.1) * u),
    ),
    "decimals of static lines": Plant(
        Model(
            "static",
            (k,),
            (
                Line(signal("v")[t], 0.1 * u[t] - 0.3 * u[t] ** 3),
                Line(w[t], k.symbol * w[t - 1] + 0.7 * signal("v")[t - 1]),
            ),
            (Measurement("y", "w", "eta"),),
        ),
        {"k": THIRD},
        _recursion(lambda w, u: THIRD * w + F(0.7) * (F(0.1) * u - F(0.3) * u**3)),
    ),
    "Hammerstein": Plant(
        Hammerstein(1, (3, 1), input_scale=0.37, stable=True),
        {"alpha": -THIRD, "gamma1": F(2, 7), "gamma2": F(5, 9)},
        _recursion(lambda w, u: THIRD * w + F(2, 3) * (F(2, 7) * (F(0.37) * u) ** 3 + F(5, 9) * F(0.37) * u)),
    ),
    "a rate by Euler": Plant(
        Model(
            "tank",
            (k,),
            (Line(w[t], 0.7 * u[t] - 0.3 * k.symbol * w[t], rate=True),),
            (Measurement("y", "w", "eta"),),
            scheme="euler",
            sampling_time=0.1,
        ),
        {"k": THIRD},
        _recursion(lambda w, u: w + F(0.1) * (F(0.7) * u - F(0.3) * THIRD * w)),
    ),
    "a kink at the value of a sample": Plant(
        OutputError(1, 0).fix(b0=0.3).insert_before("u", lambda u: sympy.Max(0, 0.1 * u - 0.1 * 0.5)),
        {"a1": -THIRD},
        _recursion(lambda w, u: THIRD * w + F(0.3) * max(F(0), F(0.1) * u - F(0.1 * 0.5))),
    ),
}


@pytest.mark.parametrize("kind", PLANTS)
def test_the_truth_solves_the_polynomials_in_fractions(kind: str) -> None:
    plant = PLANTS[kind]
    levels = np.random.default_rng(1).uniform(-1, 1, N)
    levels[3] = 0.5
    inputs = [F(float(v)) for v in levels]
    clean = plant.run(inputs)
    y = [float(v) for v in clean]
    data = Dataset.from_arrays(input={"u": levels}, output={"y": y}, sampling_time=0.1)
    problem = FeasibleSet(plant.model, data, BOUND).problem
    point = plant.truth | {f"eta[{j}]": F(y[j]) - clean[j] for j in range(N)}
    assert what_excludes(problem, {name: point[name] for name in problem.names}) == []


def test_a_sensor_curve_of_decimals_is_solved_by_the_truth() -> None:
    model = Wiener(1, (3,), output_range=(-0.3, 0.7), stable=True)
    model = Model(
        model.name,
        model.parameters,
        model.lines,
        (Measurement("y", "x", "eta", from_text("0.7*value + 0.1*0.3*value + s3*value**3")),),
        model.constraints,
    )
    rng = np.random.default_rng(2)
    y = rng.uniform(-0.3, 0.7, N)
    eta = [F(float(v)) for v in rng.uniform(-BOUND, BOUND, N)]
    truth = {"alpha": -THIRD, "beta": F(2, 7), "s3": F(1, 9)}
    z = [F(float(a)) - b for a, b in zip(y, eta, strict=True)]
    x = [(F(0.7) + F(0.1) * F(0.3)) * v + truth["s3"] * v**3 for v in z]
    # The input that leads from one sample to the next is no float: the lines read it as noisy.
    drive = [(x[j + 1] - THIRD * x[j]) / truth["beta"] for j in range(N - 1)] + [F(0)]
    seen = [float(v) for v in drive]
    model = model.with_input_noise("u")
    data = Dataset.from_arrays(input={"u": seen}, output={"y": y}, sampling_time=1.0)
    problem = FeasibleSet(model, data, BOUND).problem
    point = truth | {f"eta[{j}]": eta[j] for j in range(N)} | {f"x[{j}]": x[j] for j in range(N)}
    point |= {f"zeta[{j}]": F(seen[j]) - drive[j] for j in range(N)}
    assert what_excludes(problem, {name: point[name] for name in problem.names}) == []


def test_a_constant_that_is_no_fraction_is_refused_with_the_box_of_a_parameter_for_it() -> None:
    data = Dataset.from_arrays(
        input={"u": np.random.default_rng(3).uniform(-1, 1, N)}, output={"y": np.ones(N)}, sampling_time=1.0
    )
    with pytest.raises(ModelError, match=r"sqrt\(2\), which is not a fraction.*with the box \(1\.414.*, 1\.414"):
        FeasibleSet(OutputError().add_term("w", sympy.sqrt(2) * u[t - 1]), data, BOUND)


def test_no_line_holds_a_float_and_the_text_of_a_model_gives_every_bit_back() -> None:
    model = PLANTS["a number put into a line of decimals"].model.with_constraint(0.1 - sympy.Symbol("a1") / 3)
    for expression in (model.lines[0].expression, *model.constraints):
        assert not expression.atoms(sympy.Float)
        assert from_text(to_text(expression)) == expression
    assert Model.from_dict(model.to_dict()) == model
    assert str(model.lines[0]) == "w[t] = -0.7*a1*w[t - 1] + 0.03*u[t - 1]"


def test_ends_of_boxes_that_are_no_floats_are_rounded_outwards() -> None:
    box = Parameter("p", THIRD, 2**60 + 1)
    assert F(box.lower) < THIRD
    assert F(box.upper) > 2**60 + 1
    assert (Parameter("p", 0, 1).lower, Parameter("p", 0.1, 0.3).upper) == (0, 0.3)


def test_a_sample_of_zero_decides_a_kink_whose_argument_has_a_free_gain() -> None:
    levels = np.random.default_rng(4).uniform(0.1, 1, N)
    levels[4] = 0.0
    data = Dataset.from_arrays(input={"u": levels}, output={"y": np.ones(N)}, sampling_time=1.0)
    free = Parameter("g", -1, float("inf"))
    model = OutputError().insert_before(
        "u", lambda u: sympy.Max(-1, -sympy.Max(0, -free.symbol * u)), parameters=[free]
    )
    names = FeasibleSet(model, data, BOUND).problem.names
    assert "kink1[3]" in names
    assert "kink1[4]" not in names
