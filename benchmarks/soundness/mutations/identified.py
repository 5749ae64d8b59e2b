"""Genuine certificates of small records: what ``identify(certificate=...)`` writes, pared to a few dozen kilobytes.

Paring leaves out bounds that nothing else in the file rests on: a part of a proof is a proof of less.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from contextlib import suppress
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import sympy

from benchmarks.records import errors_in_variables, hammerstein, output_error
from benchmarks.soundness.mixed_problems import INPUT_SHARE, mixed_problem
from benchmarks.soundness.piecewise_problems import piecewise_problem
from relaxations import check
from smid import Dataset, EmptyFeasibleSetError, Model, OutputError, Parameter, identify

__all__ = ["RECIPES"]

LARGEST = 45_000  # bytes


def smooth(make: Callable[..., Any], path: Path, n: int, share: float = 1.0, **settings: Any) -> tuple[float, ...]:
    """Write the proof for a record; a small share of its noise bound leaves nothing."""
    known = make(n)
    bounds = {channel: share * bound for channel, bound in known.noise_bound.items()}
    _identified(known.model, known.data, bounds, path, **settings)
    return known.truth


def piecewise(kind: str, path: Path, n: int, share: float = 0.3) -> tuple[float, ...]:
    known = piecewise_problem(kind, 4, n, share=share)
    _identified(known.model, known.data, {"y": known.noise_bound}, path, tolerance=0.5, order=1, rounds=1)
    return _ordered(known.model, known.truth)


def mixed(kind: str, path: Path, n: int) -> tuple[float, ...]:
    known = mixed_problem(kind, 4, n, share=0.3)
    bounds = {"y": known.noise_bound} | ({"u": INPUT_SHARE} if kind.startswith("errors") else {})
    _identified(known.model, known.data, bounds, path, tolerance=0.5, order=1, rounds=1)
    return _ordered(known.model, known.truth)


def rectified(path: Path, outlier: float = 0.0) -> tuple[float, ...]:
    """Write the proof for a gain of no known size behind a threshold."""
    n = 8
    u = 0.3 + 0.6 * np.sin(1.3 * np.arange(n))
    y = np.zeros(n)
    for k in range(1, n):
        y[k] = 0.6 * y[k - 1] + 1.1 * max(0.0, u[k - 1] - 0.2)
    y[n - 2] += outlier
    d = Parameter("d", 0, 0.5)
    model = OutputError(stable=True).insert_before("u", lambda x: sympy.Max(0, x - d.symbol), parameters=[d])
    data = Dataset.from_arrays(input={"u": u}, output={"y": y}, sampling_time=1.0)
    _identified(model, data, {"y": 0.05}, path, tolerance=0.5, order=1, rounds=1)
    return _ordered(model, {"a1": -0.6, "b0": 1.1, "d": 0.2})


def _ordered(model: Model, truth: dict[str, float]) -> tuple[float, ...]:
    return tuple(truth[parameter.name] for parameter in model.parameters)


def _identified(model: Model, data: Dataset, bounds: dict[str, float], path: Path, **settings: Any) -> None:
    with suppress(EmptyFeasibleSetError):
        identify(model, data, bounds, certificate=path, **settings)
    path.write_text(json.dumps(pared(check.read(path)), separators=(",", ":")) + "\n", encoding="utf-8")


def pared(document: Any) -> Any:
    """Leave out steps as long as the file is large and what is left is accepted, and empty if it was."""
    empty = any(theorem.empty for theorem in check.check(document))
    for node, at in reversed(list(_removable(document["steps"]))):
        if len(json.dumps(document, separators=(",", ":"))) <= LARGEST:
            break
        step = node.pop(at)
        try:
            kept = any(theorem.empty for theorem in check.check(document)) == empty
        except (check.Refused, check.Unreadable):
            kept = False
        if not kept:
            node.insert(at, step)
    return document


def _removable(steps: list[Any], first: int = 0) -> Any:
    """Yield lists and places, what is outside before what it holds; one step of each list stays."""
    for at, step in enumerate(steps):
        if at >= 1 - first:
            yield steps, at
        inner = [step, *step.get("parts", []), *step.get("reach", {}).get("faces", [])]
        for holder in inner:
            if "steps" in holder:
                yield from _removable(holder["steps"])


RECIPES: dict[str, Callable[[Path], tuple[float, ...]]] = {
    "output error": partial(smooth, output_error, n=6, rounds=1, order=1),
    "output error, cuts": partial(smooth, output_error, n=6, method="benders", tolerance=0.5),
    "output error, empty": partial(smooth, output_error, n=6, share=0.1, rounds=1),
    "output error, empty by cuts": partial(smooth, output_error, n=6, share=0.1, method="benders"),
    "Hammerstein": partial(smooth, hammerstein, n=7, rounds=1, order=1),
    "errors in variables": partial(smooth, partial(errors_in_variables, poles=1), n=5, rounds=1, order=1),
    "dead zone": partial(piecewise, "dead zone", n=5),
    "saturation": partial(piecewise, "saturation", n=5),
    "coulomb": partial(piecewise, "coulomb", n=6),
    "relay": partial(mixed, "relay", n=6),
    "errors in variables, dead zone": partial(mixed, "errors in variables, dead zone", n=5),
    "rectified gain": rectified,
    "rectified gain, empty": partial(rectified, outlier=1.0),
}
