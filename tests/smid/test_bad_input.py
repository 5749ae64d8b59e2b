"""A mistake is named, with its cure, before any solver is called; a solver that fails proves nothing and says so."""

import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import relaxations.proof.bounding as bounding
from relaxations.errors import ProblemError
from relaxations.proof.method import method_names
from relaxations.search.enclosure import Proof
from relaxations.solvers.interface import ConicSolution, Stop
from smid import (
    DataError,
    Dataset,
    ErrorsInVariables,
    Hammerstein,
    Model,
    ModelError,
    OutputError,
    Wiener,
    diagnose,
    error_bound,
    fit,
    identify,
    load_model,
    lowest_order,
    validate,
)

RNG = np.random.default_rng(0)
U, Y = RNG.normal(size=20), RNG.normal(size=20)
MODEL = OutputError(1, 0, stable=True, bounds={"b0": (-5, 5)})


def data_of(u: object = U, y: object = Y, **settings: object) -> Dataset:
    return Dataset.from_arrays(input={"u": u}, output={"y": y}, **{"sampling_time": 0.5, **settings})  # type: ignore[arg-type]


def csv(text: str, tmp: Path, **settings: object) -> Dataset:
    path = tmp / "run.csv"
    path.write_text(text, encoding="utf-8")
    return Dataset.from_file(path, **{"input": "u", "output": "y", **settings})  # type: ignore[arg-type]


def spoilt(value: float) -> np.ndarray:
    y = Y.copy()
    y[7] = value
    return y


ROWS = "".join(f"{k},{u:.3f},{y:.3f}\n" for k, (u, y) in enumerate(zip(U, Y, strict=True)))
HEADER = "time,u,y\n"
SWAPPED = HEADER + "0,1,1\n2,0,1\n1,1,0\n3,0,0\n"
REPEATED = HEADER + "0,1,1\n1,0,1\n1,1,0\n2,0,0\n"

MISTAKES: dict[str, tuple[Callable[[Path], object], type[Exception], str, str]] = {
    # what is done, the error, its cause, its cure
    "no sample of the output": (
        lambda _: data_of(y=np.full(len(Y), np.nan)),
        DataError,
        "every sample of 'y' is missing in experiment 'experiment'",
        "leave one of them out",
    ),
    "an infinite sample": (lambda _: data_of(u=spoilt(np.inf)), DataError, "channel 'u'.*is inf at sample 7", "crop"),
    "unsorted time stamps": (lambda tmp: csv(SWAPPED, tmp), DataError, "run.csv.*time", "sort"),
    "repeated time stamps": (lambda tmp: csv(REPEATED, tmp), DataError, "run.csv.*time", "drop|remove|keep|merge"),
    "a missing column": (
        lambda tmp: csv(HEADER + ROWS, tmp, output="z"),
        DataError,
        "no column 'z'",
        "u|y",
    ),
    "unequal lengths": (
        lambda _: data_of(y=Y[:-1]),
        DataError,
        r"differ in length \('u' 20, 'y' 19\)",
        "cut them to the same instants",
    ),
    "a missing channel": (
        lambda _: identify(
            OutputError(input="current", output="pressure"),
            Dataset.from_arrays(input={"u": U, "v": Y}, output={"y": Y}, sampling_time=1.0),
            0.1,
        ),
        DataError,
        "the model needs the channel 'current', the data have u, v, y",
        "name the channels",
    ),
    "a name that no channel has": (
        lambda _: identify(OutputError(input="nonsense", stable=True), data_of(), 0.1),
        DataError,
        "the model needs the channel 'nonsense', the data have u, y",
        "name the channels",
    ),
    "a name that no channel has, validation": (
        lambda _: validate(OutputError(output="nonsense").with_values({"a1": 0.1, "b0": 1.0}), data_of()),
        ModelError,
        "the channel 'nonsense': they have u, y",
        "the data lack",
    ),
    "an input that appears twice": (
        lambda _: OutputError(input=["u1", "u1"]),
        ModelError,
        "input names 'u1' 2 times",
        "name each channel once",
    ),
    "delays that do not fit the inputs": (
        lambda _: OutputError(input=["u1", "u2"], delay=[1, 2, 3]),
        ModelError,
        r"delay = \[1, 2, 3\] does not fit",
        r"give one number for all paths, .* as in \[1, 1\]",
    ),
    "a name that is no text": (
        lambda _: OutputError(input=1),  # type: ignore[arg-type]
        ModelError,
        "channel name 1 cannot be used",
        "give one name",
    ),
    "a frame without times": (
        lambda _: identify(MODEL, data_of().to_pandas().reset_index(drop=True), 0.1),
        DataError,
        "the frame has no times",
        r"give it a DatetimeIndex, an index of seconds or a column time",
    ),
    "a list of arrays": (
        lambda _: validate(MODEL, [U, Y]),  # type: ignore[arg-type]
        TypeError,
        "the data are a list, not a Dataset",
        r"Dataset.from_arrays\(input=",
    ),
    "a path, phase 1": (
        lambda _: error_bound(MODEL, "run.csv"),  # type: ignore[arg-type]
        TypeError,
        "the data are a str",
        r"Dataset.from_file\(path, ",
    ),
    "a frame without a model": (
        lambda _: diagnose(None, data_of().to_pandas(), simulated="u"),
        TypeError,
        "the data are a DataFrame",
        "Dataset.from_pandas",
    ),
    "too few samples": (
        lambda _: identify(OutputError(2, 1, stable=True), data_of(U[:6], Y[:6]), 0.1),
        DataError,
        "has 6 samples, the model needs 7",
        "take a longer record or a smaller model",
    ),
    "a constant input": (
        lambda _: identify(MODEL, data_of(u=np.full(20, 2.5)), 0.1),
        DataError,
        "the input 'u' does not excite: it is 2.5 at every sample",
        "measure with an input that moves",
    ),
    "a constant input, phase 1": (
        lambda _: error_bound(Hammerstein(1, (3,), stable=True), data_of(u=np.zeros(20))),
        DataError,
        "the input 'u' does not excite: it is 0 at every sample",
        "measure with an input that moves",
    ),
    "a negative bound": (
        lambda _: identify(MODEL, data_of(), -0.1),
        ModelError,
        r"the noise bound of 'y' is -0\.1",
        "give a positive number",
    ),
    "a zero bound": (lambda _: identify(MODEL, data_of(), 0.0), ModelError, "is 0.0", "give a positive number"),
    "no number as a bound": (
        lambda _: identify(MODEL, data_of(), float("nan")),
        ModelError,
        "is nan",
        "error_bound encloses the least",
    ),
    "a model that was not called": (
        lambda _: identify(OutputError, data_of(), 1.0),
        TypeError,
        "is a function",
        "call it",
    ),
    "a path in place of a model": (
        lambda _: diagnose("plant.toml", data_of(), 1.0),
        TypeError,
        "the model is a str",
        "load_model",
    ),
    "an order as text": (lambda _: identify(MODEL, data_of(), 1.0, order="2"), ProblemError, "order '2'", "give one"),
    "half an order": (lambda _: identify(MODEL, data_of(), 1.0, order=1.5), ProblemError, "order 1.5", "give one"),
    "half a start": (lambda _: fit(MODEL, data_of(), starts=1.5), ModelError, "starts = 1.5", "a whole number"),
    "half a process": (lambda _: diagnose(MODEL, data_of(), workers=1.5), ModelError, "workers = 1.5", "a number of"),
    "a number as effects": (lambda _: diagnose(MODEL, data_of(), effects=3), ModelError, "effects = 3", "a list"),
    "no test part": (lambda _: diagnose(MODEL, data_of(), test=None), DataError, "test = None", "give a share"),
    "no sampling time": (
        lambda _: data_of(sampling_time=None),
        DataError,
        "sampling_time = None",
        "give it in seconds",
    ),
    "complex samples": (lambda _: data_of(u=U + 1j), DataError, "not a vector of real numbers", "convert it"),
    "less than no tolerance": (
        lambda _: identify(MODEL, data_of(), 1.0, tolerance=-1),
        ModelError,
        "tolerance = -1",
        "at least 0",
    ),
    "a bound to validate by": (
        lambda _: validate(MODEL.with_values({"a1": 0, "b0": 1}), data_of(), -1),
        ModelError,
        "is -1",
        "give a positive number",
    ),
    "a list as a bound": (lambda _: identify(MODEL, data_of(), ["y"]), ModelError, "is not a finite number", "give"),
    "an infinite bound": (lambda _: identify(MODEL, data_of(), np.inf), ModelError, "is inf", "give a positive number"),
    "a bound too few": (
        lambda _: identify(ErrorsInVariables(stable=True), data_of(), {"y": 0.1}),
        ModelError,
        "no noise bound for u",
        "give noise_bound=",
    ),
    "a bound of no channel": (
        lambda _: identify(MODEL, data_of(), {"y": 0.1, "z": 0.1}),
        ModelError,
        "noise bound of 'z'",
        "name one of them",
    ),
    "an unknown solver": (
        lambda _: identify(MODEL, data_of(), 0.1, solver="CLARABELLE"),
        ProblemError,
        "unknown solver 'CLARABELLE'",
        "choose one of clarabel",
    ),
    "an unknown solver, phase 1": (
        lambda _: error_bound(MODEL, data_of(), solver="none"),
        ProblemError,
        "unknown solver",
        "choose one of",
    ),
    "an unknown solver, orders": (
        lambda _: lowest_order([MODEL], data_of(), 0.1, solver="none"),
        ProblemError,
        "unknown solver",
        "choose one of",
    ),
    "an unknown method": (
        lambda _: identify(MODEL, data_of(), 0.1, method="lasserre"),
        ProblemError,
        "unknown method 'lasserre'",
        f"choose {', '.join(method_names())}$",
    ),
    "no round": (lambda _: identify(MODEL, data_of(), 0.1, rounds=0), ProblemError, "rounds is 0", "at least one"),
    "an order too low": (
        lambda _: identify(Wiener(1, (2,), stable=True), data_of(), 0.1, method="sparse", order=1),
        ProblemError,
        "order 1 is too low for the degrees",
        "the least order is 2",
    ),
    "no order": (
        lambda _: identify(MODEL, data_of(), 0.1, order=0),
        ProblemError,
        "order 0 is too low",
        "the least order is 1",
    ),
    "an unknown field": (
        lambda tmp: load_model(_file(tmp, 'class = "OutputError"\npoles = 1')),
        ModelError,
        "model.toml: unknown field of OutputError 'poles'",
        "na",
    ),
    "an offset that is no truth value": (
        lambda tmp: load_model(_file(tmp, 'class = "OutputError"\noffset = 1.5')),
        ModelError,
        "field 'offset' of OutputError is 1.5",
        "give true or false",
    ),
}


def _file(folder: Path, text: str) -> Path:
    path = folder / "model.toml"
    path.write_text(text, encoding="utf-8")
    return path


@pytest.mark.parametrize("name", MISTAKES)
def test_cause_and_cure_before_any_solve(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: object, **__: object) -> None:
        pytest.fail("a solver was called")

    monkeypatch.setattr(bounding, "solve", refuse)
    do, error, cause, cure = MISTAKES[name]
    with pytest.raises(error) as caught:
        do(tmp_path)
    message = str(caught.value)
    assert re.search(cause, message), message
    assert re.search(cure, message), message
    assert "\n" not in message


def test_an_offset_from_a_file(tmp_path: Path) -> None:
    for kind, call in (("OutputError", OutputError), ("ErrorsInVariables", ErrorsInVariables)):
        model: Model = load_model(_file(tmp_path, f'class = "{kind}"\noffset = true\n[bounds]\noffset = [-1, 1]'))
        assert model == call(offset=True, bounds={"offset": (-1, 1)})


@pytest.mark.parametrize("stop", [Stop.FAILED, Stop.LIMIT, Stop.INFEASIBLE, Stop.SOLVED])
@pytest.mark.parametrize("fill", [np.nan, 0.0, 1e300])
def test_a_solver_that_fails_proves_nothing(monkeypatch: pytest.MonkeyPatch, stop: Stop, fill: float) -> None:
    """Whatever the solver claims, without multipliers that check out nothing is certified."""

    def failing(program, objective, solver="clarabel"):  # type: ignore[no-untyped-def]
        rows = len(honest(program, objective, solver).dual)
        return ConicSolution(stop, stop.name, np.full(len(objective), fill), np.full(rows, fill), 0.0)

    honest = bounding.solve
    monkeypatch.setattr(bounding, "solve", failing)
    found = identify(MODEL, data_of(y=0.1 * Y), 1.0, order=1, rounds=1)
    for interval, parameter in zip(found.intervals, MODEL.parameters, strict=True):
        # The prior box is all there is, or an end that is true all the same.
        assert interval.lower == parameter.lower or interval.lower <= interval.inner_lower
        assert interval.upper == parameter.upper or interval.upper >= interval.inner_upper
        if interval.lower == parameter.lower:
            assert interval.proof_lower is Proof.BOX
