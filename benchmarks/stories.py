"""Diagnose the simulated plants of the two theses: ``python -m benchmarks.stories``.

Each plant of table 2 of the hybrid thesis against its first-principles model, the arm's friction against Newton's law
alone, and the clutch's steps against the Hammerstein model of the ramps, at one temperature and at three. All effects
are tried; the diagnosis sees model, record and noise bound. Each result is kept in the cache, so an interrupted run
goes on where it stopped; delete the cache when the diagnosis has changed.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from benchmarks.machine import described
from benchmarks.processor_time import in_processor_time
from benchmarks.resumable import kept
from benchmarks.resumable import run as kept_run
from smid import Dataset, Hammerstein, Model, diagnose
from smid.signals import multisine, qprts
from smid.theses.clutch.plant import ClutchPlant, clutch_record
from smid.theses.hybrid.plants import MISMATCHES, arm_base, reactor_base, simulate_arm, simulate_reactor

Story = tuple[Model, Dataset, float]
SECONDS = 600.0  # processor time of a diagnosis, in one process
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


@dataclass(frozen=True)
class Told:
    """What the diagnosis says of a story, with the test RMSE of the base model and of the extended one."""

    story: str
    verdict: str
    causes: str
    before: float
    after: float
    unexplained: bool
    interrupted: bool
    seconds: float


def told(name: str) -> Told:
    """Diagnose a story in this process."""
    model, data, bound = STORIES[name]()
    with in_processor_time():
        found = diagnose(model, data, bound, certify=False, workers=1, seconds=SECONDS)
    causes = ", then ".join(f"`{c.effect}` ({c.confidence:.0%})" for c in found.causes) or "nothing"
    gain = found.gain
    left = found.unexplained, found.interrupted, found.seconds
    return Told(name, str(found.verdict), causes, gain.rmse_before, gain.rmse_after, *left)


def page(results: Sequence[Told]) -> str:
    """Return the table as Markdown."""
    lines = [
        "# Diagnosis of the plants of two theses",
        "",
        "The records are simulated. `smid.diagnose` tests all effects. `python -m benchmarks.stories` writes this. "
        f"A diagnosis has {SECONDS:g} s of processor time in one process, of which the search has four fifths.",
        "",
        "| story | hidden | said | test RMSE: base | extended | more than noise left | s |",
        "|---|---|---|---|---|---|---|",
    ]
    for r in sorted(results, key=lambda r: [*STORIES].index(r.story)):
        left, seconds = "yes" if r.unexplained else "no", f"{r.seconds:.0f}" + ", ended by time" * r.interrupted
        errors = f"{r.before:.4g} | {r.after:.4g}"
        lines.append(f"| {r.story} | {EXPECTED[r.story]} | {r.verdict}: {r.causes} | {errors} | {left} | {seconds} |")
    return "\n".join([*lines, "", described(("numpy", "scipy"))]) + "\n"


def main() -> None:
    """Tell all stories and write the table."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.stories", description=__doc__)
    parser.add_argument("names", nargs="*", metavar="STORY", help=f"of {', '.join(STORIES)}; all by default")
    parser.add_argument("--workers", type=int, default=1)
    parser.add_argument("--cache", type=Path, default=Path(".cache/stories.jsonl"))
    parser.add_argument("--output", type=Path, default=Path("docs/stories.md"))
    given = parser.parse_args()
    results = [r for r in (Told(**entry) for entry in kept(given.cache)) if r.story in (given.names or STORIES)]
    done = {r.story for r in results}
    missing = [(name,) for name in given.names or STORIES if name not in done]
    for result in kept_run(given.cache, told, missing, given.workers):
        results.append(result)
        print(result, flush=True)
    given.output.write_text(page(results), encoding="utf-8")
    print(page(results))


if __name__ == "__main__":
    main()
