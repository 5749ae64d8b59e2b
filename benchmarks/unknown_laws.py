"""Laws that embedded networks learn, on simulated tanks and on measured records.

    python -m benchmarks.unknown_laws [--seeds 3] [--records FOLDER]

Simulated: a heated tank of two states whose heat loss is to be found, by SciPy's `solve_ivp`. There are five laws. Both
outputs or the temperature alone are measured, with white noise of 2 mm and 0.1 K. Printed are the largest errors of
network and law from 10 to 60 K, where that was visited, and how often the law got its name.

Measured, from a folder that holds ``two_tank``, ``heat_exchanger`` and ``emps`` (they do not come with the project):
the network is trained on the first part of the record, and network and law run freely over the rest.

- two_tank: the outflow of the lower tank, as a function of its level
- heat_exchanger: the rate of exchange, as a function of the flow
- emps: the friction of a slide, as a function of its speed
"""

from __future__ import annotations

import argparse
import itertools
import sys
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from scipy.integrate import solve_ivp

from relaxations.algebra.arrays import Array
from smid import Dataset, OwnModel
from smid.data import load_record
from smid.display.table import Table, figure
from smid.hybrid import HybridModel, LearnedLaw, embedded, estimate, learned_law, network_output
from smid.models import signal, t

AREA, OUTFLOW, HEAT, ROOM, FEED, STEP = 0.1, 4e-5, 4.18e6, 18.0, 15.0, 20.0
LAWS: Mapping[str, Callable[[Array], Array]] = {
    "power_law": lambda x: 55.0 * np.abs(x) ** 1.25,
    "proportional + quadratic_drag": lambda x: 120.0 * x + 1.2 * x * np.abs(x),
    "proportional": lambda x: 180.0 * x,
    "square_root_outflow": lambda x: 1500.0 * np.sqrt(np.abs(x)),
    "exponential": lambda x: 900.0 * np.exp(x / 28.0),
}
OUTPUTS = {"level": "h", "temp": "T"}


def tank_record(loss: Callable[[Array], Array], seed: int, outputs: tuple[str, ...], n: int = 1000) -> Dataset:
    """Return a record of the tank."""
    rng = np.random.default_rng(seed)
    inflow = np.repeat(rng.uniform(1.5e-5, 2.8e-5, n // 40), 40)
    power = np.repeat(rng.choice([4e3, 7e3, 10e3, 14e3, 18e3], n // 50), 50)

    def rates(_: float, state: Array, k: int) -> tuple[float, float]:
        level, temp = state
        heat = power[k] + HEAT * inflow[k] * (FEED - temp) - loss(temp - ROOM)
        return (inflow[k] - OUTFLOW * np.sqrt(level)) / AREA, heat / (HEAT * AREA * level)

    states = [np.array([0.3, 30.0])]
    for k in range(n - 1):
        states.append(solve_ivp(rates, (0, STEP), states[-1], args=(k,), rtol=1e-8, atol=1e-8).y[:, -1])
    noise = {"level": 2e-3, "temp": 0.1}
    shown = {name: x + noise[name] * rng.standard_normal(n) for name, x in zip(OUTPUTS, np.transpose(states))}  # noqa: B905
    return Dataset.from_arrays(
        input={"inflow": inflow, "power": power}, output={name: shown[name] for name in outputs}, sampling_time=STEP
    )


def tank_model(outputs: tuple[str, ...]) -> HybridModel:
    """Return the tank's balances with a network for the heat loss."""
    balances = ["d/dt h = (inflow - k*sqrt(h)) / 0.1", "d/dt T = (power + 4.18e6*inflow*(15 - T)) / (4.18e6*0.1*h)"]
    shown = {name: OUTPUTS[name] for name in outputs}
    tank = OwnModel(balances, shown, ["inflow", "power"], {"k": (1e-5, 1e-4)})
    return embedded(tank, {"T": -1 / (HEAT * AREA * signal("h")[t])}, [signal("T")[t] - ROOM])


def tanks(seeds: int, say: Callable[[str], None]) -> Table:
    """Return errors and names for each law."""
    rows = []
    for (name, loss), outputs in itertools.product(LAWS.items(), (("level", "temp"), ("temp",))):
        network, law, right, seconds = [], [], 0, 0.0
        for seed in range(1, seeds + 1):
            say(f"{name}, {' and '.join(outputs)}, seed {seed}")
            data = tank_record(loss, seed, outputs)
            began = time.process_time()
            found = estimate(tank_model(outputs), data, starts=3, seed=1)
            read = learned_law(found)
            seconds += time.process_time() - began
            x = np.linspace(max(10.0, read.curve.lower), min(60.0, read.curve.upper), 49)
            learned = network_output(found.model, found.hybrid.term, x[:, None])
            network.append(float(np.abs(learned / loss(x) - 1.0).max()))
            law.append(float(np.abs(read.best(x) / loss(x) - 1.0).max()))
            right += " + ".join(read.names) == name
        worst = (f"{100 * max(errors):.2f} %" for errors in (network, law))
        rows.append((name, " and ".join(outputs), *worst, f"{right} of {seeds}", f"{seconds / seeds:.1f}"))
    header = ("heat loss", "measured", "network, largest error", "law", "right name", "s of processor")
    return Table("Heat loss of a tank, from 10 to 60 K.", header, tuple(rows), "llrrrr")


@dataclass(frozen=True)
class Measured:
    """A measured record with a law to be found, the share of it that is trained, and the unit of the errors."""

    name: str
    data: Dataset
    hybrid: HybridModel
    trained: float
    unit: str
    per_unit: float


def measured(folder: str) -> tuple[Measured, ...]:
    """Return the measured records."""
    level = Dataset.from_file(f"{folder}/two_tank/two_tank.csv", input="pump", output="level", sampling_time=1.2)
    two_tank = OwnModel(
        ["d/dt upper = k*pump - a*sqrt(Abs(upper))", "d/dt lower = a*sqrt(Abs(upper))"],
        {"level": "lower"},
        ["pump"],
        {"k": (1e-5, 0.1), "a": (1e-3, 1.0)},
        values={"k": 3e-3, "a": 0.06},
    )
    heated = Dataset.from_file(
        f"{folder}/heat_exchanger/heat_exchanger.csv", input="flow", output="temperature", sampling_time=1.0
    )
    exchanger = OwnModel(
        ["d/dt T = b*(steam - T) + none*flow"],
        {"temperature": "T"},
        ["flow"],
        {"b": (1e-4, 1.0), "steam": (90.0, 200.0), "none": 0.0},
        values={"b": 0.02, "steam": 110.0},
    )
    moved = load_record("emps", folder)
    # The voltage comes from a controller: it answers to earlier disturbances, of which the position holds the sum. So
    # the output is the speed.
    speed = Dataset.from_arrays(
        input={"voltage": moved.values("controller_voltage")},
        output={"speed": np.gradient(moved.values("position"), moved.sampling_time)},
        sampling_time=moved.sampling_time,
    ).decimate(10, held="voltage")
    slide = OwnModel(
        ["d/dt v = 35.15*voltage/M"], {"speed": "v"}, ["voltage"], {"M": (50.0, 200.0)}, values={"M": 90.0}, substeps=2
    )
    temperature = signal("T")[t]
    return (
        Measured("two_tank", level, embedded(two_tank, {"lower": -1}, [signal("lower")[t]]), 0.6, "mm", 1e-3),
        Measured(
            "heat_exchanger",
            heated,
            embedded(exchanger, {"T": (20 - temperature) / 10}, [signal("flow")[t]]),
            0.5,
            "K",
            1,
        ),
        Measured(
            "emps", speed, embedded(slide, {"v": -1 / slide.parameter("M").symbol}, [signal("v")[t]]), 0.6, "mm/s", 1e-3
        ),
    )


def records(folder: str, say: Callable[[str], None]) -> tuple[Table, tuple[str, ...]]:
    """Return errors on the trained and the held-out part, and the sentences of the laws."""
    rows, sentences = [], []
    for case in measured(folder):
        say(case.name)
        n = case.data.experiments[0].n_samples
        used = [np.arange(n) < case.trained * n]
        began = time.process_time()
        found = estimate(case.hybrid, case.data, used, starts=3, seed=1)
        law = learned_law(found)
        seconds = time.process_time() - began
        channel = case.data.outputs[0]
        for kind, fit in (("network", found.fit), ("law", law.best.fit)):
            error = fit.residual(case.data, channel)[0] / case.per_unit
            parts = (figure(float(np.sqrt(np.mean(part**2)))) for part in (error[used[0]], error[~used[0]]))
            rows.append((case.name, kind, *parts, case.unit, f"{seconds:.0f}"))
        sentences += [f"{case.name}: {law.sentence}", *law.notes, *rivals(case, law)]
    header = ("record", "model", "trained", "held out", "unit", "s of processor")
    return Table("Free-run RMS error.", header, tuple(rows), "llrrlr"), tuple(sentences)


def rivals(case: Measured, law: LearnedLaw) -> tuple[str, ...]:
    """Return how far the free runs of the next best laws are from that of the best one."""
    channel = case.data.outputs[0]
    best = law.best.fit.simulated[0][channel]
    return tuple(
        f"  {' + '.join(other.names)}: {law.best.merit - other.merit:.2g} nats less; its free run differs by "
        f"{figure(float(np.sqrt(np.mean((other.fit.simulated[0][channel] - best) ** 2))) / case.per_unit)} {case.unit}"
        for other in law.tried[1:4]
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, default=3)
    parser.add_argument("--records", help="folder of measured records")
    options = parser.parse_args()

    def say(words: str) -> None:
        print(words, file=sys.stderr, flush=True)

    print(tanks(options.seeds, say))
    if options.records:
        table, sentences = records(options.records, say)
        print(table, *sentences, sep="\n")


if __name__ == "__main__":
    main()
