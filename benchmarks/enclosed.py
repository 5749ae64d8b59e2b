"""What it costs to enclose a differential equation instead of its discretisation: processor time and radii.

    python -m benchmarks.enclosed

For a pendulum, the reactor of unknown order, and the arm with sticking friction: a run at one point, and the rows of a
box of 1 % around it. The radius is what the enclosure adds to the noise bound at the last sample, the reach is how much
the box moves the output there.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from relaxations.algebra.affine_arithmetic import RADIUS, SLOPES
from smid import Dataset, Model, OwnModel
from smid.display.table import Table
from smid.identification.inversion.record import Record
from smid.models import Reactor, RotatingArm
from smid.models.simulate import simulate
from smid.theses.hybrid.arm.exact_motion import ARM

NOISE_BOUND = 0.01
STEPS = {"rk4": (1, 20), "enclosed": (2, 4, 10, 20)}

PENDULUM = OwnModel(
    ["d/dt h = v", "d/dt v = b*u - g*sin(h) - d*v"],
    {"y": "h"},
    ["u"],
    {"b": (0.0, 5.0), "g": (0.0, 10.0), "d": (0.0, 3.0)},
    sampling_time=0.2,
).bound(v=(-5.0, 5.0))
REACTOR = replace(Reactor(None, None, None), sampling_time=1.0)
ROTATING = replace(RotatingArm(None, friction=True, drag=True), sampling_time=0.02).bound(
    Ws=(0.5, 2.0), Wd=(0.1, 1.0), b=(0.0, 0.03), speed=(-60.0, 60.0)
)
# Model, the unknowns, and the input as its mean and amplitude.
PLANTS: dict[str, tuple[Model, dict[str, float], float, float]] = {
    "pendulum": (PENDULUM, {"b": 1.0, "g": 4.0, "d": 0.5, "h[0]": 1.0, "v[0]": 0.0}, 1.5, 1.0),
    "reactor": (REACTOR, {"tau": 2.0, "a": 1.2, "x": 1.4, "w[0]": 0.5}, 0.5, 0.4),
    "arm": (ROTATING, ARM | {"angle[0]": 0.0, "speed[0]": 0.0}, 0.0, 0.15),
}
FIXED = ("c", "eps")
SAMPLES = 100


def measured(name: str, scheme: str, substeps: int) -> tuple[str, ...]:
    """Return a row of the table."""
    model, unknowns, mean, amplitude = PLANTS[name]
    u = mean + amplitude * np.repeat(np.sin(np.arange(SAMPLES // 5)), 5)
    fine, values = replace(model, scheme="rk4", substeps=100), {p.name: unknowns[p.name] for p in model.parameters}
    start = {own.removesuffix("[0]"): [value] for own, value in unknowns.items() if own.endswith("[0]")}
    y = simulate(fine, {"u": u}, values, start)["y"]
    data = Dataset.from_arrays(input={"u": u}, output={"y": y}, sampling_time=model.sampling_time or 1.0)
    record = Record(replace(model, scheme=scheme, substeps=substeps), data, {"y": NOISE_BOUND})
    # A run of the whole record reads no states of later samples.
    point = np.array([unknowns.get(own, 0.0) for own in record.names])
    half = np.array([0.0 if own in FIXED else 0.01 * abs(unknowns.get(own, 0.0)) for own in record.names])
    texts = [name, scheme, str(substeps)]
    for reach in (0.0 * half, half):
        for _ in range(2):  # the first one may compile
            began = time.process_time()
            outputs = record._run(record.cut.wholes[0], 0, point - reach, point + reach).outputs
            seconds = time.process_time() - began
        last = outputs[SAMPLES - 1]
        texts += [f"{1e3 * seconds:.1f}", f"{last[RADIUS] - NOISE_BOUND:.2g}"]
    return (*texts, f"{np.abs(last[SLOPES:]).sum():.2g}")


def rows() -> Iterator[tuple[str, ...]]:
    """Yield the rows of the table."""
    for name in PLANTS:
        for scheme, counts in STEPS.items():
            yield from (measured(name, scheme, count) for count in counts)


def main() -> None:
    """Print the table."""
    header = ("plant", "scheme", "steps", "point ms", "radius", "box ms", "radius", "reach")
    print(Table(f"One run of {SAMPLES} samples", header, tuple(rows()), "llrrrrrr"))


if __name__ == "__main__":
    main()
