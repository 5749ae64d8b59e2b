"""First-principles models that are no polynomials: intervals of all their parameters by inversion of the free run.

Each plant is simulated with its own model, a staircase as input, and uniform noise. Of most, states are hidden. The
arm is discretised by one Euler step for each sample. Each result is kept at once (:mod:`benchmarks.resumable`); delete
the cache when the inversion has changed.
"""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from benchmarks.processor_time import in_processor_time
from benchmarks.resumable import kept
from benchmarks.resumable import run as kept_run
from smid import Dataset, OwnModel, identify
from smid.models import Model, Reactor, RotatingArm
from smid.models.simulate import simulate

SECONDS, TOLERANCE = 120.0, 1e-2
CACHE = Path(".cache/first_principles.jsonl")


@dataclass(frozen=True)
class Plant:
    """A model, the truth, the levels of its input, how long each holds, the noise bound, and how many records."""

    model: Model
    truth: Mapping[str, float]
    start: Mapping[str, float]
    samples: int
    levels: tuple[float, float]
    hold: int
    bound: float
    told: tuple[str, ...]
    records: int

    def record(self, seed: int) -> Dataset:
        """Return a noisy record."""
        rng = np.random.default_rng(seed)
        u = np.repeat(rng.uniform(*self.levels, self.samples // self.hold + 1), self.hold)[: self.samples]
        start = {name: [value] for name, value in self.start.items()}
        clean = simulate(self.model, {"u": u}, {**self.model.values, **self.truth}, start)["y"]
        step = self.model.sampling_time or 1.0
        noisy = clean + rng.uniform(-self.bound, self.bound, self.samples)
        return Dataset.from_arrays(input={"u": u}, output={"y": noisy}, sampling_time=step)


def plants() -> dict[str, Plant]:
    """Return the plants; ``told`` are the parameters that the record determines."""
    tanks = OwnModel(
        ["g[t] = g[t-1] + k*u[t-1] - c*sqrt(g[t-1])", "h[t] = h[t-1] + c*sqrt(g[t-1]) - d*sqrt(h[t-1])"],
        {"y": "h"},
        ["u"],
        {"k": (0.01, 1), "c": (0.01, 1), "d": (0.01, 1)},
    ).bound(g=(0, 20))
    pendulum = OwnModel(
        ["v[t] = v[t-1] + 0.05*(u[t-1] - g*sin(x[t-1]) - d*v[t-1])", "x[t] = x[t-1] + 0.05*v[t]"],
        {"y": "x"},
        ["u"],
        {"g": (1, 20), "d": (0, 2)},
    ).bound(v=(-20, 20))
    arrhenius = OwnModel(
        ["x[t] = x[t-1] + a*(u[t-1] - x[t-1]) + b*exp(-g/x[t-1])"],
        {"y": "x"},
        ["u"],
        {"a": (0.01, 0.9), "b": (0.1, 10), "g": (0.5, 5)},
    )
    friction = OwnModel(
        ["v[t] = v[t-1] + 0.05*(u[t-1] - k*x[t-1] - d*v[t-1] - c*sign(v[t-1]))", "x[t] = x[t-1] + 0.05*v[t]"],
        {"y": "x"},
        ["u"],
        {"k": (1, 50), "d": (0, 5), "c": (0, 5)},
    ).bound(v=(-20, 20))
    reactor = Reactor(None, None, None, scheme="euler", sampling_time=0.5)
    arm = RotatingArm(friction=True, drag=True, scheme="euler", sampling_time=0.02)
    arm = arm.bound(theta=(1, 1000), b=(0, 1), Wd=(0, 10), Ws=(0, 10), speed=(-300, 300))
    return {
        "two tanks, the second measured": Plant(
            tanks, {"k": 0.2, "c": 0.15, "d": 0.12}, {"g": 3, "h": 4}, 200, (0.5, 2.0), 12, 0.02, ("k", "c", "d"), 10
        ),
        "pendulum from its angle": Plant(
            pendulum, {"g": 9.81, "d": 0.3}, {"x": 0.3, "v": 0}, 200, (-4, 4), 12, 0.01, ("g", "d"), 100
        ),
        "Arrhenius reactor": Plant(
            arrhenius, {"a": 0.3, "b": 1.0, "g": 2.0}, {"x": 1.0}, 200, (0.8, 2.0), 8, 0.01, ("a", "b", "g"), 100
        ),
        "reactor with unknown order": Plant(
            reactor, {"tau": 2.0, "a": 1.5, "x": 1.7}, {"w": 0.3}, 200, (0.2, 0.9), 6, 0.005, ("tau", "a", "x"), 100
        ),
        "spring with Coulomb friction, from its position": Plant(
            friction, {"k": 10, "d": 0.8, "c": 0.5}, {"x": 0.3, "v": 0.1}, 200, (-8, 8), 15, 0.01, ("k", "d", "c"), 10
        ),
        "rotating arm from its angle": Plant(
            arm,
            {"theta": 21.7391, "b": 0.0027, "Wd": 0.43, "Ws": 1.2},
            {"angle": 0, "speed": 0},
            600,
            (-2.0, 2.0),
            40,
            0.002,
            ("theta", "b", "Wd"),
            10,
        ),
    }


@dataclass(frozen=True)
class Found:
    """What is proven of one record.

    Attributes
    ----------
    intervals : dict
        By parameter: ends, and those of the verified points; NaN where there are none.
    """

    plant: str
    seed: int
    intervals: dict[str, tuple[float, float, float, float]]
    seconds: float

    def inside(self, truth: Mapping[str, float]) -> bool:
        """Whether all true values lie in their intervals."""
        return all(self.intervals[name][0] <= value <= self.intervals[name][1] for name, value in truth.items())

    def excess(self, name: str) -> float:
        """How far an interval may be too wide at an end, as a share of what is verified."""
        lower, upper, inner_lower, inner_upper = self.intervals[name]
        inner = inner_upper - inner_lower
        return (upper - lower - inner) / (2 * inner) if inner > 0 else np.inf

    def share(self, name: str, truth: float) -> float:
        """Return the width of an interval, as a share of the true value."""
        lower, upper, *_ = self.intervals[name]
        return (upper - lower) / abs(truth)


def identified(name: str, seed: int) -> Found:
    """Identify a plant from one record, within `SECONDS` of processor time."""
    plant, began = plants()[name], time.process_time()
    with in_processor_time():
        found = identify(
            plant.model, plant.record(seed), plant.bound, method="inversion", tolerance=TOLERANCE, seconds=SECONDS
        )
    ends = {k: (found[k].lower, found[k].upper, found[k].inner_lower, found[k].inner_upper) for k in plant.truth}
    return Found(name, seed, ends, time.process_time() - began)


def run() -> str:
    """Return the table as Markdown."""
    known = {(entry["plant"], entry["seed"]): Found(**entry) for entry in kept(CACHE)}
    cases = [(name, seed) for name, plant in plants().items() for seed in range(plant.records)]
    for one in kept_run(CACHE, identified, [case for case in cases if case not in known], 1):
        known[one.plant, one.seed] = one
        print(one, flush=True)
    return section([known[case] for case in cases])


def section(results: list[Found]) -> str:
    """Return the section of some results."""
    rows = []
    for name, plant in plants().items():
        found = [one for one in results if one.plant == name]
        if not found:
            continue
        inside = sum(one.inside(plant.truth) for one in found)
        tight = sum(all(one.excess(k) <= TOLERANCE * 1.01 for k in plant.told) for one in found)
        near = sum(all(one.excess(k) <= 1 for k in plant.told) for one in found)
        widths = [f"{k} {100 * np.median([one.share(k, plant.truth[k]) for one in found]):.3g} %" for k in plant.told]
        seconds = [one.seconds for one in found]
        rows.append(
            f"| {name} | {plant.samples} | {plant.bound:g} | {inside} of {len(found)} | {tight} | {near} "
            f"| {', '.join(widths)} | {np.median(seconds):.1f} | {max(seconds):.1f} |"
        )
    return "\n".join(
        [
            "## First-principles models",
            "",
            f"Certified intervals of all parameters through `identify`, at most {SECONDS:g} s of processor time for a "
            f"record. Tight: all intervals end within {TOLERANCE:.0%} of their width of a verified point; near: within "
            "their width; but for the static friction of the arm, which these records do not determine. The prior "
            "boxes span factors of 20 to 1000. Widths are medians, as shares of the true value; seconds are those of "
            "the processor.",
            "",
            "| plant | samples | noise bound | truth inside | tight | near | widths | median s | most s |",
            "|---|---|---|---|---|---|---|---|---|",
            *rows,
        ]
    )
