"""Motions of embedded arms and outputs of their neurons, beside the plant's: figures F.4, F.5, F.8, F.9 and F.13.

Reference: hybrid thesis, appendix F.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from relaxations.algebra.arrays import Array
from smid.hybrid.hybrid_model import HybridModel
from smid.signals import TABLE_F1
from smid.theses.hybrid.arm.embedded_arm import SPEED_UNIT, TORQUE_UNIT, embedded_arm, embedded_error
from smid.theses.hybrid.arm.embedded_study import WAYS, EmbeddedStudy
from smid.theses.hybrid.arm.records import SAMPLING_TIME, held_record, other_kind

__all__ = ["Trace", "arm_traces", "examples"]


@dataclass(frozen=True, eq=False)
class Trace:
    """One embedded arm.

    Parameters
    ----------
    motions
        By record: time in s, the plant's angle and the model's in rad, shape (n,) each.
    speed
        Shape (m,). In rad/s, over those of the record.
    neurons
        Shape (k, m). Torque of each neuron in Nm.
    network
        Shape (m,). Torque of all neurons and the offset in Nm.

    Examples
    --------
    >>> hybrid = embedded_arm((1,))
    >>> found = arm_traces(hybrid, np.array([1.0, 1.0, 0.0, 0.5, 0.1]), "one_sine")
    >>> found.neurons.shape == (1, found.speed.size)
    True
    """

    motions: Mapping[str, tuple[Array, Array, Array]]
    speed: Array
    neurons: Array
    network: Array


def arm_traces(hybrid: HybridModel, point: Array, input: str) -> Trace:
    """Return the runs of an embedded arm over an input and a voltage of another kind, and its neurons.

    Parameters
    ----------
    hybrid
        From `embedded_arm`, with one hidden layer.
    point
        Shape (p,). As `embedded_error` has it.
    input
        From `smid.signals.TABLE_F1`.

    Examples
    --------
    >>> list(arm_traces(embedded_arm((1,)), np.array([1.0, 1.0, 0.0, 0.5, 0.1]), "one_sine").motions)
    ['one sine', 'another kind']
    """
    sines = TABLE_F1[input]
    records = {input.replace("_", " "): held_record(sines), "another kind": held_record(other_kind(sines))}
    motions: dict[str, tuple[Array, Array, Array]] = {}
    for name, record in records.items():
        y = record.values("y")
        error: Array = embedded_error(hybrid, record).runs(point[None]).residuals[0]
        motions[name] = np.asarray(SAMPLING_TIME * np.arange(y.size), dtype=np.float64), y, y + error
    visited = next(iter(records.values())).values("speed")
    speed = np.linspace(visited.min(), visited.max(), 2001)
    slope, bias, output = point[1:-1].reshape(3, -1)
    neurons = TORQUE_UNIT * output[:, None] * np.tanh(slope[:, None] * speed / SPEED_UNIT + bias[:, None])
    return Trace(motions, speed, neurons, neurons.sum(axis=0) + TORQUE_UNIT * point[-1])


def examples(study: EmbeddedStudy, input: str) -> dict[str, Trace]:
    """Return the first good, moderate and bad run that stays finite on an input, as far as there are such.

    Examples
    --------
    >>> from smid.theses.hybrid.arm.embedded_study import embedded_study
    >>> list(examples(embedded_study(["one_sine"], ["small"], starts=1), "one_sine"))
    ['bad: thesis, weights 0 to 0.01']
    """
    found: dict[str, Trace] = {}
    for kind in ("good", "moderate", "bad"):
        for runs in (runs for runs in study.runs if runs.input == input):
            of_kind = {"good": runs.good, "bad": runs.bad, "moderate": ~(runs.good | runs.bad)}[kind]
            finite = np.flatnonzero(of_kind & np.isfinite(runs.validation).all(axis=1))
            if finite.size:
                way = WAYS[runs.way]
                hybrid = embedded_arm((way.hidden,), scheme=way.scheme, substeps=way.substeps)
                found[f"{kind}: {way.label}"] = arm_traces(hybrid, runs.points[finite[0]], input)
                break
    return found
