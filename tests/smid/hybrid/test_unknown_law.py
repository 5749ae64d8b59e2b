"""A law that is missing in the balances is found from a record that another integrator simulated."""

import numpy as np
import pytest

import smid
from smid.hybrid import embedded, ensemble, estimate, extrapolation, learned_curve, learned_law, network_output
from smid.models import ModelError, OwnModel, signal, t
from tests.smid.hybrid.unknown_laws import LAWS, slide_record, tank_model, tank_record


@pytest.mark.parametrize(
    ("name", "outputs"), [("power_law", ("level", "temp")), *((name, ("temp",)) for name in LAWS)], ids=str
)
def test_the_heat_loss_of_a_tank_gets_its_name(name, outputs):
    data = tank_record(LAWS[name], 3, n=240, outputs=outputs)
    found = estimate(tank_model(outputs), data, starts=2, seed=1)
    law = learned_law(found)
    assert " + ".join(law.names) == name
    x = np.linspace(law.curve.lower, law.curve.upper, 50)
    np.testing.assert_allclose(law.best(x), LAWS[name](x), rtol=0.01)
    np.testing.assert_allclose(network_output(found.model, found.hybrid.term, x[:, None]), LAWS[name](x), rtol=0.08)
    assert found.model.values["k"] == pytest.approx(4e-5, rel=0.01)
    assert "has learned" in law.sentence


def test_a_network_of_three_hundred_weights_learns_the_law():
    """One step ahead they fit the noise: the free run has to begin where it does not run away."""
    data = tank_record(LAWS["power_law"], 1, n=400)
    found = estimate(tank_model(hidden=(100,)), data, starts=1, iterations=30, seed=1)
    assert found.fit.n_free > 300
    curve = learned_curve(found)
    np.testing.assert_allclose(curve.y, LAWS["power_law"](curve.x), rtol=0.08)


def test_friction_is_read_as_dry_friction_and_drag():
    def friction(v):
        return 0.4 * np.tanh(v / 0.02) + 0.25 * v * np.abs(v)

    white = OwnModel(
        ["d/dt x = v", "d/dt v = (force - 2*x) / m"], {"position": "x"}, ["force"], {"m": (0.2, 5.0)}, substeps=2
    )
    hybrid = embedded(white, {"v": -1 / white.parameter("m").symbol}, [signal("v")[t]], (3,))
    law = learned_law(estimate(hybrid, slide_record(friction, 1), starts=1, iterations=60, seed=1))
    assert law.names == ("coulomb_friction", "quadratic_drag")
    assert law.best.values["N_dry"] == pytest.approx(0.4, rel=0.02)
    assert law.best.values["N_square"] == pytest.approx(0.25, rel=0.03)
    assert "N_dry*sign(x) + N_square*x*Abs(x)" in law.sentence


def test_a_law_that_is_not_in_the_list_is_not_named():
    data = tank_record(lambda x: 6e3 + 2e3 * np.sin(x / 4.0), 3)
    found = estimate(tank_model(hidden=(6,)), data, starts=1, seed=1)
    assert "No law of the list" in learned_law(found).sentence


def test_the_band_of_an_ensemble_holds_the_law():
    loss = LAWS["power_law"]
    repeated = ensemble(estimate(tank_model(), tank_record(loss, 5, n=240), starts=1, seed=1), members=6, seed=1)
    curve = learned_curve(repeated)
    inside = np.abs(curve.y - loss(curve.x)) < 3 * curve.deviation
    assert inside.mean() > 0.9
    assert np.median(curve.deviation / curve.y) < 0.03
    assert "6 random halves" in str(repeated)


def test_the_law_is_certified():
    data = tank_record(lambda x: 180.0 * x, 4, n=120, noise=(3e-4, 0.02))
    law = learned_law(estimate(tank_model(hidden=(2,)), data, starts=1, seed=1))
    found = smid.identify(law.model, data, {"level": 1.5e-3, "temp": 0.1})
    assert law.names == ("proportional",)
    for name, truth in (("k", 4e-5), ("N_linear", 180.0)):
        assert found[name].lower < truth < found[name].upper


def test_an_input_beyond_the_trained_range_is_told():
    found = estimate(tank_model(), tank_record(LAWS["power_law"], 3), starts=1, seed=1)
    near = tank_record(LAWS["power_law"], 3, noise=(0, 0))
    assert extrapolation(found, near).share < 0.01
    doubled = smid.Dataset.from_arrays(
        input={"inflow": near.values("inflow"), "power": 2 * near.values("power")},
        output={name: near.values(name) for name in ("level", "temp")},
        sampling_time=near.sampling_time,
    )
    outside = extrapolation(found, doubled)
    assert outside.share > 0.3
    assert "leave the trained range" in str(outside)


def test_a_hidden_level_starts_where_the_first_samples_say():
    data, other = (tank_record(LAWS["power_law"], seed, outputs=("temp",)) for seed in (3, 8))
    found = estimate(tank_model(("temp",)), data, starts=2, seed=1)
    for record in (data, other):
        assert smid.validate(found.model, record).scores[0].rmse < 0.1


@pytest.mark.parametrize(
    ("ask", "message"),
    [
        (lambda found: learned_law(found, "M"), "no network 'M': name one of N"),
        (lambda found: learned_law(found, laws=()), "no law applies"),
        (lambda found: ensemble(found, members=1, seed=1), "members = 1"),
    ],
)
def test_what_cannot_be_read_is_refused(ask, message):
    found = estimate(tank_model(hidden=(1,)), tank_record(LAWS["power_law"], 3, n=80), starts=1, iterations=3, seed=1)
    with pytest.raises(ModelError, match=message):
        ask(found)


def test_no_law_is_read_from_a_network_of_two_inputs():
    h, temp = signal("h")[t], signal("T")[t]
    hybrid = embedded(tank_model().white, {"T": -1e-6 / h}, [temp, h], (1,))
    found = estimate(hybrid, tank_record(LAWS["power_law"], 3, n=80), starts=1, iterations=3, seed=1)
    with pytest.raises(ModelError, match="reads 2 inputs"):
        learned_law(found)
