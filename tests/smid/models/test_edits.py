"""Edits mean what they say, checked by simulation against code written by hand, and they compose."""

import numpy as np
import pytest
import sympy

from smid.models import Hammerstein, ModelError, OutputError, Parameter, Wiener, signal, simulate, t

VALUES = {"a1": -0.7, "b0": 0.4}
INPUT = np.random.default_rng(3).normal(size=60)


def by_hand(before=lambda u: u, feedback=lambda w: w, after=lambda w: w, term=lambda _: 0.0):
    w = [0.0]
    for k in range(1, len(INPUT)):
        w.append(after(0.7 * feedback(w[k - 1]) + 0.4 * before(INPUT[k - 1]) + term(w[k - 1])))
    return np.array(w)


def run(model, **more):
    return simulate(model, {"u": INPUT}, VALUES | more)["y"]


def test_before_an_input_changes_what_the_lines_read():
    model = OutputError().insert_before("u", lambda u: sympy.Max(0, u))
    np.testing.assert_allclose(run(model), by_hand(before=lambda u: max(0, u)))


def test_before_a_state_changes_its_feedback_but_not_its_measurement():
    model = OutputError().insert_before("w", lambda w: sympy.Max(0, w))
    np.testing.assert_allclose(run(model), by_hand(feedback=lambda w: max(0, w)), atol=1e-15)
    assert (run(model) < 0).any()


def test_after_a_state_changes_measurement_and_feedback():
    model = OutputError().insert_after("w", lambda w: sympy.Min(w, 0.2))
    np.testing.assert_allclose(run(model), by_hand(after=lambda w: min(w, 0.2)))


def test_terms_and_their_parameters():
    friction = Parameter("Fc", 0, null=0)
    term = -friction.symbol * sympy.sign(signal("w")[t - 1])
    model = OutputError().add_term("y", term, [friction])
    np.testing.assert_allclose(run(model, Fc=0.1), by_hand(term=lambda w: -0.1 * np.sign(w)))
    np.testing.assert_allclose(run(model, Fc=friction.null), by_hand())


def test_effects_compose_in_either_order():
    def dead_zone(u):
        return sympy.Max(0, u - 0.1) - sympy.Max(0, -u - 0.1)

    one = OutputError().insert_before("u", dead_zone).insert_after("y", lambda w: sympy.Min(w, 0.2))
    other = OutputError().insert_after("y", lambda w: sympy.Min(w, 0.2)).insert_before("u", dead_zone)
    expected = by_hand(
        before=lambda u: max(0, u - 0.1) - max(0, -u - 0.1),
        after=lambda w: min(w, 0.2),
    )
    for model in (one, other):
        np.testing.assert_allclose(run(model), expected)
    noisy = [
        OutputError().with_input_noise("u").insert_before("u", dead_zone),
        OutputError().insert_before("u", dead_zone).with_input_noise("u"),
    ]
    for model in noisy:
        assert model.input_channels == ("u",)
        np.testing.assert_allclose(run(model), by_hand(before=lambda u: max(0, u - 0.1) - max(0, -u - 0.1)))


def test_twice_before_the_same_signal_goes_nearest_to_it():
    model = OutputError().insert_before("u", lambda u: u**2).insert_before("u", lambda u: u + 1)
    np.testing.assert_allclose(run(model), by_hand(before=lambda u: (u + 1) ** 2))


def test_an_inserted_line_may_have_memory():
    play = signal("play")
    model = OutputError().insert_before(
        "u",
        lambda u: sympy.Max(u - 0.3, sympy.Min(u + 0.3, play[t - 1])),
        new_name="play",
    )
    state = [0.0]

    def operator(u):
        state[0] = max(u - 0.3, min(u + 0.3, state[0]))
        return state[0]

    # The play operator rests at zero before its first computed sample.
    state_values = [0.0, *(operator(u) for u in INPUT[1:])]
    w = np.zeros(len(INPUT))
    for k in range(2, len(INPUT)):
        w[k] = 0.7 * w[k - 1] + 0.4 * state_values[k - 1]
    np.testing.assert_allclose(run(model), w)


def test_a_parameter_may_follow_a_channel():
    base, slope = Parameter("alpha0"), Parameter("alpha1", null=0)
    model = OutputError(stable=True).substitute("a1", base.symbol + slope.symbol * signal("T")[t], [base, slope])
    assert model.inputs == ("T", "u")
    temperature = np.linspace(0, 1, len(INPUT))
    values = {"alpha0": -0.9, "alpha1": 0.5, "b0": 0.4}
    got = simulate(model, {"u": INPUT, "T": temperature}, values)["y"]
    w = [0.0]
    for k in range(1, len(INPUT)):
        w.append((0.9 - 0.5 * temperature[k]) * w[k - 1] + 0.4 * INPUT[k - 1])
    np.testing.assert_allclose(got, w)


def test_substitution_keeps_box_and_constraints_of_a_constant():
    new = Parameter("c")
    model = OutputError(stable=True).substitute("a1", 2 * new.symbol, [new])
    assert set(model.constraints) == {2 * new.symbol + 1, 1 - 2 * new.symbol}


def test_second_pole_as_a_new_line():
    model = OutputError().with_line("z", signal("w")[t] / 2 + signal("z")[t - 1] / 2)
    assert set(model.states) == {"w", "z"}


def test_fix_bound_and_values():
    model = OutputError().with_values(VALUES).bound(a1=(-1, 0))
    fixed = model.fix(a1=-0.7)
    assert [item.name for item in fixed.parameters] == ["b0"]
    np.testing.assert_allclose(simulate(fixed, {"u": INPUT})["y"], by_hand())
    with pytest.raises(ModelError, match=r"a1 = 0.5 lies outside its box \[-1, 0\]"):
        model.fix(a1=0.5)
    with pytest.raises(ModelError, match="contradicts"):
        OutputError(2, 0, stable=True).fix(a1=1.9, a2=-0.9)
    with pytest.raises(ModelError, match="no parameter 'q'"):
        model.bound(q=(0, 1))


@pytest.mark.parametrize("edit", ["insert_after", "add_term", "replace_line"])
def test_an_input_has_no_line_to_edit(edit):
    argument = (lambda s: s) if edit == "insert_after" else signal("u")[t]
    with pytest.raises(ModelError, match="is an input"):
        getattr(OutputError(), edit)("u", argument)


def test_edits_name_what_is_wrong():
    with pytest.raises(ModelError, match="no signal 'q': its signals are u, w"):
        OutputError().insert_before("q", lambda s: s)
    with pytest.raises(ModelError, match="not an exact input"):
        OutputError().with_input_noise("w")
    with pytest.raises(ModelError, match="uses k, no parameter"):
        OutputError().add_term("w", sympy.Symbol("k"))


@pytest.mark.parametrize(
    "model",
    [
        OutputError(2, 1, stable=True).with_values({"a1": 0.1}),
        Hammerstein(input_scale=0.01, powers=(5, 1, 0), input_noise=True),
        Wiener(output_range=(-1, 1)),
        OutputError().insert_before("u", lambda u: sympy.Max(0, u, u**2) + sympy.exp(-sympy.Abs(u) / 3)),
    ],
    ids=lambda model: model.name,
)
def test_stored_models_come_back_equal(model):
    import json
    import pickle

    again = type(model).from_dict(json.loads(json.dumps(model.to_dict())))
    assert again == model
    assert hash(again) == hash(model)
    assert pickle.loads(pickle.dumps(model)) == model
    assert str(again) == str(model)
