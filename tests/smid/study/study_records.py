"""A small record and a small study, quick enough to run many times."""

from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from relaxations.proof import Lift
from smid import Dataset, OutputError

TRUTH = {"a1": -0.7, "b0": 0.5}
MODEL = OutputError(na=1, stable=True)
QUICK = {"tolerance": 0.5, "rounds": 1}
"""Loose intervals: proven like any other, in a fraction of the time."""


@dataclass(frozen=True)
class OwnLift:
    """A method of the user: the lift under another name, with a field of its own."""

    share: float
    name: ClassVar[str] = "own lift"
    order: ClassVar[None] = None

    def orders(self, problem):
        return Lift().orders(problem)

    def check(self, problem, order):
        Lift().check(problem, order)

    def build(self, problem, order, objective, steps):
        return Lift().build(problem, order, objective, steps)


def record(seed, count=8):
    """Return a first-order plant's samples with noise within 0.1 bar."""
    random = np.random.default_rng(seed)
    u = random.choice([-1.0, 1.0], count)
    w = np.zeros(count)
    for k in range(1, count):
        w[k] = -TRUTH["a1"] * w[k - 1] + TRUTH["b0"] * u[k - 1]
    y = w + random.uniform(-0.1, 0.1, count)
    units = {"u": "V", "y": "bar"}
    return Dataset.from_arrays(input={"u": u}, output={"y": y}, sampling_time=0.1, units=units)


def proven(study):
    """Return what a study proves, without what it took."""
    return {cell: replace(o, seconds=0.0, peak_memory=0.0) for cell, o in study.done}
