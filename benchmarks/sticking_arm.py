"""Integration of the arm while it sticks: white, certified and embedded models under six equal sines.

    python -m benchmarks.sticking_arm

The arm sticks during 38 % of this record, where its friction has a rate of 870 1/s and samples are 20 ms apart. The
errors are those of free runs against the exact motion of the same constants:

- white: the plant's constants
- certified: the midpoints of the certified intervals, from a record with 2 mrad of noise

"SciPy, events" locates the edges of sticking within each sample. A second table estimates the white model by each
integration, from the constants of table F.2 and from the certified midpoints. A third trains the embedded network of
five neurons by two of them, from a start without a law, and runs it over slower sines and a voltage of another kind:
by its own integration, and by SciPy's Radau with tolerances of 1e-7, because no exact motion of a network is known.
"""

from __future__ import annotations

import itertools
import time
from collections.abc import Callable, Mapping
from functools import partial

import numpy as np
from scipy.integrate import solve_ivp

from relaxations.algebra.arrays import Array
from smid import Dataset
from smid.display.table import Table
from smid.hybrid import FreeRunError, network_of
from smid.networks import descend, levenberg_marquardt
from smid.signals import TABLE_F1
from smid.theses.hybrid.arm import (
    ARM,
    TABLE_F2_START,
    embedded_arm,
    embedded_error,
    estimate_white,
    exact_motion,
    global_start,
    held_record,
    modulate_motion,
    other_kind,
    quiet_filter,
    slower,
    true_friction,
    white_arm,
    white_free_run,
)
from smid.theses.hybrid.arm.embedded_arm import SPEED_UNIT, TORQUE_UNIT
from smid.theses.hybrid.arm.proven import prove_arm

INPUT, NOISE, NEURONS = "six_equal", 0.002, 5
SCHEMES = (("rk4", 1), ("rk4", 16), ("rosenbrock", 1), ("rosenbrock", 4), ("rosenbrock", 16))
Values = Mapping[str, float]
Friction = Callable[[Array], Array]


def by_scipy(record: Dataset, theta: float, friction: Friction, *, method: str, tight: float, edge: float = 0) -> Array:
    """Return the angle by `solve_ivp` from sample to sample; with an edge, it also stops where the speed is there."""
    u, h = record.values("u"), record.sampling_time
    state, angles = np.zeros(2), [0.0]

    def rates(_: float, x: Array, held: float) -> list[float]:
        return [x[1], theta * (ARM["c"] * held - float(friction(x[1:])[0]))]

    def crossing(_: float, x: Array, *_held: float) -> float:
        return float(abs(x[1]) - edge)

    crossing.terminal = True  # type: ignore[attr-defined]
    for held in u[:-1].tolist():
        begin = 0.0
        while begin < h:
            found = solve_ivp(
                rates,
                (begin, h),
                state,
                args=(held,),
                method=method,
                rtol=tight,
                atol=tight,
                events=crossing if edge else None,
            )
            begin, state = float(found.t[-1]), found.y[:, -1]
            if found.status == 1 and begin < h:  # leave the edge by an Euler step too short to matter
                state, begin = state + 1e-9 * np.array(rates(begin, state, held)), begin + 1e-9
        angles.append(float(state[0]))
    return np.array(angles)


def row(name: str, how: str, error: Array, exact: Array, seconds: float) -> tuple[str, ...]:
    """Return the cells of an error."""
    rms, span = float(np.sqrt(np.mean(error**2))), float(np.ptp(exact))
    return name, how, f"{rms:.2g}", f"{100 * rms / span:.2g} %", f"{1e3 * seconds:.0f}"


def integrations(record: Dataset, proven: Values) -> Table:
    """Return the errors of integration of the models whose law is known."""
    rows = []
    u, h = record.values("u"), record.sampling_time
    plant = {name: ARM[name] for name in TABLE_F2_START}
    for name, values in (("white", plant), ("certified", proven)):
        exact = exact_motion(u, h, values=dict(values))[:, 0]
        for scheme, substeps in SCHEMES:
            model = white_arm(scheme, substeps)
            model.simulate(record, values, "rest")  # compiles
            began = time.process_time()
            angle = model.simulate(record, values, "rest").outputs[0]["y"]
            how = f"{scheme}, {substeps} a sample"
            rows.append(row(name, how, angle - exact, exact, time.process_time() - began))
        law = ARM | dict(values)
        for how, method, edge in (("Radau", "Radau", 0.0), ("events", "LSODA", law["eps"])):
            began = time.process_time()
            angle = by_scipy(
                record, law["theta"], partial(true_friction, values=law), method=method, tight=1e-8, edge=edge
            )
            rows.append(row(name, f"SciPy, {how}", angle - exact, exact, time.process_time() - began))
    header = ("model", "integration", "RMS error [rad]", "of the span", "ms")
    return Table("Error of integration, six_equal, 10 s.", header, tuple(rows), "llrrr")


def estimates(record: Dataset, noisy: Dataset, proven: Values) -> Table:
    """Return the white model's constants by each integration, from two starts."""
    rows = []
    for start, first in (("table F.2", TABLE_F2_START), ("certified", proven)):
        for scheme, substeps in (("exact", 1), *SCHEMES):
            began = time.process_time()
            if scheme == "exact":
                values = dict(estimate_white(noisy, start=first).values)
            else:
                model = white_arm(scheme, substeps)
                free = [p.name for p in model.parameters if p.lower < p.upper]
                problem = FreeRunError(model, noisy, np.array([first[name] for name in free]))
                values = problem.values(descend(levenberg_marquardt, problem, np.ones(len(free)), patience=1000).theta)
            seconds = time.process_time() - began
            error = white_free_run(values, record) - record.values("y")
            told = (f"{values[name]:.4g}" for name in TABLE_F2_START)
            how = scheme if scheme == "exact" else f"{scheme}, {substeps}"
            rows.append((start, how, *told, f"{np.sqrt(np.mean(error**2)):.2g}", f"{seconds:.1f}"))
    header = ("start", "integration", *TABLE_F2_START, "exact motion errs by [rad]", "s")
    return Table("White model, 2 mrad of noise; the error is that of its constants.", header, tuple(rows), "llrrrrrr")


def networks(noisy: Dataset) -> Table:
    """Return the errors of networks that were trained by each integration."""
    checks = [held_record(u) for u in (slower(TABLE_F1[INPUT]), other_kind(TABLE_F1[INPUT]))]
    motion = modulate_motion(noisy, quiet_filter(NOISE, noisy.sampling_time))
    rows = []
    for (scheme, substeps), seed in itertools.product((("rosenbrock", 1), ("rk4", 16)), (1, 2)):
        hybrid = embedded_arm((NEURONS,), scheme=scheme, substeps=substeps)
        problem = embedded_error(hybrid, noisy)
        began = time.process_time()
        theta = problem.lower(global_start(motion, NEURONS, judge=problem.errors, seed=seed))
        seconds, values = time.process_time() - began, problem.values(theta)
        network, cells = network_of(hybrid.model.with_values(values), hybrid.term), []
        for check in checks:
            tight = by_scipy(
                check,
                values["theta"],
                lambda v, network=network: TORQUE_UNIT * network(v[:, None] / SPEED_UNIT),
                method="Radau",
                tight=1e-7,
            )
            own, y = hybrid.model.simulate(check, values, "rest").outputs[0]["y"], check.values("y")
            cells += [f"{float(np.sqrt(np.mean(part**2))):.2g}" for part in (own - y, own - tight)]
        rmse = f"{np.sqrt(problem.error(theta)):.2g}"
        rows.append((f"{scheme}, {substeps}", str(seed), rmse, *cells, f"{values['theta']:.2f}", f"{seconds:.1f}"))
    header = (
        "trained by",
        "seed",
        "record",
        "slower",
        "of it integration",
        "other kind",
        "of it integration",
        "1/J",
        "s",
    )
    return Table("Embedded network, RMS errors in rad.", header, tuple(rows), "llrrrrrrr")


def main() -> None:
    """Print the tables."""
    record = held_record(TABLE_F1[INPUT])
    noisy = held_record(TABLE_F1[INPUT], noise_bound=NOISE, seed=1)
    found = prove_arm(Dataset.from_arrays(input=noisy.values("u"), output=noisy.values("y"), sampling_time=0.02), NOISE)
    proven = {name: found[name].centre for name in TABLE_F2_START}
    sticks = np.mean(np.abs(record.values("speed")) < ARM["eps"])
    print(f"The arm sticks during {100 * sticks:.0f} % of the record.\n", flush=True)
    print(integrations(record, proven), end="\n\n", flush=True)
    print(estimates(record, noisy, proven), end="\n\n", flush=True)
    print(networks(noisy))


if __name__ == "__main__":
    main()
