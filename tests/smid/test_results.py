"""What a user of notebooks and pandas expects of every result: HTML, words, plain data, and a frame that agrees."""

import copy
import dataclasses
import importlib
import inspect
import itertools
import json
import math
import pkgutil
import re
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from tempfile import TemporaryDirectory
from xml.etree import ElementTree

import numpy as np
import pytest
import sympy

import smid
from relaxations.formats.expressions import problem_of, variables
from relaxations.search.enclosure import Proof
from relaxations.search.minimum import minimise
from smid.data import Channel, excitation
from smid.data.bundled import record_path
from smid.design import InputFamily, d_optimal, fisher_information, shrinking_input
from smid.diagnosis import Cause, CauseParameter, Fault, Rival
from smid.display.result import Tabular, optional, plain
from smid.hybrid import (
    BackCouplings,
    CostSurface,
    Ensemble,
    Extrapolation,
    HybridEstimate,
    LearnedCurve,
    LearnedLaw,
    ReadLaw,
    TrainedRange,
    required,
    series,
)
from smid.hybrid.estimate import ERRORS
from smid.identification.dead_zone import DeadZoneThreshold
from smid.identification.estimate import ParameterInterval
from smid.identification.lowest_order import OrderStep
from smid.models import OutputError, Reactor
from smid.networks import MultiStart, Stop, TanhNetwork, train
from smid.recursive import Arx, NormalisedGradient, RecursiveSet, compare, gain_study
from smid.sensors import CFPX, PTX, bound_error, check_sensor, train_sensor, trained_range
from smid.study import phases
from smid.theses.clutch.overview import record_overview
from smid.theses.clutch.sensor_study import (
    ErrorTable,
    ForeignRow,
    ForeignStudy,
    IntervalRow,
    IntervalStudy,
    SensorTraces,
    SingleSensorStudy,
    table_5_3,
)
from smid.theses.hybrid.arm import (
    Alternation,
    ArmStudy,
    EmbeddedRuns,
    EmbeddedStudy,
    NetworkRuns,
    WhiteEstimate,
)
from smid.theses.hybrid.inputs import InputStudy
from smid.theses.hybrid.inputs.input_study import InputRow
from smid.theses.hybrid.reactor import OutputErrors, ReactorStudy, RequirementStudy, TimeConstants
from smid.theses.hybrid.reactor.conditions import TRAININGS, VALIDATIONS, OtherConditions
from smid.theses.hybrid.reactor.output_errors import CELLS
from smid.theses.hybrid.reactor.requirements import Learned

NOUNS = {
    *("Model", "TanhNetwork", "VirtualSensor", "PTX", "BoundedSensor"),  # they are applied, and saved their own way
    *("InputFamily", "Sines", "Motion", "ModulatingFilter", "FreeRunError"),  # what a computation is given
    *("Iterate", "NormalEquations", "Sample", "Scaling", "Split"),  # steps inside one
}
"""Classes that public functions return and that are no results."""


def returned():
    """Return the classes of this package that public functions return, by name."""
    found = {}
    packages = ["smid", *(m.name for m in pkgutil.walk_packages(smid.__path__, "smid.") if m.ispkg)]
    for module in map(importlib.import_module, packages):
        for verb in (getattr(module, name) for name in getattr(module, "__all__", ())):
            if inspect.isfunction(verb):
                for word in re.findall(r"\w+", str(inspect.signature(verb).return_annotation)):
                    item = getattr(sys.modules[verb.__module__], word, None)
                    if inspect.isclass(item) and item.__module__.startswith("smid"):
                        found[word] = item
    return found


def dead_zone():
    rng = np.random.default_rng(1)
    u = np.repeat(rng.uniform(-1, 1, 40), 6)
    v, w = np.sign(u) * np.maximum(np.abs(u) - 0.3, 0), np.zeros(240)
    for k in range(1, 240):
        w[k] = 0.7 * w[k - 1] + 0.3 * v[k - 1]
    y = w + rng.uniform(-0.01, 0.01, 240)
    data = smid.Dataset.from_arrays(input={"u": u}, output={"y": y}, sampling_time=0.1, units={"y": "<bar>"})
    return smid.diagnose(smid.OutputError(1, stable=True), data, 0.01, ["input_dead_zone", "missing_input"], workers=1)


def identified():
    model = smid.OutputError(stable=True)
    u, y = [1.0, 0, 1, 1, 0, 0, 1, 0], [0.0, 1, 0.5, 1.3, 1.6, 0.8, 0.4, 1.2]
    data = smid.Dataset.from_arrays(input={"u": u}, output={"y": y}, sampling_time=0.1, units={"y": "bar"})
    estimate = smid.identify(model, data, 0.1)
    yield from (estimate, estimate["a1"], data, excitation(u), smid.error_bound(model, data))
    empty = smid.EmptyFeasibleSetError("proven: too small", 0.03, (("run <1>", 3, 0.6),))
    yield empty
    steps = (OrderStep(model, True, False, str(empty), 0.03), OrderStep(model, False, True, "Tight.", None))
    yield smid.LowestOrder(steps, estimate, "y", "bar", 0.01)
    yield smid.validate(estimate.model, data, 0.1)
    yield smid.compare([estimate.model, estimate], data)
    yield smid.step(estimate, 3)
    yield smid.fit(model, data)
    yield smid.projections(estimate)
    with TemporaryDirectory() as folder:
        proof = Path(folder) / "proof.json"
        smid.identify(smid.OutputError(1, stable=True), data, 0.1, certificate=proof)
        yield smid.verify(proof, data)
    with ThreadPoolExecutor(1) as executor:
        yield smid.order_study(model, data, 0.1, orders=[1], executor=executor)


def after_the_fit():
    rng = np.random.default_rng(0)
    u = rng.standard_normal(200)
    y = np.concatenate([[0.0], u[:-1]]) + 0.1 * rng.standard_normal(200)
    data = smid.Dataset.from_arrays(input={"u": u}, output={"y": y}, sampling_time=0.1, units={"y": "<bar>"})
    yield from (smid.signals.spectrum(data), smid.signals.delay_estimate(data, longest=10))
    tested = smid.residuals(smid.OutputError(0).with_values({"b0": 0.9}), data)
    yield from (tested, tested.outputs[0], smid.data.show(record_path("hammerstein_20C_ramp_a")))


def diagnosed():
    diagnosis = dead_zone()
    yield diagnosis
    yield from (diagnosis.misfit, diagnosis.gain)
    parameters = (CauseParameter("gap", "mA", 40.0, 38.0, math.inf, None, proven=True),)
    yield Cause("gain", "", "Too large.", 0.9, parameters, (Rival("lag", 0.3, 2.0, "a < b"),), {"rmse_after": 0.1})
    yield Fault("outliers", "y", "warning", "One glitch.", ((0, 3, 4),))


def tracked():
    rng = np.random.default_rng(2)
    u = rng.uniform(-1, 1, 80)
    w = np.zeros(80)
    for k in range(1, 80):
        w[k] = (0.8 if k < 50 else 0.4) * w[k - 1] + u[k - 1]
    data = smid.Dataset.from_arrays(input=u, output=w, sampling_time=0.1)
    comparison = compare([Arx()], [NormalisedGradient(0.5)], data)
    yield comparison
    yield from (comparison.trackings[0], comparison.trackings[0].history, comparison.trackings[0].frozen)
    yield gain_study(Arx(), NormalisedGradient(), data, gains=[0.5, 1.0])
    estimator = RecursiveSet(Arx(), 0.01, {"b0": (-10.0, 10.0)})
    for sample in zip(u, w, strict=True):
        estimator.update(*sample)
    yield estimator.history
    yield estimator.history.changes[0]
    y = [0.0, 1, 0.5, 1.3, 1.6, 0.8, 0.4, 1.2]
    short = smid.Dataset.from_arrays(input=[1.0, 0, 1, 1, 0, 0, 1, 0], output=y, sampling_time=1.0)
    yield phases(OutputError(stable=True), short, [short])


def designed():
    line = np.stack([np.arange(5.0), np.ones(5)], axis=1)
    information = fisher_information(line, ("slope", "offset"), (2.0, 1.0), 1.0)
    yield information
    family = InputFamily("step", lambda c: np.where(np.arange(40) < 40 * c[0], 1.0, 0.0), ("share",), (0,), (1,), 1.0)
    yield d_optimal(
        family,
        lambda u: fisher_information(np.stack([u, np.ones(40)], 1), ("gain", "offset"), (1.0, 1.0), 1.0),
        budget=20,
    )
    yield shrinking_input(family, lambda u: {"gain": 0.1 + (u[0] - 0.3) ** 2}, budget=5)
    box = {name: (0.9, 1.1) for name in ("theta", "b", "Wd", "Ws")}
    arm = {
        name: ParameterInterval(name, "", *ends, np.nan, np.nan, Proof.PROVEN, Proof.BOX) for name, ends in box.items()
    }
    four = fisher_information(np.eye(6)[:, :4], tuple(box), (1.0, 2.0, 3.0, 4.0), 1.0)
    yield InputStudy((InputRow("sines", np.ones(3), np.ones(3), 4, four, arm),), 0.02, 0.002)


def networks():
    x = np.linspace(-1.0, 1.0, 30)[:, None]
    training = train(x, np.tanh(2 * x[:, 0]), hidden=(1,), seed=1, starts=1, iterations=5)
    yield from (training, training.search, training.search.descents[0])
    hybrid = series(Reactor(2.0, sampling_time=1.0), BackCouplings(0, 1), (1,))
    yield hybrid
    weights = {parameter.name: 0.1 for parameter in hybrid.term.parameters}
    estimated = dataclasses.replace(hybrid, model=hybrid.model.with_values(weights))
    fit = smid.fitting.problem.Fit(estimated.model, ({},), ({"y": np.ones(3)},), 0.5, 4)
    trained = (TrainedRange("N", "u[t]", 0.0, 1.0),)
    data = smid.Dataset.from_arrays(input={"u": np.ones(3)}, output={"y": np.ones(3)}, sampling_time=1.0)
    search, used = MultiStart(training.search.descents), (np.ones(3, bool),)
    found = HybridEstimate(estimated, fit, search, Stop.CONVERGED, trained, {"y": 0.1}, data, used)
    yield from (found, Ensemble(found, (found, found), 0))
    yield Extrapolation(trained, (np.array([False, True, False]),), ((0.0, 2.0),))
    curve = LearnedCurve("N", "u[t]", np.linspace(0.0, 1.0, 3), np.ones(3), np.full(3, 0.1))
    model = estimated.model.with_parameter(smid.Parameter("N_linear", 0, 9)).with_values({"N_linear": 2.0})
    line = sympy.Symbol("N_linear", real=True) * sympy.Symbol("x", real=True)
    law = ReadLaw(("proportional",), line, ("N_linear",), dataclasses.replace(fit, model=model), -3.0)
    yield LearnedLaw(curve, (law, dataclasses.replace(law, merit=-4.0)), 1.0)
    yield curve


def reactor():
    needed = required(Reactor(2.0), Reactor(4.0), "series", 1.0)
    yield needed
    requirements = RequirementStudy((Learned("factor", "series, extra", "simulation", needed, np.zeros(41)),))
    errors = OutputErrors(
        ("factor",),
        {(e, c): np.array([0.1 if e == "simulation" else np.inf]) for e in ERRORS for c in CELLS},
        np.ones(1),
        {"factor": {name: np.ones(3) for name in ("plant", "first principles", *CELLS)}},
    )
    cells = itertools.product(TRAININGS, CELLS, VALIDATIONS)
    conditions = OtherConditions(("factor",), dict.fromkeys(cells, np.array([0.1])), {"sine": (np.ones(3),) * 3})
    times = TimeConstants(*({"static": np.array([1.9, 2.1 + k])} for k in range(3)))
    yield from (requirements, errors, conditions, times, ReactorStudy(errors, conditions, requirements, times))


def arm():
    network = TanhNetwork((1, 1), np.array([1000.0, 0.0, -0.43 / 16, 0.0]))
    ends, worse = np.array([21.7, 30.0]), np.array([[0.1, 0.2], [np.inf, 0.3]])
    points = np.ones((2, 11))
    runs = EmbeddedRuns("one_sine", "random", ends, ends / 100, worse, worse[0], ends / 1e3, ends / 20, points)
    white = WhiteEstimate({"theta": 21.7, "b": 0.0027, "Ws": 1.6, "Wd": 0.43}, "exact", 0.01)
    many = NetworkRuns(ends, ends / 100, (network, network))
    yield from (runs, white, many, EmbeddedStudy((runs,)), Alternation(ends, network, 0.02))
    yield ArmStudy({"ours": white}, many, many, EmbeddedStudy((runs,)))
    yield CostSurface(("first", "second"), np.arange(2.0), np.arange(3.0), 1 + np.arange(6.0).reshape(2, 3))


def clutch():
    overview = record_overview()
    yield overview
    data = overview.data.select(("20C_ramp_b",)).crop(0, 300)
    sensor = CFPX(3).fit(overview.data.select("20C_step_a"), seed=1)
    bounded = bound_error(sensor, data)
    yield from (sensor.predict(data), bounded.predict(data), check_sensor(bounded, data), trained_range(bounded))
    yield train_sensor(overview.data.crop(0, 900), ["pressure"], "position", structures=["polynomial"])
    zone = DeadZoneThreshold(Channel("u", "V"), Channel("y", "mm"), (1.0, 2.0), (0.0, 0.1), 0.05, 0.0, 40)
    yield smid.DeadZones((zone,))
    errors = ErrorTable("RMSE in mm.", ("CPX", "PTX"), ("20C_step_b",), np.array([[0.2, 0.1]]))
    rows = (IntervalRow("20C_ramp_b", bounded.margin, 0.99, 0.4),)
    yield from (errors, table_5_3(), SingleSensorStudy(PTX(), {}, errors, errors), IntervalStudy(bounded, rows, data))
    yield ForeignStudy((ForeignRow("rate", "20C_step_b", ("flow",), 0.1, 0.05, ("PX", 0.2), ("CPX all", 0.1)),))
    yield SensorTraces("5.14", ("20C_ramp_b",), np.arange(3.0), np.ones(3), np.ones(3), {"PX": np.zeros(3)})


SOURCES = (identified, after_the_fit, diagnosed, tracked, designed, networks, reactor, arm, clutch)


@pytest.fixture(scope="module")
def results():
    return [result for source in SOURCES for result in source()]


@pytest.fixture(scope="module")
def pages(results):
    return [(result, ElementTree.fromstring(f"<div>{result._repr_html_()}</div>")) for result in results]


def numbers(content):
    """Return every number in plain data."""
    if isinstance(content, dict | list):
        return {n for item in (content.values() if isinstance(content, dict) else content) for n in numbers(item)}
    return {content} if isinstance(content, float | int) else set()


def test_every_returned_class_is_tried(results):
    classes = returned()
    assert len(classes) > 40
    assert set(classes) - NOUNS <= {type(result).__name__ for result in results}
    assert set(classes) >= NOUNS, "a noun is returned no more: take it off the list"


def test_html_is_well_formed_and_of_no_colour(pages):
    for result, page in pages:
        assert "".join(page.itertext()).strip(), type(result)
        assert all(head.get("scope") == "col" for head in page.iter("th")), type(result)
        for element in (page, *page.iter("table"), *page.iter("td"), *page.iter("th"), *page.iter("p")):
            assert not re.search("color|background|#", element.get("style", "")), type(result)


def test_html_and_text_tell_the_same(pages):
    for result, page in pages:
        cells = [cell.text for cell in page.iter("td") if cell.text]
        if type(result).__str__ is smid.display.result.Result.__str__:
            assert all(cell in str(result) for cell in cells), type(result)


def test_what_a_picture_tells_better_has_one(pages):
    drawn = {type(result).__name__ for result, page in pages if page.findall(".//{http://www.w3.org/2000/svg}svg")}
    assert drawn == {"CostSurface", "Dataset", "Diagnosis"}


def test_words_are_no_dump_of_fields(results):
    for result in results:
        assert not str(result).startswith(f"{type(result).__name__}("), type(result)
        assert len(repr(result)) <= len(str(result)) + 100, type(result)


def test_results_compare_without_an_error_and_can_be_keys(results):
    for result in results:
        other = copy.deepcopy(result)
        assert (result == other) <= (hash(result) == hash(other)), type(result)


def test_plain_data_are_json(results):
    for result in results:
        json.dumps(result.to_dict(), allow_nan=False)


def test_frames_have_the_numbers_of_the_plain_data(results):
    tried = 0
    for result in results:
        if isinstance(result, Tabular | smid.Dataset):
            frame, known = result.to_pandas(), numbers(result.to_dict())
            assert len(frame), type(result)
            for name in frame.select_dtypes("float"):
                shown = [x for x in frame[name].tolist() if math.isfinite(x)]
                assert set(shown) <= known, (type(result), name)
                tried += len(shown)
    assert tried > 300


def test_a_missing_package_is_named_with_its_cure(monkeypatch):
    monkeypatch.setitem(sys.modules, "control", None)
    with pytest.raises(ImportError, match=r"to_control needs control; install it with: pip install smid\[control\]"):
        optional("control", "to_control")


def test_what_has_no_plain_form_is_refused():
    with pytest.raises(TypeError, match="object has no plain form"):
        plain({"thing": object()})


def test_relaxations_show_bounds(results):
    x, y = variables("x y")
    found = minimise(*problem_of((x - 1) ** 2 + y, [x + y >= 1], box={"x": (-2, 2), "y": (-2, 2)}))
    page = ElementTree.fromstring(f"<div>{found._repr_html_()}</div>")
    shown = [cell.text for cell in page.iter("td")]
    assert shown[::2] == ["lower end, certified", "upper end, verified", "x", "y"]
    assert float(shown[1]) == found.lower <= found.upper == float(shown[3])
    enclosure = results[0].enclosure
    rows = list(ElementTree.fromstring(f"<div>{enclosure._repr_html_()}</div>").iter("tr"))
    for row, interval in zip(rows[1:], enclosure.intervals, strict=True):
        name, *ends = (cell.text for cell in row)
        assert name == interval.name
        assert [float(end) for end in ends] == sorted(float(end) for end in ends)
        assert (float(ends[0]), float(ends[-1])) == (interval.lower, interval.upper)
