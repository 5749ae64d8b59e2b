"""A condition of a Piecewise at the very point where it changes."""

import numpy as np
import pytest
import sympy

from smid import Dataset, Model, Parameter
from smid.identification.inversion.record import Record
from smid.models import Line, Measurement, signal, t

x, u, a = signal("x"), signal("u"), sympy.Symbol("a", real=True)


@pytest.mark.parametrize(("condition", "at_zero"), [(u[t] > 0, -1), (u[t] >= 0, 1), (u[t] < 0, -1), (u[t] <= 0, 1)])
def test_an_exact_input_of_zero_takes_the_branch_that_the_condition_says(condition, at_zero: int) -> None:
    line = Line(x[t], a * sympy.Piecewise((1, condition), (-1, True)))
    model = Model("switch", (Parameter("a", 0, 2),), (line,), (Measurement("y", "x", "eta"),))
    inputs = [1.0, 0.0, -1.0]
    side = 1 if condition.subs(u[t], 1.0) else -1
    data = Dataset.from_arrays(input={"u": inputs}, output={"y": [side, at_zero, -side]}, sampling_time=1.0)
    record = Record(model, data, {"y": 0.1})
    assert record.fits(np.array([1.0]))
    assert record.rows(np.array([0.9]), np.array([1.1])).impossible < 0
