"""The search names what was hidden, and nothing else: few effects on hand-made records, the library in one process."""

from concurrent.futures import Executor, ThreadPoolExecutor
from dataclasses import replace
from functools import lru_cache
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.signal import lfilter

from benchmarks.blind.cases import draw
from smid import Dataset, OutputError, Parameter
from smid.diagnosis import Diagnosis, Effect, Extension, diagnose
from smid.diagnosis.search.effect_set import EffectSet
from smid.diagnosis.search.search import WIDTH, is_new, widest
from smid.diagnosis.search.trial import fitted_base
from smid.models import Line, Measurement, Model
from smid.models.symbols import signal, t
from tests.smid.diagnosis.lag_records import BOUND, LAG, dead_zone, known_lag, lag, late, record, steps

FEW = ("input_dead_zone", "input_delay", "sensor_bias", "missing_input")


@lru_cache
def hidden(what: str) -> Dataset:
    """A record of the lag with something hidden in it, and a channel that may drive it."""
    u = steps(0, 400)
    heat = np.repeat(np.random.default_rng(9).uniform(-1, 1, 100), 4)
    hiding = {
        "input_dead_zone": lambda: lag(dead_zone(u, 0.3)),
        "input_delay": lambda: lag(late(u, 2)),
        "sensor_bias": lambda: lag(u) + 0.4,
        "missing_input": lambda: lag(u + 0.5 * heat),
        "two": lambda: lag(dead_zone(u, 0.4)) + 0.15,
    }
    return record(u, hiding[what](), heat=heat)


def names(diagnosis: Diagnosis) -> list[str]:
    return [cause.effect for cause in diagnosis.causes]


def look(data: Dataset, effects=FEW, model: Model = LAG, noise_bound: float | None = BOUND, **options) -> Diagnosis:
    return diagnose(model, data, noise_bound, effects, certify=False, **({"workers": 1} | options))


two = lru_cache(lambda: look(hidden("two")))


@pytest.mark.parametrize("effect", FEW)
def test_a_hidden_effect_is_named_and_alone(effect):
    diagnosis = look(hidden(effect))
    assert (diagnosis.verdict, names(diagnosis)) == ("named", [effect])
    assert diagnosis.gain.rmse_after == pytest.approx(BOUND / np.sqrt(3), rel=0.15)
    (cause,) = diagnosis.causes
    assert cause.confidence > 0.99
    assert cause.evidence["chance"] <= 0.01
    assert not diagnosis.dropped
    assert diagnosis.experiment is None


def test_the_size_of_what_was_hidden_lies_in_the_interval():
    (cause,) = look(hidden("sensor_bias"), ["sensor_bias"]).causes
    (bias,) = cause.parameters
    assert bias.lower <= 0.4 <= bias.upper
    assert bias.null == 0.0
    assert not bias.lower <= bias.null <= bias.upper
    assert not bias.proven


def test_two_hidden_effects_are_named_the_larger_first():
    diagnosis = two()
    assert diagnosis.verdict == "named"
    assert names(diagnosis) == ["input_dead_zone", "sensor_bias"]
    first, second = diagnosis.causes
    # Each against the model without it and with all others: the first is missed most.
    assert first.evidence["rmse_after"] == pytest.approx(second.evidence["rmse_after"], rel=0.01)
    assert first.evidence["rmse_before"] > second.evidence["rmse_before"] > 2 * second.evidence["rmse_after"]
    assert {p.name for p in diagnosis.model.parameters} >= set(diagnosis.new_parameters)
    assert diagnosis.gain.rmse_after == pytest.approx(BOUND / np.sqrt(3), rel=0.15)


def test_one_effect_is_named_twice_where_it_is_the_only_one_to_try():
    u = steps(0, 400)
    heat, flow = (np.repeat(np.random.default_rng(seed).uniform(-1, 1, 100), 4) for seed in (9, 10))
    data = record(u, lag(u + 0.5 * heat - 0.4 * flow), heat=heat, flow=flow)
    assert names(look(data, ["missing_input"])) == ["missing_input", "missing_input"]


@pytest.mark.parametrize("noise_bound", [BOUND, None])
@pytest.mark.parametrize("seed", range(4))
def test_nothing_is_named_on_clean_data(seed, noise_bound):
    u = steps(seed, 240)
    data = record(u, lag(u), seed, heat=np.random.default_rng(seed).normal(size=240))
    diagnosis = look(data, ("input_delay", "sensor_bias", "missing_input"), noise_bound=noise_bound)
    assert (diagnosis.verdict, diagnosis.causes) == ("none", ())
    assert diagnosis.model is diagnosis.base
    assert diagnosis.gain.rmse_after == diagnosis.gain.rmse_before
    assert noise_bound is not None or not diagnosis.unexplained


@pytest.mark.parametrize("kind", ["white", "walk"])
def test_a_decoy_channel_is_not_named(kind):
    random = np.random.default_rng(3)
    decoy = random.normal(size=400) if kind == "white" else np.cumsum(random.normal(size=400))
    u = steps(0, 400)
    data = record(u, lag(dead_zone(u, 0.3)), heat=decoy)
    assert names(look(data, ("missing_input", "scheduled_parameter", "input_dead_zone"))) == ["input_dead_zone"]
    assert look(data, ("missing_input",)).verdict == "none"


def integrator() -> Model:
    """w' = K u, without a leak."""
    w, u = signal("w")[t], signal("u")[t]
    K, c = Parameter("K", 0.1, 10), Parameter("c", 0.0, 5)
    return Model("leaky", (K, c), (Line(w, K.symbol * u - c.symbol * w, rate=True),), (Measurement("y", "w", "eta"),))


def test_one_equation_under_two_names_is_not_ambiguous():
    """At a positive speed a decay with the square is a quadratic drag."""
    u = steps(2, 400, 12, 0.1)
    w, now = np.zeros(400), 0.3
    for k in range(400):
        w[k] = now
        for _ in range(50):
            now += 0.1 / 50 * (1.5 * u[k] - 2.0 * now * now)
    diagnosis = look(record(u, w), ("power_law", "quadratic_drag"), integrator())
    assert diagnosis.verdict == "named"
    (cause,) = diagnosis.causes
    (rival,) = cause.rivals
    assert {cause.effect, rival.effect} == {"power_law", "quadratic_drag"}
    assert rival.rmse == pytest.approx(cause.evidence["fit_rmse_after"], rel=0.02)


@lru_cache
def two_levels() -> Diagnosis:
    """An input of two levels: whether the plant's gain is less or the input is cut off, nobody can tell."""
    u = np.repeat(np.random.default_rng(1).integers(0, 2, 100), 4).astype(float)
    return look(record(u, lag(0.7 * u)), ("gain", "input_saturation", "input_delay"), known_lag())


def test_what_cannot_be_told_apart_is_ambiguous():
    diagnosis = two_levels()
    assert diagnosis.verdict == "ambiguous"
    assert set(diagnosis.alternatives) == {"gain", "input_saturation"}
    assert "gain" in diagnosis.conclusion
    assert "input_saturation" in diagnosis.conclusion
    assert diagnosis.causes[-1].confidence < 0.9


def test_further_numbers_that_do_nothing_are_no_rival():
    """A curve before a lag of the sensor, with limits beyond what is recorded, is that lag."""
    case = draw(97348, 1, 1000)
    diagnosis = look(case.data, ("sensor_lag", "inner_curve"), case.model, noise_bound=case.noise_bound)
    assert diagnosis.verdict == "named"
    assert names(diagnosis) == ["sensor_lag"]
    assert diagnosis.causes[0].synonyms == ("inner_curve",)


def test_where_ambiguous_an_experiment_would_tell():
    diagnosis = two_levels()
    experiment = diagnosis.experiment
    assert experiment is not None
    assert experiment.difference > 2 * diagnosis.gain.rmse_after
    assert set(experiment.rivals) == set(diagnosis.alternatives)
    assert experiment.values.min() >= -1e-12
    assert experiment.values.max() <= 1 + 1e-12
    assert experiment.sentence in str(diagnosis)


def pushed(name: str, channels: tuple[str, ...]) -> Effect:
    """An effect that adds channels to the output, all by one weight."""

    def extend(model, site):
        weight = Parameter(f"{name}_weight", -3, 3, "", 0.0)
        if weight.name not in {p.name for p in model.parameters}:
            term = weight.symbol * sum(signal(c)[t] for c in channels)
            seen = model.insert_sensor(site.output, lambda x: x + term, [weight], new_name=f"y_{name}")
            yield Extension(seen, ({weight.name: 0.1},))

    return Effect(name, "channels show in the output", extend, lambda values, _: f"By {next(iter(values.values())):g}.")


def test_what_was_named_and_is_not_missed_is_dropped():
    """The sum p + q + r of three channels explains p + q best at first; with p and q themselves it is idle."""
    random = np.random.default_rng(4)
    p, q, r = random.normal(size=(3, 400))
    u = steps(4, 400)
    data = record(u, lag(u) + 0.3 * (p + q), p=p, q=q, r=r)
    effects = [pushed("all", ("p", "q", "r")), pushed("one", ("p",)), pushed("other", ("q",))]
    diagnosis = look(data, effects)
    assert diagnosis.dropped == ("all",)
    assert sorted(names(diagnosis)) == ["one", "other"]
    assert "all_weight" not in {p.name for p in diagnosis.model.parameters}


def test_interrupted_it_tells_what_was_found():
    lines = []

    def progress(line):
        lines.append(line)
        if line.startswith("best so far"):
            raise KeyboardInterrupt

    diagnosis = look(hidden("two"), progress=progress)
    assert diagnosis.interrupted
    assert names(diagnosis) == ["input_dead_zone"]
    assert lines[-1] == "best so far: input_dead_zone"
    assert not two().interrupted


def test_interrupted_before_anything_was_found_nothing_is_named():
    def progress(line):
        if "input_delay: " in line:
            raise KeyboardInterrupt

    diagnosis = look(hidden("two"), progress=progress)
    assert diagnosis.interrupted
    assert (diagnosis.verdict, diagnosis.causes) == ("none", ())
    assert diagnosis.to_dict()["interrupted"] is True


def test_progress_tells_every_effect():
    lines = []
    look(hidden("sensor_bias"), progress=lines.append)
    assert "fitting the base model" in lines
    assert "trying 4 effects on the base model" in lines
    for effect in FEW:
        assert any(f"{effect}: " in line for line in lines)
    assert "best so far: sensor_bias" in lines


PAIR = ("sensor_bias", "input_delay")
serial = lru_cache(lambda: look(hidden("sensor_bias"), PAIR))


def test_processes_give_the_same_result():
    assert look(hidden("sensor_bias"), PAIR, workers=2).to_dict() == serial().to_dict()


class Counting(ThreadPoolExecutor):
    """Counts what it is given."""

    def __init__(self) -> None:
        super().__init__(1)
        self.calls = 0

    def submit(self, *arguments, **options):
        self.calls += 1
        return super().submit(*arguments, **options)


def test_an_executor_of_ones_own_does_the_work():
    with Counting() as executor:
        assert isinstance(executor, Executor)
        found = look(hidden("sensor_bias"), PAIR, executor=executor, workers=None)
        assert executor.calls >= len(PAIR)
        assert executor.submit(int, 3).result() == 3, "it is left open"
    assert found.to_dict() == serial().to_dict()


def test_two_frictions_are_named_not_the_drag_that_resembles_both():
    """A mass that Newton's law alone moves; the friction is integrated finely, and stops it, apart from the package."""
    rng, n = np.random.default_rng(1), 600
    force = np.repeat(rng.uniform(-2, 2, n // 12), 12)
    speed, v = np.zeros(n), 0.0
    for k in range(1, n):
        for _ in range(40):
            v += 5e-4 * (2.0 * force[k - 1] - 0.7 * v)
            v = np.sign(v) * max(abs(v) - 5e-4 * 0.8, 0.0)
        speed[k] = v
    gain, w, u = Parameter("gain", 0.1, 10.0), signal("w"), signal("u")
    mass = Model("mass", (gain,), (Line(w[t], gain.symbol * u[t], rate=True),), (Measurement("y", "w", "eta"),))
    speed += rng.uniform(-0.02, 0.02, n)
    data = Dataset.from_arrays(input={"u": force}, output={"y": speed}, sampling_time=0.02)
    diagnosis = look(data, ["quadratic_drag", "viscous_friction", "coulomb_friction", "sensor_bias"], mass, 0.02)
    assert set(names(diagnosis)) == {"viscous_friction", "coulomb_friction"}
    values = {p.name: p.value for cause in diagnosis.causes for p in cause.parameters}
    assert values["speed_friction"] == pytest.approx(0.8, rel=0.1)
    assert values["speed_damping"] == pytest.approx(0.7, rel=0.1)


def tanks(law: float, rim: float) -> tuple[Model, Dataset]:
    """Two linear tanks, and a record of two that empty along a power and of which the first spills half over."""
    u, n = 1.2 + 0.6 * steps(5, 800, 80), 800
    levels, a, b = np.zeros(n), 1.0, 1.0
    for k in range(1, n):
        for _ in range(10):
            out, spill = a**law, 0.0
            a += 0.002 * (u[k - 1] - out)
            if a > rim:
                a, spill = rim, a - rim
            b += 0.002 * (out - b**law) + 0.5 * spill
        levels[k] = b
    levels[0] = 1.0
    flow, first, second, drive = Parameter("flow", 0.1, 5.0), signal("first"), signal("second"), signal("u")
    lines = (
        Line(first[t], drive[t] - flow.symbol * first[t], rate=True),
        Line(second[t], flow.symbol * (first[t] - second[t]), rate=True),
    )
    levels += np.random.default_rng(6).uniform(-0.01, 0.01, n)
    data = Dataset.from_arrays(input={"u": u}, output={"y": levels}, sampling_time=0.02)
    return Model("two tanks", (flow,), lines, (Measurement("y", "second", "eta"),), scheme="euler"), data


def test_a_vessel_that_nobody_sees_overflows():
    model, data = tanks(1.0, 1.4)
    diagnosis = look(data, ("output_saturation", "input_saturation", "power_law", "output_curve"), model, 0.01)
    assert names(diagnosis) == ["output_saturation"]
    rim, share = diagnosis.causes[0].parameters
    assert rim.value == pytest.approx(1.4, rel=0.02)
    assert share.value == pytest.approx(0.5, abs=0.05)
    assert "first overflows" in diagnosis.causes[0].sentence


def test_tanks_in_succession_empty_along_one_law():
    model, data = tanks(0.5, np.inf)
    diagnosis = look(data, ("power_law", "output_curve", "time_constant"), model, 0.01)
    assert names(diagnosis) == ["power_law"]
    assert diagnosis.causes[0].parameters[0].value == pytest.approx(0.5, abs=0.03)


def test_a_cause_that_carries_over_only_beside_another_is_found():
    """While the pole drifts, a limit alone hardly lowers the error on what comes later."""
    u, w = steps(3, 500, 12), np.zeros(500)
    for k, pole in enumerate(np.linspace(0.5, 0.95, 500)):
        w[k] = pole * w[k - 1] + 0.3 * u[k - 1] if k else 0.0
    limit = np.quantile(np.abs(w[:350]), 0.75)
    data = record(u, np.clip(w, -limit, limit))
    alone = look(data, ("output_saturation",), OutputError())
    assert alone.gain.rmse_after > 0.9 * alone.gain.rmse_before
    assert alone.unexplained
    both = look(data, ("parameter_drift", "output_saturation"), OutputError())
    assert set(names(both)) == {"parameter_drift", "output_saturation"}
    assert both.gain.rmse_after < 0.1 * both.gain.rmse_before


def test_a_dead_zone_that_no_sample_enters_is_a_bias():
    u = 1.0 + 0.4 * steps(0, 400)
    diagnosis = look(record(u, lag(u - 0.3)), ("input_dead_zone", "coulomb_friction", "sensor_bias"))
    assert (diagnosis.verdict, names(diagnosis)) == ("named", ["sensor_bias"])
    assert "coulomb_friction" in diagnosis.skipped


def test_a_base_bent_out_of_shape_does_not_hide_the_cause():
    """Without the bias, the second-order model spends a pole near 1 on it, and would keep it there.

    A third pole does as well as the bias then: the state of a pole at 1 is a bias. So the two may share the evidence.
    """
    u = steps(0, 400, 25)
    w = lfilter([0.0, 0.03, 0.02], [1.0, -1.4, 0.45], u) + 2.0
    diagnosis = look(record(u, w), ("sensor_bias", "extra_lag", "resonance"), OutputError(na=2, nb=2))
    assert "sensor_bias" in (*names(diagnosis), *diagnosis.alternatives)
    assert diagnosis.gain.rmse_after < 1.1 * BOUND / np.sqrt(3)


@pytest.mark.parametrize("seed", [0, 3])
def test_glitches_at_a_high_level_are_no_noise_that_grows_with_it(seed):
    u = 1 + steps(seed, 600)
    clean = lag(u)
    y = clean + np.random.default_rng(seed).uniform(-0.01, 0.01, 600)
    y[np.argsort(clean[:480])[-60::12]] += 0.3
    assert names(look(record(u, y, bound=0.0), ("outliers", "multiplicative_noise"), noise_bound=0.01)) == ["outliers"]


@pytest.mark.parametrize(("share", "grown_again"), [(0.999, False), (0.5, True)])
def test_a_set_is_grown_again_only_from_a_much_better_fit(share, grown_again):
    """Such as a second minimum of the base model, which shows other effects."""
    data = hidden("two")
    base = fitted_base(LAG, data, (np.ones(400, bool),), "u", "y")
    first = EffectSet((), base.fit, base.errors)
    second = replace(first, fit=replace(base.fit, cost=share * base.fit.cost))
    assert is_new(first, {}, base)
    assert is_new(second, {first.names: first}, base) == grown_again


def test_small_sets_are_grown_first():
    """In the place of each of two effects, and of what stands in for both, all others are tried before a third."""
    said = []
    look(hidden("two"), progress=said.append)
    tried = [line.split(" effects on ")[1] for line in said if line.startswith("trying ")]
    sizes = [0 if names == "the base model" else names.count(",") + 1 for names in tried]
    assert sizes[: WIDTH + 1] == [0, *[1] * WIDTH]
    assert max(sizes) > 1


def test_one_stand_in_does_not_fill_the_beam():
    """The pairs with it are the best by far; the best pair without it comes before a third one with it."""

    def ranked(*names: str) -> SimpleNamespace:
        return SimpleNamespace(names=names, effects=SimpleNamespace(names=names, trials=names, detected=None))

    stand_ins = [ranked("curve", name) for name in ("delay", "drift", "lag")]
    found = widest(
        [ranked("curve", "delay", "lag"), *stand_ins, ranked("friction", "gravity"), ranked("gravity", "lag")]
    )
    assert [one.names for one in found] == [("curve", "delay"), ("friction", "gravity"), ("curve", "drift")]
