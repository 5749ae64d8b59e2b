"""The measured records of `benchmarks.measured_diagnosis`: the base model of each, and what is known to be missing."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from smid import Dataset, Model, OutputError
from smid.data import load_record
from smid.models import Line, Measurement, Parameter, signal, t

SERVO_RUNS = ("chirp_0", "prbs_31", "prbs_32", "triangle_64", "triangle_65", "square_76", "square_77", "ramp_52")


@dataclass(frozen=True, eq=False)
class Case:
    """A record and how it is diagnosed.

    Parameters
    ----------
    record : str
        Name of the set.
    load : callable (Dataset) -> Dataset
        Choice of runs and channels, and of the part that is used.
    how : str
        What `load` does, for the reader.
    model : Model
        The base model.
    base : str
        The base model in words.
    known : str
        What is known to be missing.
    share : float or tuple of str
        The test part: a share of every run, at its end, or runs.
    test : str
        The run whose test part is the published one, or a run that the diagnosis does not load at all.
    published : str
        Published figures on that test part.
    factor, unit : float, str
        From the record's unit to the unit of the published figures.
    read : callable (Path) -> Dataset, optional
        Reads the set from its folder; by default `smid.data.load_record` does.
    """

    record: str
    load: Callable[[Dataset], Dataset]
    how: str
    model: Model
    base: str
    known: str
    share: float | tuple[str, ...] = 0.2
    test: str = ""
    published: str = ""
    factor: float = 1.0
    unit: str = ""
    read: Callable[[Path], Dataset] | None = None

    def whole(self, folder: Path) -> Dataset:
        """Read the whole set from the folder that holds all sets."""
        return self.read(folder / self.record) if self.read else load_record(self.record, folder)


def two_tanks() -> Model:
    """Give two equal tanks in succession, each emptying in proportion to its level, and a sensor of unknown zero."""
    outflow, pump, zero = (
        Parameter("outflow", 1e-4, 0.2, "1/s"),
        Parameter("pump", 0, 1),
        Parameter("zero", -20, 20, "V"),
    )
    upper, level, u, seen = signal("upper"), signal("w"), signal("u"), signal("seen")
    k = outflow.symbol
    lines = (
        Line(upper[t], pump.symbol * u[t] - k * upper[t], rate=True),
        Line(level[t], k * upper[t] - k * level[t], rate=True),
        Line(seen[t], level[t] + zero.symbol),
    )
    return Model("two tanks", (outflow, pump, zero), lines, (Measurement("y", "seen", "eta"),), scheme="euler")


def newton() -> Model:
    """Give a mass and the force on it: ``M x'' = K u``."""
    gain = Parameter("gain", 0, 10)
    position, speed, u = signal("x"), signal("v"), signal("u")
    lines = (Line(position[t], speed[t], rate=True), Line(speed[t], gain.symbol * u[t], rate=True))
    return Model("Newton's law", (gain,), lines, (Measurement("y", "x", "eta"),))


def damper() -> Model:
    """Give a viscous damper with a preload: ``F = c v + F0``."""
    damping, preload = Parameter("c"), Parameter("preload")
    line = Line(signal("w")[t], damping.symbol * signal("velocity")[t] + preload.symbol)
    return Model("viscous damper", (damping, preload), (line,), (Measurement("force", "w", "eta"),))


def seal() -> Model:
    """Give the force on a cylinder: ``F = area p + c v + F0``."""
    area, damping, preload = Parameter("area"), Parameter("c"), Parameter("preload")
    forces = area.symbol * signal("pressure")[t] + damping.symbol * signal("velocity")[t] + preload.symbol
    return Model(
        "seal",
        (area, damping, preload),
        (Line(signal("w")[t], forces),),
        (Measurement("force", "w", "eta"),),
    )


def columns(input: str, output: str, sampling_time: float) -> Callable[[Path], Dataset]:
    """Return the reader of a set with one file of columns, named as its folder is."""
    return lambda folder: Dataset.from_file(folder / f"{folder.name}.csv", input, output, sampling_time)


def strokes(folder: Path) -> Dataset:
    """Read the two runs of the cylinder every 0.04 s, with the velocity as the slope of the position."""
    runs = []
    for name in ("bar3", "bar7"):
        stamps, *measured = np.loadtxt(folder / f"{name}.csv", delimiter=",", skiprows=1, unpack=True)
        now = np.arange(stamps[0], stamps[-1], 0.04)
        position, pressure, force = (np.interp(now, stamps, samples) for samples in measured)
        moved = Dataset.from_arrays(
            input={"velocity": np.gradient(position, 0.04), "pressure": pressure},
            output={"force": force},
            sampling_time=0.04,
            name=name,
            units={"velocity": "mm/s", "pressure": "bar", "force": "N"},
        )
        runs.append(moved)
    return Dataset.merge(runs)


def whole(data: Dataset) -> Dataset:
    """Take a record as it is."""
    return data


def without(data: Dataset, *drop: str) -> Dataset:
    """Leave channels out: the reference of a controller is no cause of what the plant does."""
    runs = tuple(
        replace(r, values={name: samples for name, samples in r.values.items() if name not in drop})
        for r in data.experiments
    )
    channels = tuple(c for c in data.channels if c.name not in drop)
    outputs = tuple(name for name in data.outputs if name not in drop)
    inputs = tuple(name for name in data.inputs if name not in drop)
    return replace(data, experiments=runs, channels=channels, inputs=inputs, outputs=outputs)


def cycles(data: Dataset) -> Dataset:
    """Cut the positioning record at the cycles of its reference, 6.224 s long."""
    run = without(data, "reference_position").experiments[0]
    parts = tuple(
        replace(run, name=f"cycle{k + 1}", values={n: x[6224 * k : 6224 * k + 6160] for n, x in run.values.items()})
        for k in range(4)
    )
    return without(data, "reference_position").with_experiments(parts)


SECOND = OutputError(2, 1, offset=True)
CASES = (
    Case(
        "ced_prbs",
        whole,
        "all three runs",
        OutputError(3, 2, offset=True),
        "linear, order 3",
        "the sensor does not see the sign of the speed",
        0.2,
        test="prbs1",
        published="constant 0.698, magnitude of a linear output 0.174",
        unit="ticks/s",
    ),
    Case(
        "emps",
        cycles,
        "the cycles of the reference as four runs, without the reference",
        newton(),
        "Newton's law",
        "Coulomb and viscous friction, force offset",
        ("cycle4",),
    ),
    Case(
        "cascaded_tanks",
        whole,
        "",
        two_tanks(),
        "two linear tanks in succession",
        "square-root outflow, overflow",
        ("validation",),
        test="validation",
        published="linear 0.588, polynomial NARX 0.413, SUBNET 0.37, grey box 0.191",
        unit="V",
    ),
    Case("daisy_hairdryer", whole, "", SECOND, "linear, order 2, delay 1", "delay"),
    Case("box_jenkins_gas_furnace", whole, "", SECOND, "linear, order 2, delay 1", "delay"),
    Case(
        "hydraulic_actuator",
        whole,
        "",
        SECOND,
        "linear, order 2",
        "valve dead zone, load dependence",
        0.5,
        test="experiment",
    ),
    Case(
        "quarter_drone",
        lambda data: without(data, "reference_angle").decimate(10, held=["thrust"]),
        "every 10th sample, without the reference",
        SECOND,
        "linear, order 2",
        "gravity, dead zone of the thrust",
    ),
    Case(
        "servo_rate_limit",
        lambda data: data.select(SERVO_RUNS),
        "eight of the hundred runs, of five kinds",
        OutputError(1, 0, offset=True),
        "linear, order 1",
        "delay, rate limit",
    ),
    Case(
        "mr_damper_labcontrol",
        lambda data: data.select(("A.1", "A.5", "A.10")).crop(0, 600),
        "three of the ten runs, 6 s each",
        damper(),
        "viscous damper with preload",
        "hysteresis against velocity",
    ),
    Case(
        "silverbox",
        lambda data: data.select("multisine"),
        "the multisine",
        OutputError(2, 2, 0, offset=True),
        "linear, order 2, without delay",
        "hardening cubic spring",
        test="arrow",
        published="linear 14.4, polynomial NARX 2.25, SUBNET 1.4, GP-NARX 0.60",
        factor=1e3,
        unit="mV",
    ),
    Case(
        "daisy_cstr",
        lambda data: without(data, "temperature").crop(0, 4500).decimate(3, held=["coolant_flow"]),
        "the concentration only, the first 4500 samples, every third",
        SECOND,
        "linear, order 2",
        "gain and damping depend on the operating point",
    ),
    Case("daisy_heating_system", whole, "", SECOND, "linear, order 2", "left unnamed by its source"),
    Case(
        "two_tank",
        whole,
        "",
        two_tanks(),
        "two linear tanks in succession",
        "each outflow follows the root of its level",
        read=columns("pump", "level", 1.2),
    ),
    Case(
        "heat_exchanger",
        whole,
        "",
        SECOND,
        "linear, order 2",
        "gain and time constant depend on the flow",
        read=columns("flow", "temperature", 1.0),
    ),
    Case(
        "opto_shield",
        whole,
        "",
        OutputError(1, 0, 0, offset=True),
        "linear, order 1, without delay",
        "the sensor saturates, is fast to light and slow to dark",
        read=columns("led", "ldr", 0.05),
    ),
    Case(
        "ball_and_hoop",
        whole,
        "",
        OutputError(1, 0, offset=True),
        "linear, order 1",
        "dry friction, saturation of the drive",
        read=columns("u", "speed", 0.1),
    ),
    Case(
        "dc_motor_hsm150",
        whole,
        "",
        OutputError(1, 0),
        "linear, order 1, without offset",
        "Coulomb friction or an offset",
        read=lambda folder: Dataset.from_file([folder / "forward.csv", folder / "backward.csv"], "torque", "speed"),
    ),
    Case(
        "stiction_loop",
        whole,
        "",
        OutputError(1, 0, offset=True, stable=True),
        "linear, order 1, stable",
        "the valve sticks",
        read=columns("OP", "PV", 24.0),
    ),
    Case(
        "seal_friction",
        whole,
        "every 0.04 s, with the slope of the position as the velocity",
        seal(),
        "area times pressure, viscous friction and preload",
        "Coulomb friction that grows with the pressure",
        read=strokes,
    ),
)
