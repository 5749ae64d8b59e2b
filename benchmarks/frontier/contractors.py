"""Inversion of the free run beside the contractors of codac, on first-principles models.

codac's forward-backward contractors state each step of a model in interval arithmetic. A fixpoint runs through the
record, forwards and backwards, over the box of the parameters and a box of the states at each sample. Only parameters
are cut. codac is given the prior, the noise bound, the cuts of :mod:`smid.identification.inversion.cover`, and the
verified points that `identify` found, so only boxes that reach beyond these are cut. A box takes over the states of the
one that it was cut from.
"""

from __future__ import annotations

import heapq
import math
import tempfile
import time
from collections.abc import Iterator
from dataclasses import dataclass
from importlib.metadata import version
from itertools import count
from pathlib import Path
from typing import Any

import codac
import numpy as np

from benchmarks.frontier.first_principles import Plant, plants
from relaxations.algebra.arrays import Array
from relaxations.search.enclosure import Reason
from smid import Dataset, identify
from smid.identification.estimate import Estimate
from smid.verification import verify

SECONDS, BOXES, TOLERANCE = 120.0, 20_000, 1e-2
AWAY = 10
"""Widths between the truth and a point that is to be excluded."""

_SWEEPS = 20  # forwards and backwards, for one box
_RATIO = 0.1  # another sweep only where the last took this share of a parameter's width; codac's own default
_OUTER = 0.5  # as in the cover of the inversion
_ROUNDING = 1e-9  # the sampled values and the step are stated in floating point


def _pendulum(p: Any, z: Any, after: Any, u: float) -> list[Any]:
    speed = z[0] * (1 - 0.05 * p[1]) + 0.05 * (u - p[0] * codac.sin(z[1]))
    return [after[0] - speed, after[1] - z[1] - 0.05 * after[0]]


def _arrhenius(p: Any, z: Any, after: Any, u: float) -> list[Any]:
    return [after[0] - z[0] * (1 - p[0]) - p[0] * u - p[1] * codac.exp(-p[2] / z[0])]


def _reactor(p: Any, z: Any, after: Any, u: float) -> list[Any]:
    # The state is the logarithm of the level: codac 2.1.2 crashes in log.
    power = codac.exp(p[2] * z[0])
    return [codac.exp(after[0]) - codac.exp(z[0]) - 0.5 * ((u - p[1] * power) / p[0] - 0.12 * u)]


def _angle(low: float, high: float) -> list[list[float]]:
    return [[-20.0, 20.0], [low, high]]


def _itself(low: float, high: float) -> list[list[float]]:
    return [[low, high]]


def _logarithm(low: float, high: float) -> list[list[float]]:
    return [[math.log(low) - _ROUNDING, math.log(high) + _ROUNDING]]


CASES = {
    "pendulum from its angle": (_pendulum, _angle),
    "Arrhenius reactor": (_arrhenius, _itself),
    "reactor with unknown order": (_reactor, _logarithm),
}
"""What is zero at each step, where interval arithmetic meets each unknown as seldom as possible; the states' box."""


@dataclass(frozen=True)
class Paved:
    """What codac found: the hull of its boxes, shape (p, 2), how many it contracted, and whether none is left."""

    hull: Array
    boxes: int
    seconds: float
    done: bool


class Steps:
    """A record as a chain of contractors, one for each step."""

    def __init__(self, name: str, plant: Plant, data: Dataset) -> None:
        step, states = CASES[name]
        values = data.experiments[0].values
        margin = plant.bound + _ROUNDING
        self.states = [codac.IntervalVector(states(y - margin, y + margin)) for y in values["y"].tolist()]
        p, size = codac.VectorVar(len(plant.truth)), self.states[0].size()
        before, after = codac.VectorVar(size), codac.VectorVar(size)
        zero = codac.Interval(-_ROUNDING, _ROUNDING)
        # No centred form: it took three times as long, and contracted no box of these models further.
        self.steps = [
            [
                codac.CtcInverse(codac.AnalyticFunction([p, before, after], line), zero, False)
                for line in step(p, before, after, u)
            ]
            for u in values["u"].tolist()[:-1]
        ]

    def contracted(self, box: Any, states: list[Any]) -> tuple[Any, list[Any]]:
        """Return what is left of a box of parameters, and of the states; the box is empty where nothing is."""
        box, states = codac.IntervalVector(box), [codac.IntervalVector(z) for z in states]
        order = range(len(self.steps))
        for _ in range(_SWEEPS):
            before = np.array([side.diam() for side in box])
            for times in (order, reversed(order)):
                for t in times:
                    for contractor in self.steps[t]:
                        contractor.contract(box, states[t], states[t + 1])
                    if box.is_empty() or states[t].is_empty() or states[t + 1].is_empty():
                        return codac.IntervalVector.empty(box.size()), states
            if np.all(np.array([side.diam() for side in box]) >= (1 - _RATIO) * before):
                break
        return box, states

    def exclude(self, point: Array) -> bool:
        """Return whether the contractors prove that a point of the parameters does not fit."""
        box = codac.IntervalVector(np.column_stack([point, point]).tolist())
        return bool(self.contracted(box, self.states)[0].is_empty())


def pave(steps: Steps, prior: Array, inner: Array) -> Paved:
    """Contract and cut boxes until none reaches beyond the verified points, or a limit; ends have shape (p, 2)."""
    began, number, boxes = time.process_time(), count(), 0
    waiting: list[tuple[float, int, Any, list[Any]]] = []
    closed: list[Array] = []

    def put(box: Any, states: list[Any]) -> None:
        ends = _ends(box)
        reach = _beyond(ends, inner).max()
        # A box as small as the tolerance is not cut either, though it is not decided.
        if reach <= TOLERANCE or np.all(_width(ends) <= TOLERANCE * _width(inner)):
            closed.append(ends)
        else:
            heapq.heappush(waiting, (-reach, next(number), box, states))

    put(codac.IntervalVector(prior.tolist()), steps.states)
    while waiting and boxes < BOXES and time.process_time() - began < SECONDS:
        box, states = steps.contracted(*heapq.heappop(waiting)[2:])
        boxes += 1
        if box.is_empty():
            continue
        ends = _ends(box)
        for low, high in _parts(ends, inner):
            put(codac.IntervalVector(np.column_stack([low, high]).tolist()), states)
    left = np.array([*closed, *(_ends(box) for _, _, box, _ in waiting)])
    hull = np.column_stack([left[..., 0].min(axis=0), left[..., 1].max(axis=0)])
    return Paved(hull, boxes, time.process_time() - began, not waiting)


def _parts(ends: Array, inner: Array) -> Iterator[tuple[Array, Array]]:
    """Yield the two parts of a box: what lies beyond the verified points if that is small, or halves."""
    beyond = _beyond(ends, inner)
    k, side = np.unravel_index(int(np.argmax(beyond)), beyond.shape)
    value = inner[k, side]
    if beyond[k, side] <= TOLERANCE:
        yield ends[:, 0], ends[:, 1]
        return
    if abs(value - ends[k, side]) > _OUTER * _width(ends)[k]:
        k = int(np.argmax(_width(ends) / _width(inner)))
        value = ends[k].mean()
    for part in (0, 1):
        cut = ends.copy()
        cut[k, 1 - part] = value
        yield cut[:, 0], cut[:, 1]


def run() -> str:
    """Return the table as Markdown."""
    rows = []
    for name in CASES:
        plant = plants()[name]
        data = plant.record(0)
        own, seconds = _timed(plant, data, certificate=None)
        names = [p.name for p in plant.model.parameters]
        prior = np.array([[p.lower, p.upper] for p in plant.model.parameters])
        inner = np.array([[own[k].inner_lower, own[k].inner_upper] for k in names])
        outer = np.array([[own[k].lower, own[k].upper] for k in names])
        steps, truth = Steps(name, plant, data), np.array([plant.truth[k] for k in names])
        rival, away = pave(steps, prior, inner), truth.copy()
        away[0] += AWAY * _width(inner)[0]
        apart = ["yes" if out else "no" for out in (away[0] > outer[0, 1], steps.exclude(away))]
        boxes = own.enclosure.solves
        end = "yes" if own.reason is Reason.TIGHT else "no"
        proof = _certificate(plant, data)
        ended, least = ("yes", "") if rival.done else ("no", "at least ")
        rows += [
            f"| {name} | smid | {boxes} | {seconds:.1f} | {end} | {_sizes(names, outer, inner, truth)} "
            f"| {apart[0]} | {proof} |",
            f"| | codac | {rival.boxes}, {least}{rival.boxes / boxes:.0f} times as many | {rival.seconds:.1f} "
            f"| {ended} | {_sizes(names, rival.hull, inner, truth)} | {apart[1]} | none |",
        ]
        print(*rows[-2:], sep="\n", flush=True)
    return "\n".join(
        [
            "## First-principles models, beside the contractors of codac",
            "",
            "One record of 200 samples for each model; prior and noise bound are those of the section on "
            f"first-principles models. codac {version('codac')}: forward-backward contractors of each step, with boxes "
            "of the states at each sample, repeated to a fixpoint; only parameters are cut. Both cut the box that "
            f"reaches furthest beyond verified points, until none reaches further than {TOLERANCE:.0%} of their width. "
            f"codac is given the verified points of smid, and at most {SECONDS:g} s of processor time and {BOXES} "
            "boxes. A box counts once for "
            "codac, however often its contractors run; for smid each contraction counts.",
            "",
            "Hull: its width over the width of the verified points. Point: the truth, with its first parameter raised "
            f"by {AWAY} widths of the verified points; a tool that does not exclude it cannot finish by cutting "
            "parameters alone. The seconds of codac include the loop over the samples in Python.",
            "",
            "| model | tool | boxes | s | finished | hull | truth inside | point excluded | certificate |",
            "|---|---|---|---|---|---|---|---|---|",
            *rows,
        ]
    )


def _timed(plant: Plant, data: Dataset, certificate: Path | None) -> tuple[Estimate, float]:
    """Return the estimate of smid, and its seconds."""
    began = time.process_time()
    settings = {"method": "inversion", "tolerance": TOLERANCE, "seconds": SECONDS, "certificate": certificate}
    return identify(plant.model, data, plant.bound, **settings), time.process_time() - began


def _certificate(plant: Plant, data: Dataset) -> str:
    """Write the certificate, and return what the checker says."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "proof.json"
        _, seconds = _timed(plant, data, file)
        if not file.exists():
            return "none"
        verify(file, data, plant.model)
        return f"verified; {seconds:.1f} s with its search"


def _sizes(names: list[str], hull: Array, inner: Array, truth: Array) -> str:
    """Return two cells: the size of the hull, and whether the truth lies inside."""
    widths = ", ".join(f"{k} {share:.3g}" for k, share in zip(names, np.ptp(hull, axis=1) / _width(inner), strict=True))
    inside = np.all((hull[:, 0] <= truth) & (truth <= hull[:, 1]))
    return f"{widths} | {'yes' if inside else 'no'}"


def _width(ends: Array) -> Array:
    return ends[:, 1] - ends[:, 0]


def _ends(box: Any) -> Array:
    """Return the ends of a box, shape (p, 2)."""
    return np.array([[side.lb(), side.ub()] for side in box])


def _beyond(ends: Array, inner: Array) -> Array:
    """Return how far a box reaches beyond the verified points, in widths; shape (p, 2)."""
    return np.column_stack([inner[:, 0] - ends[:, 0], ends[:, 1] - inner[:, 1]]) / _width(inner)[:, None]
