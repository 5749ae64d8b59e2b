"""Certified intervals of the rotating arm's constants, from bounded errors of its angle and without a start value.

The feasible set: all 1/J, b, Wd, Ws for which some motion of (5.7)-(5.8) stays within the noise bound of every measured
angle. For known speeds the law is linear in 1/J, b/J, Wd/J and Ws/J; friction is a sign and a dead zone of the speed.
Two steps alternate, and each removes only what is proven infeasible:

1. The box of the constants bounds the speeds (`smid.theses.hybrid.certified.speeds`). At almost all samples the bounds
   determine the direction, and whether the arm glides or sticks.
2. The speeds give linear inequalities (`smid.theses.hybrid.certified.relations`). Linear programs bound the constants.
   Their multipliers certify the bounds, whatever the solver returns (`relaxations.proof.certificate`).

When the box no longer shrinks and the ends of 1/J or b differ by more than a factor of 1.5, its interval is halved. A
part that is proven empty is dropped. The result is the hull of the remaining parts.

All operations round outwards, and the law is integrated exactly, without a step size. Assumptions: the law itself, its
torque per volt c and its eps, an input held between samples, and Ws >= Wd.

Reference: hybrid thesis, (5.7)-(5.9) and section 7.4 ("an optimisation method that can handle local minima").
"""

from __future__ import annotations

import time
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from relaxations.algebra.intervals import Intervals
from relaxations.deadline import Progress
from smid.data import DataError, Dataset
from smid.display.result import Part, Tabular
from smid.display.table import Table
from smid.models.rotating_arm import DRAG, FRICTION, MOTOR
from smid.theses.hybrid.certified.box import CONSTANTS, PRIOR, ArmBox
from smid.theses.hybrid.certified.contraction import contracted, quotient, relaxed_problem
from smid.theses.hybrid.certified.relations import arm_problem
from smid.theses.hybrid.certified.speeds import ArmRecord, enclose_speeds

__all__ = ["CertifiedArm", "certify_arm"]

ROUNDS = 30
WORTH = 0.02  # least relative reduction of a width for another round
COARSE = 1.5  # theta and b are halved while their ends differ by more than this factor
MOST_PARTS = 120
UNITS = {name: unit for name, (_, unit) in (MOTOR | DRAG | FRICTION).items()}


@dataclass(frozen=True, eq=False, repr=False)
class CertifiedArm(Tabular):
    """Intervals that contain the constants of every arm that explains the angles.

    Parameters
    ----------
    intervals
        theta (1/J) in 1/(kg m2), b in Nm s2/rad2, Wd and Ws in Nm.
    prior
        Intervals of the search.
    speeds
        Shape (n,). Interval of the speed at each sample, in rad/s.
    noise_bound
        In rad.
    parts, rounds
        Number of boxes, and of contractions, each with eight linear programs.
    """

    intervals: Mapping[str, tuple[float, float]]
    prior: Mapping[str, tuple[float, float]]
    speeds: Intervals
    noise_bound: float
    parts: int
    rounds: int
    seconds: float

    def centre(self, name: str) -> float:
        """Return the centre of a constant's interval."""
        low, high = self.intervals[name]
        return 0.5 * (low + high)

    def relative_width(self, name: str) -> float:
        """Return the width of a constant's interval relative to its centre."""
        low, high = self.intervals[name]
        return (high - low) / self.centre(name)

    def holds(self, values: Mapping[str, float]) -> bool:
        """Tell whether all the given constants lie inside."""
        return all(low <= values[name] <= high for name, (low, high) in self.intervals.items())

    def determined(self, name: str) -> bool:
        """Tell whether the constant is proven within a factor of two.

        The intervals are outer ones: the data may determine a constant better than is proven here.
        """
        low, high = self.intervals[name]
        return low > 0 and high <= 2 * low

    @property
    def table(self) -> Table:
        """Return a row for each constant."""
        return Table(
            f"Certified intervals of the arm, |noise| <= {self.noise_bound:g} rad",
            ("constant", "lower", "upper", "width", "unit", "within a factor of two"),
            tuple(
                (
                    name,
                    f"{low:.6g}",
                    f"{high:.6g}",
                    f"{100 * self.relative_width(name):.3g}%",
                    UNITS[name],
                    self._verdict(name),
                )
                for name, (low, high) in self.intervals.items()
            ),
            "lrrrll",
        )

    def _content(self) -> Iterator[Part]:
        yield self.table
        yield f"{self.parts} parts, {self.rounds} rounds, {self.seconds:.1f} s"

    def _rows(self) -> Iterator[dict[str, Any]]:
        for name, (lower, upper) in self.intervals.items():
            yield {"constant": name, "lower": lower, "upper": upper, "unit": UNITS[name], "told": self.determined(name)}

    def _verdict(self, name: str) -> str:
        if self.intervals[name][1] >= self.prior[name][1]:
            return "no: as large as the prior allows"
        return "yes" if self.determined(name) else "no"

    def to_dict(self) -> dict[str, Any]:
        """Return plain data."""
        return {
            "noise_bound": self.noise_bound,
            "intervals": {
                name: {"lower": low, "upper": high, "unit": UNITS[name], "told": self.determined(name)}
                for name, (low, high) in self.intervals.items()
            },
            "prior": {name: list(ends) for name, ends in self.prior.items()},
            "parts": self.parts,
            "rounds": self.rounds,
            "seconds": self.seconds,
        }


def certify_arm(
    data: Dataset,
    noise_bound: float,
    *,
    prior: Mapping[str, tuple[float, float]] | None = None,
    c: float = MOTOR["c"][0],
    eps: float = FRICTION["eps"][0],
    progress: Progress | None = None,
) -> CertifiedArm:
    """Return certified intervals of the arm's constants.

    Parameters
    ----------
    data
        One experiment: the motor voltage in V, held between samples, and the angle in rad.
    noise_bound
        Largest error of a measured angle, in rad.
    prior
        Intervals that replace those of `PRIOR`.
    c
        Torque per volt, in Nm/V.
    eps
        Speed below which the arm sticks, in rad/s.

    Raises
    ------
    DataError
        If the record does not fit, or no arm explains it.
    ModelError
        If the prior is not valid.

    Examples
    --------
    >>> from smid.theses.hybrid import simulate_arm
    >>> from smid.signals import TABLE_F1
    >>> u = TABLE_F1["six_unequal"].signal(150, 0.02)
    >>> y = simulate_arm(u, 0.02) + 0.001 * np.sin(np.arange(150))
    >>> data = Dataset.from_arrays(input=u, output=y, sampling_time=0.02)
    >>> low, high = certify_arm(data, 0.001, prior={"theta": (10, 50)}).intervals["theta"]
    >>> 21 < low < 21.7391 < high < 23
    True
    """
    started = time.perf_counter()
    record = arm_record(data, noise_bound, c, eps)
    box = ArmBox.of(prior or {})
    nothing_known = Intervals.of(np.full(record.n_samples, -np.inf), np.full(record.n_samples, np.inf))
    # Contract boxes, and halve those that stay coarse.
    waiting, found = [_Part(box, nothing_known)], []
    parts = rounds = 0
    while waiting:
        part = waiting.pop()
        parts += 1
        result = _contract(record, part)
        rounds += result.rounds
        if result.part is None:
            continue
        part = result.part
        if progress:
            low, high = part.box.constants.lower[0], part.box.constants.upper[0]
            progress(f"1/J in [{low:.6g}, {high:.6g}], {len(waiting)} parts left")
        # Halve inertia and drag only: they determine the motion. Halving the frictions gains nothing.
        coarse = part.box.coarseness()[:2]
        if coarse.max() > COARSE and parts + len(waiting) < MOST_PARTS:
            waiting += [_Part(half, part.speeds) for half in part.box.halves(int(coarse.argmax()))]
        else:
            found.append(part)
    if not found:
        raise DataError(
            f"proven: no arm within the prior explains these angles within {noise_bound:g} rad. Raise the noise bound, "
            "widen the prior, or extend the law (smid.diagnose)"
        )
    # Bound the quotients once, at the end: each costs a linear program.
    finished = [_quotients(record, part) for part in found]
    lower = np.min([constants.lower for constants in finished], axis=0)
    upper = np.max([constants.upper for constants in finished], axis=0)
    speeds = found[0].speeds
    for part in found[1:]:
        speeds = speeds.hull(part.speeds)
    return CertifiedArm(
        dict(zip(CONSTANTS, zip(lower.tolist(), upper.tolist(), strict=True), strict=True)),
        dict(PRIOR) | dict(prior or {}),
        speeds,
        noise_bound,
        parts,
        rounds,
        time.perf_counter() - started,
    )


def arm_record(data: Dataset, noise_bound: float, c: float, eps: float) -> ArmRecord:
    """Return the record of one experiment, checked."""
    if len(data.experiments) != 1 or len(data.inputs) != 1 or len(data.outputs) != 1:
        raise DataError(
            f"{len(data.experiments)} experiments, {len(data.inputs)} inputs and {len(data.outputs)} outputs: give one "
            "experiment with the motor voltage and the angle"
        )
    if not (np.isfinite(noise_bound) and noise_bound > 0):
        raise DataError(f"the noise bound is {noise_bound}: give a positive number of rad")
    values = data.experiments[0].values
    voltage, angle = values[data.inputs[0]], values[data.outputs[0]]
    if len(angle) < len(CONSTANTS) + 3:
        raise DataError(f"{len(angle)} samples for {len(CONSTANTS)} constants: give at least {len(CONSTANTS) + 3}")
    if not (np.isfinite(angle).all() and np.isfinite(voltage).all()):
        raise DataError("the voltage or the angle has gaps: crop the record, or fill them")
    return ArmRecord(angle, Intervals.of(voltage[:-1]) * c, float(noise_bound), data.sampling_time, eps)


@dataclass(frozen=True)
class _Part:
    """A box of constants, and the speeds for constants in it."""

    box: ArmBox
    speeds: Intervals


@dataclass(frozen=True)
class _Contraction:
    """A contracted part, None if it is proven empty, and the number of rounds."""

    part: _Part | None
    rounds: int


def _contract(record: ArmRecord, part: _Part) -> _Contraction:
    """Bound speeds and constants by turns, until the box no longer shrinks."""
    box, speeds = part.box, part.speeds
    for k in range(1, ROUNDS + 1):
        speeds = enclose_speeds(record, box.products, speeds)
        if speeds.empty:
            return _Contraction(None, k)
        before = box.products.width
        found = contracted(relaxed_problem(arm_problem(record, box.products, speeds)), box.products)
        if found.empty:
            return _Contraction(None, k)
        # Stop when no width shrinks enough.
        box = box.with_products(found)
        if box.products.empty or box.constants.empty:
            return _Contraction(None, k)
        shrunk = 1 - box.products.width[before > 0] / before[before > 0]
        if shrunk.max(initial=0.0) < WORTH:
            break
    return _Contraction(_Part(box, speeds), k)


def _quotients(record: ArmRecord, part: _Part) -> Intervals:
    """Return the constants, with b, Wd and Ws bounded as quotients by theta."""
    relaxed = relaxed_problem(arm_problem(record, part.box.products, part.speeds))
    known, theta = part.box.constants, part.box.products[0]
    found = [known[0]] + [quotient(relaxed, j, theta, known[j]) for j in range(1, len(CONSTANTS))]
    return Intervals(np.array([e.lower for e in found]), np.array([e.upper for e in found]))
