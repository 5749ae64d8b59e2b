"""Time and error of a white model and of networks of up to hundreds of weights, for the heat loss of a tank.

    python -m benchmarks.hybrid_size [--cache FILE]

The record, 1000 samples of level and temperature with noise, is that of `benchmarks.unknown_laws`; the loss is 55 W
(T - 18 degC)^1.25. The white model knows this law but not its two numbers. Each network has one start and 100
iterations. Printed are processor seconds, the free-run RMSE of the temperature on a second record, and the largest
error of the law from 12 to 50 K. Every result is kept at once, and a further run leaves out what is there.
"""

from __future__ import annotations

import argparse
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from benchmarks.resumable import kept, run
from benchmarks.unknown_laws import AREA, HEAT, LAWS, ROOM, tank_model, tank_record
from smid import OwnModel, validate
from smid.display.table import Table
from smid.fitting.binding import bind
from smid.fitting.fit import fit
from smid.hybrid import embedded, estimate, network_output
from smid.models import signal, t

BOTH, LAW = ("level", "temp"), "power_law"
SIZES: dict[str, tuple[int, ...] | None] = {
    "white, law known": None,
    "3": (3,),
    "10": (10,),
    "30": (30,),
    "100": (100,),
    "10, 10": (10, 10),
    "20, 10": (20, 10),
}


@dataclass(frozen=True)
class Sized:
    """What one model reached."""

    name: str
    free: int
    seconds: float
    rmse: float
    law: float


def sized(name: str) -> Sized:
    """Estimate one model."""
    data, other = tank_record(LAWS[LAW], 1, BOTH), tank_record(LAWS[LAW], 2, BOTH)
    x, hidden = np.linspace(12.0, 50.0, 50), SIZES[name]
    began = time.process_time()
    if hidden is None:
        balance = "d/dt T = (power + 4.18e6*inflow*(15 - T) - F*(T - 18)**p) / (4.18e6*0.1*h)"
        white = OwnModel(
            ["d/dt h = (inflow - k*sqrt(h)) / 0.1", balance],
            {"level": "h", "temp": "T"},
            ["inflow", "power"],
            {"k": (1e-5, 1e-4), "F": (1.0, 1000.0), "p": (0.5, 2.5)},
            values={"k": 3e-5, "F": 150.0, "p": 1.0},
        )
        found = fit(bind(white, data), data, starts=1)
        model, free = found.model, found.n_free
        learned = model.values["F"] * x ** model.values["p"]
    else:
        white = tank_model(BOTH).white
        place = -1 / (HEAT * AREA * signal("h")[t])
        hybrid = embedded(white, {"T": place}, [signal("T")[t] - ROOM], hidden)
        result = estimate(hybrid, data, starts=1, iterations=100, seed=1)
        model, free = result.model, result.fit.n_free
        learned = network_output(model, result.hybrid.term, x[:, None])
    seconds = time.process_time() - began
    rmse = next(score.rmse for score in validate(model, other).scores if score.channel == "temp")
    return Sized(name, free, seconds, float(rmse), float(np.abs(learned / LAWS[LAW](x) - 1.0).max()))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cache", type=Path, default=Path(".cache/hybrid_size.jsonl"))
    options = parser.parse_args()
    found = {entry["name"]: Sized(**entry) for entry in kept(options.cache)}
    missing = [(name,) for name in SIZES if name not in found]
    found |= {one.name: one for one in run(options.cache, sized, missing, 1)}
    rows = tuple(
        (name, str(one.free), f"{one.seconds:.1f}", f"{one.rmse:.3g}", f"{100 * one.law:.2g} %")
        for name, one in ((name, found[name]) for name in SIZES)
    )
    header = ("neurons", "free numbers", "s of processor", "temperature, other record [K]", "law")
    print(Table("Heat loss of a tank.", header, rows, "lrrrr"))


if __name__ == "__main__":
    main()
