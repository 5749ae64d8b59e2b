"""Hybrid models of the arm: section 6.3 of the hybrid thesis, the speed of training, and two measured records.

    python -m benchmarks.hybrid_arm [--starts 100] [--inputs one_sine six_unequal ...] [--ways random certified ...]
                                    [--records FOLDER]

Training speed: the embedded arm of five neurons on one record, from many starts, each of at most 100 evaluations beside
those of differences.  smid trains all starts in lockstep.  The rivals train a few of them one by one, by SciPy's trust
region with finite differences: around smid's own simulator of one run; around a loop in NumPy, the thesis's listing
line by line; around a NumPy loop that runs all differences of a Jacobian at once; and around a loop that is written for
speed, in Python's own numbers.  Printed are the errors that these few starts reached, and the ratio of times.

Series and parallel beside the other models on the simulated arm, which the thesis recommends (7.4) and did not do.

Measured records, from a folder that holds ``emps`` and ``quarter_drone`` (they do not come with the project).  All
models are estimated on the first 60 % and run freely over the whole record; the error of the rest is printed.

- white: mass, viscous and Coulomb friction, offset; gravity and thrust for the drone
- no friction: the same without Coulomb friction
- embedded: a network of the speed in the place of all friction
- series, parallel: a network after or beside the white model
- linear: output error with an offset, from six starts
"""

from __future__ import annotations

import argparse
import math
import sys
import time
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

import numpy as np
import sympy
from scipy.optimize import least_squares

from relaxations.algebra.arrays import Array
from smid import Dataset, OutputError
from smid.data import load_record
from smid.display.table import Table, figure
from smid.fitting.binding import bind
from smid.fitting.fit import fit
from smid.fitting.problem import Fit, Fitting
from smid.hybrid import BackCouplings, embedded, estimate, parallel, series
from smid.models import Line, Measurement, Model, Parameter, signal, t
from smid.models.rotating_arm import MOTOR
from smid.networks import NetworkError, descend, levenberg_marquardt, nguyen_widrow
from smid.signals import TABLE_F1, ModulatingFilter
from smid.theses.hybrid import simulate_arm
from smid.theses.hybrid.arm import (
    ARM,
    COMPARED,
    WAYS,
    arm_study,
    embedded_arm,
    embedded_error,
    held_record,
    modulate_motion,
    multistart_start,
)

NEURONS, EVALUATIONS, LARGEST = 5, 100, 1e8  # rad
DRIVE = 35.15065188248547  # N/V, of the record's publishers
PUBLISHED = (95.11, 203.5, 20.39, -3.16)
TRAINED = 0.6  # of the samples
x, v, u = signal("x"), signal("v"), signal("u")


def training_speed(starts: int = 100, few: int = 4) -> Table:
    """Time smid and its rivals from the same starts."""
    record = held_record(TABLE_F1["six_unequal"])
    problem, motion = embedded_error(embedded_arm((NEURONS,)), record), modulate_motion(record)
    points = np.array([multistart_start(motion, NEURONS, starts=2, seed=seed) for seed in range(starts)])
    problem.normal_equations(points[0])  # compiles

    def alone(theta: Array) -> Array:
        return problem.runs(theta[None]).residuals[0]

    rivals: dict[str, tuple[Residual, Workers | None]] = {
        "smid's simulator": (alone, None),
        "a loop in NumPy": (_loop(record, _numpy_torque), None),
        "a loop in NumPy, all at once": (lambda theta: _at_once(record, theta[None])[0], _together(record)),
        "a loop in plain Python": (_loop(record, _plain_torque), None),
    }
    began = time.process_time()
    found = problem.lower(points, evaluations=EVALUATIONS)
    own = (time.process_time() - began) / starts
    rows = [(f"smid, {starts} starts in lockstep", own, problem.errors(found[:few]))]
    for label, (residual, workers) in rivals.items():
        began = time.process_time()
        ends = [_descend(residual, workers, start) for start in points[:few]]
        rows.append(
            (f"SciPy, differences of {label}", (time.process_time() - began) / few, problem.errors(np.array(ends)))
        )
    cells = tuple(
        (label, f"{1e3 * seconds:.0f}", f"{seconds / own:.1f}", f"{1e3 * np.sqrt(np.median(errors)):.2f}")
        for label, seconds, errors in rows
    )
    caption = f"Training of {points.shape[1]} numbers, {EVALUATIONS} evaluations; errors of the first {few} starts."
    return Table(caption, ("method", "CPU ms a start", "ratio", "median error [mrad]"), cells, "lrrr")


Residual = Callable[[Array], Array]
Workers = Callable[[Residual, Iterable[Array]], list[Array]]


def _descend(residual: Residual, workers: Workers | None, start: Array) -> Array:
    """Run SciPy's trust-region method with finite differences."""

    def kept(theta: Array) -> Array:
        return np.clip(np.nan_to_num(residual(theta), nan=LARGEST), -LARGEST, LARGEST)

    found = least_squares(kept, start, jac="2-point", x_scale="jac", max_nfev=EVALUATIONS, workers=workers)
    return np.asarray(found.x)


def _together(record: Dataset) -> Workers:
    return lambda _, points: list(_at_once(record, np.array(list(points))))


def _at_once(record: Dataset, thetas: Array) -> Array:
    """Run the arm at many points, shape (B, p), in one loop; return residuals, shape (B, n)."""
    voltage, h = record.experiments[0].values["u"].tolist(), record.sampling_time
    slope, bias, output = np.moveaxis(thetas[:, 1:-1].reshape(len(thetas), 3, -1), 1, 0)
    inertia, offset = 16.0 * thetas[:, 0], thetas[:, -1]
    slope, output, push = slope / 80.0, 16.0 * inertia[:, None] * output, 16.0 * inertia * offset

    def brake(speed: Array) -> Array:
        return np.einsum("bi,bi->b", output, np.tanh(slope * speed[:, None] + bias)) + push

    angle, speed = np.zeros(len(thetas)), np.zeros(len(thetas))
    angles = []
    for held in (0.0, *voltage[:-1]):
        torque = ARM["c"] * held * inertia
        k1 = torque - brake(speed)
        k2 = torque - brake(speed + h / 2 * k1)
        k3 = torque - brake(speed + h / 2 * k2)
        k4 = torque - brake(speed + h * k3)
        angle = angle + h * speed + h * h / 6 * (k1 + k2 + k3)
        speed = speed + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
        angles.append(angle)
    return np.array(angles).T - record.experiments[0].values["y"]


def _numpy_torque(theta: Array) -> Callable[[float], float]:
    slope, bias, output = theta[1:-1].reshape(3, -1)

    def torque(speed: float) -> float:
        return 16.0 * float(output @ np.tanh(slope * speed / 80.0 + bias) + theta[-1])

    return torque


def _plain_torque(theta: Array) -> Callable[[float], float]:
    neurons = list(zip(*theta[1:-1].reshape(3, -1).tolist(), strict=True))
    offset = float(theta[-1])

    def torque(speed: float) -> float:
        total = offset
        for slope, bias, output in neurons:
            total += output * math.tanh(slope * speed / 80.0 + bias)
        return 16.0 * total

    return torque


def _loop(record: Dataset, network: Callable[[Array], Callable[[float], float]]) -> Residual:
    voltage, measured = record.experiments[0].values["u"].tolist(), record.experiments[0].values["y"]
    h, c = record.sampling_time, ARM["c"]

    def residual(theta: Array) -> Array:
        inertia, friction = 16.0 * float(theta[0]), network(theta)
        angle, speed, angles = 0.0, 0.0, []
        for held in (0.0, *voltage[:-1]):  # at rest before the first sample, as `FreeRunError`
            torque = c * held
            k1 = inertia * (torque - friction(speed))
            k2 = inertia * (torque - friction(speed + h / 2 * k1))
            k3 = inertia * (torque - friction(speed + h / 2 * k2))
            k4 = inertia * (torque - friction(speed + h * k3))
            angle += h * speed + h * h / 6 * (k1 + k2 + k3)
            speed += h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
            angles.append(angle)
        return np.array(angles) - measured

    return residual


@dataclass(frozen=True)
class Rig:
    """An arm or slide: its record, and its first principles with and without friction.

    Parameters
    ----------
    name, unit : str
    per_unit : float
        Output's units in one printed unit.
    data : Dataset
    white : Model
        Friction is its parameters `friction`, each zero without it.
    friction : tuple of str
        Viscous, then Coulomb.
    torque : sympy.Expr
        What friction takes of the speed's rate, in `white`.
    reach : float
        Speed that brings the network's input near 1.
    size : sympy.Expr
        Factor of the network in the speed's rate.
    order : int
        Of the linear model.
    """

    name: str
    unit: str
    per_unit: float
    data: Dataset
    white: Model
    friction: tuple[str, str]
    torque: sympy.Expr
    reach: float
    size: sympy.Expr
    order: int


def _symbols(parameters: Sequence[Parameter]) -> list[sympy.Symbol]:
    return [parameter.symbol for parameter in parameters]


def _thinned(data: Dataset, factor: int, input: str, output: str, scale: float = 1.0) -> Dataset:
    """Keep every `factor`-th sample of the output, and the mean of the input until the next."""
    values = data.experiments[0].values
    n = data.experiments[0].n_samples // factor * factor
    held = values[input][:n].reshape(-1, factor).mean(axis=1)
    return Dataset.from_arrays(
        input={"u": held}, output={"y": scale * values[output][:n:factor]}, sampling_time=factor * data.sampling_time
    )


def arm() -> Rig:
    """Give the thesis's arm under `six_unequal`, simulated, with 2 mrad of noise and no sticking in the white model."""
    parameters = (
        Parameter("M", 0.01, 1.0, "kg m2"),
        Parameter("b", 0.0, 0.1, "N m s2/rad2"),
        Parameter("Wd", 0.0, 5.0, "N m"),
    )
    inertia, drag, gliding = _symbols(parameters)
    friction = drag * v[t] * sympy.Abs(v[t]) + gliding * sympy.tanh(v[t] / 0.03)
    rate = (MOTOR["c"][0] * u[t] - friction) / inertia
    lines = (Line(x[t], v[t], rate=True), Line(v[t], rate, rate=True))
    start = {"M": 0.1, "b": 0.01, "Wd": 1.0}
    white = Model("arm", parameters, lines, (Measurement("y", "x", "eta"),), values=start)
    voltage = TABLE_F1["six_unequal"].signal(1000, 0.02)
    noise = np.random.default_rng(1).uniform(-0.002, 0.002, voltage.size)
    angle = simulate_arm(voltage, 0.02) + noise
    data = Dataset.from_arrays(input={"u": voltage}, output={"y": angle}, sampling_time=0.02)
    return Rig("the thesis's arm", "rad", 1.0, data, white, ("b", "Wd"), friction, 80.0, -16.0 / inertia, 2)


def emps(folder: str) -> Rig:
    """Give the slide: ``M v' = g u - Fv v - Fc sign(v) - offset``."""
    parameters = (
        Parameter("M", 10.0, 300.0, "kg"),
        Parameter("Fv", 0.0, 1000.0, "N s/m"),
        Parameter("Fc", 0.0, 100.0, "N"),
        Parameter("offset", -20.0, 20.0, "N"),
    )
    mass, viscous, coulomb, offset = _symbols(parameters)
    friction = viscous * v[t] + coulomb * sympy.tanh(v[t] / 1e-3)
    rate = (DRIVE * u[t] - friction - offset) / mass
    lines = (Line(x[t], v[t], rate=True), Line(v[t], rate, rate=True))
    start = {"M": 80.0, "Fv": 150.0, "Fc": 10.0, "offset": 0.0}
    white = Model("slide", parameters, lines, (Measurement("y", "x", "eta"),), values=start)
    data = _thinned(load_record("emps", folder), 10, "controller_voltage", "position")
    return Rig("emps", "mm", 1e-3, data, white, ("Fv", "Fc"), friction, 0.15, -50.0 / mass, 2)


def drone(folder: str) -> Rig:
    """Give the propeller's arm: ``v' = k max(u, 0)^2 - g sin(x + phi) - d v - f sign(v)``."""
    parameters = (
        Parameter("k", 0.0, 1.0),
        Parameter("g", 0.0, 100.0),
        Parameter("phi", -1.0, 1.0, "rad"),
        Parameter("d", 0.0, 50.0, "1/s"),
        Parameter("f", 0.0, 20.0, "rad/s2"),
    )
    thrust, gravity, tilt, viscous, coulomb = _symbols(parameters)
    friction = viscous * v[t] + coulomb * sympy.tanh(v[t] / 0.02)
    rate = thrust * sympy.Max(u[t], 0) ** 2 - gravity * sympy.sin(x[t] + tilt) - friction
    lines = (Line(x[t], v[t], rate=True), Line(v[t], rate, rate=True))
    start = {"k": 0.01, "g": 10.0, "phi": 0.0, "d": 2.0, "f": 0.1}
    white = Model("propeller", parameters, lines, (Measurement("y", "x", "eta"),), values=start)
    data = _thinned(load_record("quarter_drone", folder), 5, "thrust", "angle", math.pi / 180.0)
    size = sympy.Integer(-2)
    return Rig("quarter_drone", "deg", math.pi / 180.0, data, white, ("d", "f"), friction, 1.5, size, 3)


def compare(rig: Rig, say: Callable[[str], None]) -> Table:
    """Return held-out free-run errors."""
    n = rig.data.experiments[0].n_samples
    used = [np.arange(n) < TRAINED * n]
    rows: list[tuple[str, ...]] = []

    def score(label: str, run: Callable[[], Fit]) -> Fit:
        say(f"{rig.name}: {label}")
        began = time.perf_counter()
        found = run()
        seconds = time.perf_counter() - began
        error = found.residual(rig.data, "y")[0] / rig.per_unit
        parts = (error[used[0]], error[~used[0]])
        rms = (figure(float(np.sqrt(np.mean(part**2)))) for part in parts)
        rows.append((label, f"{found.n_free}", *rms, f"{seconds:.1f}"))
        return found

    white = score("white", lambda: fit(bind(rig.white, rig.data), rig.data, used, starts=2))
    smooth = rig.white.bound(**{rig.friction[1]: (0.0, 0.0)}).with_values({rig.friction[1]: 0.0})
    score("no friction", lambda: fit(bind(smooth, rig.data), rig.data, used, starts=2))
    score("embedded", lambda: _embedded(rig, white, used))
    fixed = white.model.bound(**{name: (value, value) for name, value in white.model.values.items()})
    for join in (series, parallel):
        hybrid = join(fixed, BackCouplings(1, 2), (3,))
        score(
            hybrid.topology,
            lambda hybrid=hybrid: estimate(hybrid, rig.data, used, starts=1, iterations=60, seed=1).fit,
        )
    linear = OutputError(rig.order, rig.order, offset=True)
    score("linear", lambda: fit(bind(linear, rig.data), rig.data, used))
    told = ", ".join(f"{name} {value:.4g}" for name, value in white.model.values.items())
    caption = f"{rig.name}, {n} samples: free-run RMS error [{rig.unit}]. White: {told}."
    return Table(caption, ("model", "fitted", "first 60 %", "held out", "s"), tuple(rows), "lrrrr")


def _embedded(rig: Rig, white: Fit, used: Sequence[np.ndarray]) -> Fit:
    """Put a network for friction, begun at the white model's friction, and fit all again."""
    bare = rig.white.bound(**dict.fromkeys(rig.friction, (0.0, 0.0))).with_values(dict.fromkeys(rig.friction, 0.0))
    hybrid = embedded(bare, {"v": rig.size}, [v[t] / rig.reach], (3,))
    values = dict(white.model.values)
    speed = np.linspace(-1.0, 1.0, 201)
    torque = sympy.lambdify([v[t]], rig.torque.subs(_by_name(rig.torque, values)), "numpy")
    # `torque` is part of the rate times the mass where there is one; `size` carries the same factor.
    scale = float((-rig.size * values.get("M", 1.0)).subs(_by_name(rig.size, values)))
    first = nguyen_widrow((1, 3), 1).weights
    target = np.asarray(torque(rig.reach * speed)) / scale
    network = descend(levenberg_marquardt, NetworkError((1, 3), speed[:, None], target), first, iterations=300).theta
    weights = dict(zip((p.name for p in hybrid.term.parameters), network.tolist(), strict=True))
    start = {name: value for name, value in values.items() if name not in rig.friction} | weights
    model = bind(hybrid.model, rig.data)
    problem = Fitting(model, rig.data, used, list(white.initial))
    vector, cost = problem.solve(problem.start(start | dict.fromkeys(rig.friction, 0.0)), 150)
    return problem.result(vector, cost)


def _by_name(expression: sympy.Expr, values: dict[str, float]) -> dict[sympy.Symbol, float]:
    return {s: values[s.name] for s in expression.free_symbols if getattr(s, "name", "") in values}


def inverse_dynamics(folder: str) -> Table:
    """Find the slide's constants by input error: linear least squares over modulated signals."""
    record = load_record("emps", folder)
    values, step = record.experiments[0].values, record.sampling_time
    modulating = ModulatingFilter(3, 20)
    speed, acceleration = (modulating.derivative(values["position"], step, k) for k in (1, 2))
    force = DRIVE * modulating.derivative(values["controller_voltage"], step, 0)
    moving = np.abs(speed) > 5e-3
    columns = np.column_stack([acceleration, speed, np.sign(speed), np.ones(speed.size)])[moving]
    found = np.linalg.lstsq(columns, force[moving], rcond=None)[0]
    rows = tuple(
        (name, figure(published), f"{value:.4g}")
        for name, published, value in zip(
            ("M [kg]", "Fv [N s/m]", "Fc [N]", "offset [N]"), PUBLISHED, found, strict=True
        )
    )
    return Table("emps by input error, spline modulating functions.", ("constant", "published", "smid"), rows, "lrr")


def _tell(words: str) -> None:
    print(words, file=sys.stderr, flush=True)


def main() -> None:
    """Print all tables."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--starts", type=int, default=100, help="random starts of every estimation with a network")
    parser.add_argument("--inputs", nargs="+", default=list(TABLE_F1), choices=list(TABLE_F1), help="of table F.1")
    parser.add_argument("--ways", nargs="+", default=COMPARED, choices=list(WAYS), help="to estimate the embedded arm")
    parser.add_argument("--records", help="folder that holds emps and quarter_drone")
    parser.add_argument("--only", choices=("speed", "topologies", "study"), help="one part")
    options = parser.parse_args()

    def asked(part: str) -> bool:
        return options.only in (None, part)

    if asked("speed"):
        print(training_speed(), end="\n\n", flush=True)
    if asked("topologies"):
        print(compare(arm(), _tell), end="\n\n", flush=True)
    if asked("topologies") and options.records:
        print(inverse_dynamics(options.records), end="\n\n", flush=True)
        for rig in (emps(options.records), drone(options.records)):
            print(compare(rig, _tell), end="\n\n", flush=True)
    if asked("study"):
        print(arm_study(options.starts, inputs=options.inputs, ways=options.ways))


if __name__ == "__main__":
    main()
