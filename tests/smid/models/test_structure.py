"""A model refuses what makes no sense, sorts its lines, and prints itself."""

import numpy as np
import pytest
import sympy
from hypothesis import given, settings
from hypothesis import strategies as st

from smid.models import (
    ErrorsInVariables,
    Hammerstein,
    Line,
    Measurement,
    Model,
    ModelError,
    OutputError,
    Parameter,
    Wiener,
    signal,
    t,
)
from smid.models.expressions import from_text
from smid.models.symbols import swapped

U, V, W = signal("u"), signal("v"), signal("w")
SEEN = (Measurement("y", "w", "eta"),)


def model(*lines, parameters=(), measurements=SEEN, **more):
    return Model("test", parameters, lines, measurements, **more)


def test_lines_are_sorted_into_causal_order():
    got = model(Line(W[t], V[t] + W[t - 1]), Line(V[t], U[t - 2]))
    assert [line.signal for line in got.lines] == ["v", "w"]
    assert got.inputs == ("u",)
    assert got.max_lag == 2
    assert got.states == ("w",)


def test_symbols_without_assumptions_are_understood():
    plain = Line(
        sympy.IndexedBase("w")[sympy.Symbol("t")],
        sympy.Symbol("a") * sympy.IndexedBase("w")[sympy.Symbol("t") - 1],
    )
    assert plain == Line(W[t], sympy.Symbol("a", real=True) * W[t - 1])
    assert model(plain, parameters=(Parameter("a"),)).states == ("w",)


@pytest.mark.parametrize(
    ("build", "message"),
    [
        (lambda: model(Line(W[t], W[t + 1])), r"reads w\[t \+ 1\], the future"),
        (lambda: model(Line(W[t], V[t]), Line(V[t], W[t])), "algebraic loop at one time among v, w"),
        (lambda: model(Line(W[t], W[t] / 2 + U[t])), "algebraic loop"),
        (lambda: model(Line(W[t], U[t]), Line(W[t], U[t - 1])), "defined by 2 lines"),
        (lambda: model(Line(W[t], sympy.Symbol("k") * U[t])), "uses k, no parameter"),
        (lambda: model(Line(W[t - 1], U[t])), "must be a signal now"),
        (lambda: model(Line(W[t], U[2 * t])), "fixed lag"),
        (lambda: model(Line(W[t], U[t]), parameters=(Parameter("w"),)), "stands for parameter and signal"),
        (lambda: model(Line(W[t], U[t]), parameters=(Parameter("k"), Parameter("k"))), "'k' stands for"),
        (lambda: model(Line(W[t], U[t]), measurements=(Measurement("y", "z", "eta"),)), "measures 'z'"),
        (lambda: model(Line(W[t], U[t]), constraints=(U[t],)), "reads a signal"),
        (lambda: model(Line(W[t], U[t]), values={"k": 1.0}), "value k = 1.0 is refused"),
        (lambda: Parameter("a", 2, 1), "give lower <= upper"),
        (lambda: Parameter("t"), "cannot be used"),
        (lambda: Parameter("a b"), "cannot be used"),
        (lambda: Measurement("y", "y", None), "both called 'y'"),
        (lambda: Measurement("y", "w", None, sympy.Symbol("k")), "must depend on VALUE"),
        (lambda: Line(W[t], "w[t-1]"), "not a sympy expression"),
        (lambda: Line(W[t], U[t] > 0), "not an expression"),
    ],
)
def test_nonsense_is_refused_with_its_cause(build, message):
    with pytest.raises(ModelError, match=message):
        build()


def test_channels_of_noisy_inputs():
    got = ErrorsInVariables(2, 1)
    assert got.inputs == ("u_true",)
    assert got.channels == ("u", "y")
    assert got.output_channels == ("y",)
    assert got.max_lag == 2


@pytest.mark.parametrize(
    "example",
    [OutputError(2, 1, stable=True), ErrorsInVariables(), Hammerstein(input_scale=0.01), Wiener()],
    ids=lambda item: item.name,
)
def test_models_print(example):
    equations = example.equations()
    assert len(str(equations).splitlines()) == 1 + len(equations.text)
    assert equations.latex().startswith("\\begin{aligned}")
    assert equations._repr_latex_().startswith("$")
    assert "<li>" in example._repr_html_()


@pytest.mark.parametrize("text", ["__import__('os')", "w.real", "w[t-1] if u else 1", "f(x)", "True", "2 +"])
def test_stored_text_is_never_executed(text):
    with pytest.raises(ModelError):
        from_text(text)


def test_a_stored_model_without_a_field_says_which():
    content = OutputError().to_dict()
    del content["lines"]
    with pytest.raises(ModelError, match="lacks 'lines'"):
        Model.from_dict(content)


@given(st.integers(0, 10**6))
@settings(max_examples=30, deadline=None)
def test_new_names_give_what_sympy_gives(seed):
    generator = np.random.default_rng(seed)
    atoms = [sympy.Symbol(name, real=True) for name in "abc"] + [signal("u")[t - k] for k in range(3)]

    def drawn(depth):
        if depth == 0:
            return atoms[generator.integers(len(atoms))] + int(generator.integers(-1, 2))
        first, second = drawn(depth - 1), drawn(depth - 1)
        kinds = (first + second, first * second, first**2, sympy.Max(first, second), sympy.exp(first), 3 * first)
        return kinds[generator.integers(len(kinds))]

    expression = drawn(4)
    names = generator.permutation(["p", "q", "r", "x", "y", "z"])
    new = [sympy.Symbol(name, real=True) for name in names[:3]] + [signal(names[3])[t - k] for k in range(3)]
    swap = dict(zip(atoms, new, strict=True))
    expected = expression.xreplace(swap)
    assert swapped(expression, swap) == expected
    # Two names that become one are terms of one kind.
    merged = {atoms[0]: atoms[1]}
    difference = swapped(expression, merged) - expression.xreplace(merged)
    point = {atom: sympy.Rational(k + 2, 7) for k, atom in enumerate(atoms)}
    assert sympy.expand(difference.subs(point)) == 0
