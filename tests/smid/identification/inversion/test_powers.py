"""A power whose exponent is a parameter, of a number that may be negative."""

import numpy as np
import sympy

from relaxations import check
from relaxations.check import runs
from smid import Dataset, Model, Parameter, identify, verify
from smid.identification.inversion.record import Record
from smid.models import Line, Measurement, signal, t

x, w = signal("x"), signal("w")
b, p = (sympy.Symbol(name, real=True) for name in "bp")
NEAR_ZERO = [-0.03, -0.028, -0.02, 0.03, 0.01, 0.0]


def squares() -> tuple[Model, Dataset]:
    """Return a model whose exponent is fixed at 2 by its box, and a record whose true states are near zero."""
    lines = (Line(x[t], 0.5 * x[t - 1] + signal("u")[t]), Line(w[t], b * x[t] ** p))
    boxes = (Parameter("b", 50, 200), Parameter("p", 2, 2))
    measured = (Measurement("y", "x", "eta"), Measurement("z", "w", "zeta"))
    model = Model("squares", boxes, lines, measured)
    states = np.array(NEAR_ZERO * 3)
    inputs = states - 0.5 * np.concatenate([[0.0], states[:-1]])
    shown = {"y": states + 0.02 * (-1.0) ** np.arange(18), "z": 100 * states**2}
    return model, Dataset.from_arrays(input={"u": inputs}, output=shown, sampling_time=1.0)


def test_a_power_of_a_negative_number_is_not_excluded(tmp_path) -> None:
    model, data = squares()
    bounds = {"y": 0.021, "z": 0.005}
    record = Record(model, data, bounds)
    lower, upper = record.lower.copy(), record.upper.copy()
    lower[0], upper[0] = 99.0, 101.0
    assert record.rows(lower, upper).impossible < 0
    # The whole way: the truth is inside, and the file holds.
    file = tmp_path / "proof.json"
    estimate = identify(model, data, bounds, method="inversion", tolerance=0.1, nodes=60, certificate=file)
    assert estimate["b"].lower <= 100 <= estimate["b"].upper
    if file.exists():
        assert runs.check(check.read(file))["p"] == (2, 2)
        assert verify(file, data, model).intervals["p"] == (2.0, 2.0)
