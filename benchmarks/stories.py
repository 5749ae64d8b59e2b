"""Diagnose the simulated plants of the two theses: ``python -m benchmarks.stories``.

Each plant of table 2 of the hybrid thesis against its first-principles model, the arm's friction against Newton's law
alone, and the clutch's steps against the Hammerstein model of the ramps, at one temperature and at three.  All effects
are tried; the diagnosis sees model, record and noise bound.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from smid import Dataset, Diagnosis, Hammerstein, Model, diagnose
from smid.signals import multisine, qprts
from smid.theses.clutch.plant import ClutchPlant, clutch_record
from smid.theses.hybrid.plants import MISMATCHES, arm_base, reactor_base, simulate_arm, simulate_reactor

Story = tuple[Model, Dataset, float]
EXPECTED = {
    "time_constant": "time_constant",
    "factor": "gain (the factor a)",
    "power": "power_law",
    "two_in_succession": "extra_lag and gain",
    "sine": "output_curve",
    "square_root": "output_curve",
    "time_constant_and_factor": "time_constant and gain",
    "arm": "stribeck_friction, coulomb_friction or viscous_friction",
    "clutch steps, 20 degC": "operating_point, direction_dependence, hysteresis",
    "clutch steps, three temperatures": "those and scheduled_parameter",
}


def reactor(mismatch: str, seed: int = 1) -> Story:
    """Give a row of table 2: 600 samples of 0.5 s under a QPRTS input, noise within 0.004."""
    u = qprts(600, seed=seed, sampling_time=0.5)
    return _story(reactor_base(mismatch), u, simulate_reactor(mismatch, u, 0.5), 0.5, 0.004, seed)


def arm(seed: int = 1) -> Story:
    """Give the arm's speed: 1000 samples of 10 ms under a multisine of 0.25 V, noise within 1.7 % of its deviation."""
    u = multisine(1000, seed=seed, amplitude=0.25, lines=tuple(range(1, 15)))
    speed = simulate_arm(u, 0.01, "speed")
    return _story(arm_base("speed"), u, speed, 0.01, 0.017 * float(np.std(speed)), seed)


def clutch(temperatures: tuple[float, ...], seed: int = 100) -> Story:
    """Give steps of the clutch, 600 samples of 2 ms at each temperature, noise within 0.3 bar."""
    plant = ClutchPlant(temperature=len(temperatures) > 1)
    model = Hammerstein(
        poles=1,
        powers=(5, 4, 3),
        input_scale=0.01,
        unit_dc_gain=True,
        stable=True,
        input="current",
        output="pressure",
    )
    return model, clutch_record("step", temperatures, seed=seed, n=600, plant=plant), 0.3


def _story(
    model: Model, u: NDArray[np.float64], y: NDArray[np.float64], sampling_time: float, bound: float, seed: int
) -> Story:
    noise = bound * np.random.default_rng(seed).uniform(-1, 1, len(u))
    (given,), (shown,) = model.input_channels, model.output_channels
    data = Dataset.from_arrays(input={given: u}, output={shown: y + noise}, sampling_time=sampling_time)
    return model, data, bound


STORIES: dict[str, Callable[[], Story]] = {
    **{name: lambda name=name: reactor(name) for name in MISMATCHES},  # type: ignore[misc]
    "arm": arm,
    "clutch steps, 20 degC": lambda: clutch((20.0,)),
    "clutch steps, three temperatures": lambda: clutch((20.0, 60.0, -20.0)),
}


def row(name: str, diagnosis: Diagnosis, seconds: float) -> str:
    """Give one line of the table."""
    causes = ", then ".join(f"`{c.effect}` ({c.confidence:.0%})" for c in diagnosis.causes) or "nothing"
    gain = diagnosis.gain
    return (
        f"| {name} | {EXPECTED[name]} | {diagnosis.verdict}: {causes} | {gain.rmse_before:.4g} | "
        f"{gain.rmse_after:.4g} | {'yes' if diagnosis.unexplained else 'no'} | {seconds:.0f} |"
    )


def main() -> None:
    """Tell all stories and write the table."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.stories", description=__doc__)
    parser.add_argument("names", nargs="*", metavar="STORY", help=f"of {', '.join(STORIES)}; all by default")
    parser.add_argument("--output", type=Path, default=Path("docs/stories.md"))
    given = parser.parse_args()
    lines = [
        "# Diagnosis of the plants of two theses",
        "",
        "The records are simulated. `smid.diagnose` tests all effects, in two processes.",
        "`python -m benchmarks.stories` writes this table.",
        "",
        "| story | hidden | said | test RMSE: base | extended | more than noise left | s |",
        "|---|---|---|---|---|---|---|",
    ]
    for name in given.names or STORIES:
        model, data, bound = STORIES[name]()
        began = time.perf_counter()
        diagnosis = diagnose(model, data, bound, certify=False, workers=2)
        lines.append(row(name, diagnosis, time.perf_counter() - began))
        print(lines[-1], flush=True)
        print(f"{diagnosis}\n", flush=True)
    given.output.write_text("\n".join(lines) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
