"""One random case by its seed: a feasible set that holds a known truth, or one that is empty by construction.

Two constructions of an empty set:

- *outlier*: one output lies farther out than any parameters within their boxes can bring it from its predecessors.
  With stable poles ``|w_t| <= |w_{t-1}| + G`` (first order; ``2 |w_{t-1}| + |w_{t-2}| + G`` second), G what the input
  can add.
- *small bound*: the noise bound is a share of what :mod:`benchmarks.soundness.emptiness` proves necessary. A static
  nonlinearity of the input is any function there: the input takes a few levels, with a free value for each.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from benchmarks.soundness import curve_problems, hidden_problems, mixed_problems, piecewise_problems, random_problems
from benchmarks.soundness.emptiness import Record, least_noise_bound
from smid import Dataset, ErrorsInVariables, Hammerstein, Model, OutputError

SMOOTH, PIECEWISE, MIXED = random_problems.KINDS, piecewise_problems.KINDS, mixed_problems.KINDS
CURVES, HIDDEN = curve_problems.KINDS, hidden_problems.KINDS
SPOILT = ("output error 1", "hammerstein")
LONG = (*SMOOTH, "dead zone", "saturation")  # kinds that windows apply to
KINDS = (*SMOOTH, *PIECEWISE, *MIXED, *CURVES)
STATIC = ("dead zone", "two-sided dead zone", "saturation", "gap and limit", "relay", "hammerstein, hinge")
LEVELS = 4
BOX = 3.0


@dataclass(frozen=True)
class Case:
    """A model, its data and noise bounds.

    Parameters
    ----------
    kind : str
    construction : {"feasible", "outlier", "small bound"}
    model : Model
    data : Dataset
    noise_bound : dict channel -> float
    truth : dict
        The parameters that made the data: outside the set where that is empty.
    outliers : int
        So many outputs may break the bound.
    """

    kind: str
    construction: str
    model: Model
    data: Dataset
    noise_bound: dict[str, float]
    truth: dict[str, float]
    outliers: int = 0


def feasible_case(seed: int) -> Case:
    """Draw a set that holds the truth; with every other seed of a kind the noise sits on its bound."""
    return drawn(KINDS[seed % len(KINDS)], seed, 0)


def empty_case(seed: int) -> Case:
    """Draw a set without any point."""
    kind = KINDS[seed % len(KINDS)]
    if kind in CURVES:
        return _curve_outlier(seed, kind)
    if seed // len(KINDS) % 2 and (kind in SMOOTH or kind in STATIC):
        return _small_bound(_boxed(drawn(kind, seed, LEVELS)), seed)
    return _outlier(_boxed(drawn(kind, seed, 0)), seed)


def new_case(feasible: bool, seed: int) -> Case:
    """Draw a set for windows, of a noisy curve, of a hidden state or with outliers, in turn."""
    later = seed // 4
    if seed % 4 == 0:
        return _long(feasible, seed, LONG[later % len(LONG)])
    if seed % 4 == 1:
        kind = CURVES[later % len(CURVES)]
        return drawn(kind, seed, 0) if feasible else _curve_outlier(seed, kind)
    if seed % 4 == 2:
        return _hidden(feasible, seed, HIDDEN[later % len(HIDDEN)])
    return _with_outliers(feasible, seed, SPOILT[later % len(SPOILT)])


def _long(feasible: bool, seed: int, kind: str) -> Case:
    """Return a set with more than a hundred samples, which windows apply to."""
    n = int(np.random.default_rng([seed, 4]).integers(100, 200))
    if kind in PIECEWISE:
        found = piecewise_problems.piecewise_problem(kind, seed, n)
        case = Case(kind, "feasible", found.model, found.data, {"y": found.noise_bound}, found.truth)
    else:
        plain = random_problems.random_problem(seed, kind, n)
        case = Case(kind, "feasible", plain.model, plain.data, plain.noise_bound, plain.truth)
    return case if feasible else _outlier(_boxed(case), seed)


def _hidden(feasible: bool, seed: int, kind: str) -> Case:
    """Return a set of a model with a hidden state; an empty one has one output that no parameters reach."""
    plain = hidden_problems.hidden_problem(seed, kind)
    case = Case(kind, "feasible", plain.model, plain.data, plain.noise_bound, plain.truth)
    if feasible:
        return case
    rng, x = np.random.default_rng([seed, 2]), plain.data.values("x").copy()
    at = int(rng.integers(2, len(x)))
    x[at] = rng.choice([-1, 1]) * hidden_problems.farthest(plain, at) * (1 + rng.choice([0.01, 0.1, 1.0]))
    data = Dataset.from_arrays(
        input={"u": plain.data.values("u")}, output={"x": x}, sampling_time=plain.data.sampling_time
    )
    return replace(case, construction="outlier", data=data)


def _with_outliers(feasible: bool, seed: int, kind: str) -> Case:
    """Return a set in which as many outputs as are allowed break the bound, or, empty, one more."""
    rng, allowed = np.random.default_rng([seed, 6]), 1 + seed // 16 % 3
    plain = random_problems.random_problem(seed, kind, int(rng.integers(40, 81)))
    case = _boxed(Case(kind, "feasible", plain.model, plain.data, plain.noise_bound, plain.truth))
    outputs, place = case.data.values("y").copy(), np.arange(6, len(case.data.values("y")) - 6, 6)
    if feasible:  # of any size, from just beyond the bound
        for at in rng.choice(place, allowed, replace=False):
            outputs[at] += rng.choice([-1, 1]) * case.noise_bound["y"] * rng.choice([0.5, 3.0, 30.0])
    else:  # in disjoint stretches, none of which any parameters fit
        for at in rng.choice(place, allowed + 1, replace=False):
            outputs[at] = _out_of_reach(case, outputs, int(at), rng)
    construction = "feasible" if feasible else "outlier"
    return replace(case, construction=construction, data=_with_output(case.data, outputs), outliers=allowed)


def drawn(kind: str, seed: int, levels: int) -> Case:
    """Draw a feasible set of a kind; with ``levels`` a longer one, its input held to so many where it is static."""
    rng = np.random.default_rng([seed, 1])
    if kind in CURVES:
        curve = curve_problems.curve_problem(seed, kind)
        return Case(kind, "feasible", curve.model, curve.data, curve.noise_bound, curve.truth)
    if kind in SMOOTH:
        plain = random_problems.random_problem(
            seed, kind, int(rng.integers(10, 17 if kind == "output error 2" else 31))
        )
        return Case(kind, "feasible", plain.model, plain.data, plain.noise_bound, plain.truth)
    draw = piecewise_problems.piecewise_problem if kind in PIECEWISE else mixed_problems.mixed_problem
    n = int(rng.integers(16, 25)) if levels else int(rng.integers(8, 14))
    found = draw(kind, seed, n, seed // len(KINDS) % 2 == 1, float(rng.choice([0.02, 0.04, 0.1])), levels)
    bounds = {"y": found.noise_bound}
    if kind.startswith("errors in variables"):
        bounds["u"] = mixed_problems.INPUT_SHARE
    return Case(kind, "feasible", found.model, found.data, bounds, found.truth)


def _boxed(case: Case) -> Case:
    """Give the gains of the smooth models a box, without which an outlier proves nothing."""
    box = (-BOX, BOX)
    models = {
        "output error 1": lambda: OutputError(1, 0, stable=True, bounds={"b0": box}),
        "output error 2": lambda: OutputError(2, 1, stable=True, bounds={"b0": box, "b1": box}),
        "errors in variables": lambda: ErrorsInVariables(1, 0, stable=True, bounds={"b0": box}),
        "hammerstein": lambda: Hammerstein(1, (3, 1), stable=True, bounds={"gamma1": box, "gamma2": box}),
    }
    return replace(case, model=models[case.kind]()) if case.kind in models else case


def _outlier(case: Case, seed: int) -> Case:
    rng, y = np.random.default_rng([seed, 2]), case.data.values("y").copy()
    at = int(rng.integers(case.model.max_lag, len(y)))  # before that no equation reads it
    y[at] = _out_of_reach(case, y, at, rng)
    return replace(case, construction="outlier", data=_with_output(case.data, y))


def _out_of_reach(case: Case, y: np.ndarray, at: int, rng: np.random.Generator) -> float:
    """Return an output of a sample that no parameters in their boxes reach from the outputs before it."""
    bound = case.noise_bound["y"]
    top = float(np.abs(case.data.values("u")).max()) + case.noise_bound.get("u", 0.0)
    added = {
        "output error 2": 2 * BOX * top,
        "hammerstein": 2 * BOX * (top**3 + top),
        "hammerstein, hinge": 2 * (BOX * (top**3 + top) + 2 * top),  # the slope of the hinge is at most 2
        "relay": BOX,
        "coulomb": BOX * top + 1,  # the friction is at most 1
    }.get(case.kind, BOX * top)
    past = abs(y[at - 1]) + bound
    if case.kind == "output error 2":
        past = 2 * past + abs(y[at - 2]) + bound
    return float(rng.choice([-1, 1]) * (past + added + bound) * (1 + rng.choice([0.01, 0.1, 1.0])))


def _curve_outlier(seed: int, kind: str) -> Case:
    """Return a set of a noisy curve with one output farther out than its predecessor allows."""
    rng = np.random.default_rng([seed, 2])
    plain = curve_problems.curve_problem(seed, kind)
    y, at = plain.data.values("y").copy(), int(rng.integers(1, plain.data.n_samples))
    y[at] = rng.choice([-1, 1]) * curve_problems.farthest(plain, at) * (1 + rng.choice([0.01, 0.1, 1.0]))
    inputs = {name: plain.data.values(name) for name in plain.data.inputs}
    data = Dataset.from_arrays(input=inputs, output={"y": y}, sampling_time=1.0)
    return Case(kind, "outlier", plain.model, data, plain.noise_bound, plain.truth)


def _small_bound(case: Case, seed: int) -> Case:
    rng = np.random.default_rng([seed, 3])
    u, y = case.data.values("u"), case.data.values("y")
    if case.kind in STATIC:
        drives, record = (u[:, None] == np.unique(u)).astype(float), None
    elif case.kind == "hammerstein":
        drives, record = np.stack([u**3, u], axis=1), None
    else:
        drives, record = u[:, None], None
    late = np.vstack([np.zeros((1, drives.shape[1])), drives[:-1]])
    if case.kind == "errors in variables":
        record = Record(y, np.zeros((len(y), 0)), 1, u, case.noise_bound["u"], BOX)
    elif case.kind == "output error 2":
        later = np.vstack([np.zeros((1, 1)), late[:-1]])
        record = Record(y, np.hstack([late, later]), 2)
    else:
        record = Record(y, late)
    needed = least_noise_bound(record)
    if needed < 1e-3 * case.noise_bound["y"]:  # too short a record for this proof
        return _outlier(case, seed)
    share = float(rng.choice([0.5, 0.8, 0.95]))
    return replace(case, construction="small bound", noise_bound=case.noise_bound | {"y": share * needed})


def _with_output(data: Dataset, y: np.ndarray) -> Dataset:
    return Dataset.from_arrays(input={"u": data.values("u")}, output={"y": y}, sampling_time=1.0)
