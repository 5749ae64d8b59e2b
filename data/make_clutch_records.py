"""Make the simulated records of current, pressure and position in the folder ``clutch``.

The names are those of the data sets of the clutch thesis (figures 3.3, 3.4 and 3.13 to 3.20), which are not public.
The plant is the same for all: `smid.theses.clutch.plant` with all its ingredients, then
`smid.theses.clutch.position`.  What differs is the current and the temperature:

- ``ramp_a`` and ``ramp_b`` go up and down at many slopes; ``ramp_b`` turns half way more often.
- ``step_a`` rises from zero to one or two levels, and falls to zero.  The position then always settles from below.
- ``step_b`` and ``step_c`` go from level to level, up and down, and so run through loops of all sizes: these are the
  thesis's sets "with hysteresis".

A record runs for 10 s.  The plant is simulated every 0.1 ms, and what was measured is written about every 2 ms: each
stamp lies within 0.5 ms of its instant.  Noise is uniform, and its bounds hold for the numbers as they are written.

Run ``python data/make_clutch_records.py`` to write the files again, bit for bit, and to print their SHA-256.
"""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from itertools import accumulate
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from smid.signals import ramp, step
from smid.theses.clutch import POSITION_NOISE_BOUND, simulate_clutch, simulate_position
from smid.theses.clutch.plant import NOISE_BOUND

Array = NDArray[np.float64]

DURATION = 10.0  # s
TICK = 1e-4  # s, of the simulation and of the stamps
TICKS_PER_SAMPLE = 20
LARGEST_JITTER = 5  # ticks
LARGEST_CURRENT = 950.0  # mA
PRESSURE_STEP, POSITION_STEP = 1e-3, 1e-3  # bar, mm: the last digits written
LAST_TICK = round(DURATION / TICK)
GOLDEN_SECTION = 0.6180339887498949

# Corners of the current: (seconds since the corner before, current in mA).
Corners = tuple[tuple[float, float], ...]

RAMP_A: Corners = (
    (0.1, 0), (1.0, 900), (0.2, 900), (1.0, 0), (0.2, 0),
    (0.4, 850), (0.1, 850), (0.4, 0), (0.2, 0),
    (0.1, 700), (0.1, 700), (0.1, 0), (0.2, 0),
    (0.5, 550), (0.5, 0), (0.2, 0),
    (0.3, 950), (0.3, 350), (0.3, 950), (0.5, 0), (0.2, 0),
    (0.6, 450), (0.2, 450), (0.4, 800), (0.1, 800), (0.6, 300), (0.2, 300), (0.4, 0), (0.3, 0),
)  # fmt: skip
RAMP_B: Corners = (
    (0.1, 0), (0.6, 920), (0.1, 920), (0.4, 400), (0.3, 700), (0.3, 350), (0.5, 850), (0.6, 0), (0.2, 0),
    (0.15, 600), (0.1, 600), (0.3, 250), (0.2, 650), (0.2, 300), (0.2, 500), (0.3, 0), (0.2, 0),
    (0.8, 800), (0.1, 800), (0.2, 600), (0.3, 900), (0.1, 900), (0.9, 0), (0.3, 0),
    (0.25, 450), (0.25, 380), (0.25, 520), (0.25, 400), (0.25, 580), (0.3, 0), (0.4, 0), (0.4, 750), (0.2, 0),
)  # fmt: skip


@dataclass(frozen=True)
class Record:
    """One record to simulate: its name, temperature in degC, and the seed of its noise and time stamps."""

    name: str
    temperature: float
    seed: int

    @property
    def profile(self) -> str:
        """Which current it has, such as ``"step_a"``."""
        return self.name.split("_", 1)[1]


RECORDS = (
    Record("20C_ramp_a", 20.0, 20001),
    Record("20C_ramp_b", 20.0, 20002),
    Record("20C_step_a", 20.0, 20003),
    Record("20C_step_b", 20.0, 20004),
    Record("60C_ramp_a", 60.0, 60001),
    Record("60C_ramp_b", 60.0, 60002),
    Record("60C_step_a", 60.0, 60003),
    Record("60C_step_c", 60.0, 60004),
    Record("m20C_ramp_a", -20.0, 10001),
    Record("m20C_step_a", -20.0, 10003),
    Record("m20C_step_c", -20.0, 10004),
)


def uniform(seed: int, length: int) -> Array:
    """Return numbers in [0, 1), from the raw bits of PCG64, which NumPy promises never to change."""
    return np.asarray((np.random.PCG64(seed).random_raw(length) >> np.uint64(11)) * 2.0**-53, dtype=np.float64)


def ramps(corners: Corners) -> Array:
    """Return a current in mA, straight between the corners."""
    times = accumulate(wait for wait, _ in corners)
    points = [(time, level / LARGEST_CURRENT) for time, (_, level) in zip(times, corners, strict=True)]
    return ramp(LAST_TICK + 1, corners=points, sampling_time=TICK, amplitude=LARGEST_CURRENT)


def excursions() -> Array:
    """Return a current in mA that rises from zero to one or two levels between 300 and 950 mA, and falls to zero.

    The levels are spread evenly over the range, in an order that is neither rising nor falling (golden section).
    """
    levels, time, k = [], 0.1, 0
    while time < DURATION - 0.6:
        top = 300.0 + 650.0 * (k * GOLDEN_SECTION % 1.0)
        if k % 3 == 2:
            levels.append((time, round(0.5 * (300.0 + top))))
            time += 0.15
        levels += [(time, round(top)), (time + 0.25, 0)]
        time += 0.4
        k += 1
    return step(LAST_TICK + 1, levels=levels, sampling_time=TICK)


def walk(seed: int) -> Array:
    """Return a current in mA of steps up and down between 300 and 950 mA, every tenth to zero."""
    levels, time = [], 0.1
    for k, (height, wait) in enumerate(uniform(seed, 200).reshape(-1, 2)):
        if time > DURATION - 0.4:
            break
        levels.append((time, 0 if k % 10 == 9 else round(300.0 + 650.0 * height)))
        time += round(0.1 + 0.12 * wait, 3)
    return step(LAST_TICK + 1, levels=[*levels, (time, 0)], sampling_time=TICK)


def current_of(profile: str) -> Array:
    """Return the current of a profile in mA, every 0.1 ms."""
    currents = {
        "ramp_a": lambda: ramps(RAMP_A),
        "ramp_b": lambda: ramps(RAMP_B),
        "step_a": excursions,
        "step_b": lambda: walk(11),
        "step_c": lambda: walk(12),
    }
    return np.round(currents[profile](), 1)


def stamps_of(record: Record) -> NDArray[np.int64]:
    """Return the instants of the samples in ticks; the first and the last are exact."""
    nominal = TICKS_PER_SAMPLE * np.arange(LAST_TICK // TICKS_PER_SAMPLE + 1)
    jitter = np.floor((2 * LARGEST_JITTER + 1) * uniform(record.seed, nominal.size)).astype(np.int64) - LARGEST_JITTER
    jitter[[0, -1]] = 0
    return nominal + jitter


def truth_of(record: Record) -> tuple[Array, Array, Array]:
    """Return current in mA, pressure in bar and position in mm, every 0.1 ms, without noise."""
    current = current_of(record.profile)
    pressure = simulate_clutch(current, record.temperature, sampling_time=TICK)
    return current, pressure, simulate_position(pressure, record.temperature, sampling_time=TICK)


def render(record: Record) -> str:
    """Return the whole text of a record's file."""
    stamps = stamps_of(record)
    current, pressure, position = (values[stamps] for values in truth_of(record))
    noise = 2.0 * uniform(record.seed + 100, 2 * stamps.size).reshape(2, -1) - 1.0
    pressure = pressure + (NOISE_BOUND - PRESSURE_STEP) * noise[0]
    position = position + (POSITION_NOISE_BOUND - POSITION_STEP) * noise[1]
    header = [
        "# SIMULATED clutch record, not a measurement.",
        f"# Made by data/make_clutch_records.py, seed {record.seed}.",
        "# Plant: smid.theses.clutch.plant with all its ingredients, then smid.theses.clutch.position.",
        f"# Noise: uniform, within {NOISE_BOUND} bar and {POSITION_NOISE_BOUND} mm. Sampling: irregular, about 2 ms.",
        "time [s],current [mA],pressure [bar],position [mm],temperature [degC]",
    ]
    rows = [
        f"{t * TICK:.4f},{u:.1f},{p:.3f},{x:.3f},{record.temperature:.0f}"
        for t, u, p, x in zip(stamps, current, pressure, position, strict=True)
    ]
    return "\n".join([*header, *rows]) + "\n"


def main() -> None:
    """Write every record into the folder and print its SHA-256."""
    folder = Path(__file__).resolve().parent / "clutch"
    folder.mkdir(exist_ok=True)
    for record in RECORDS:
        content = render(record).encode("ascii")
        (folder / f"{record.name}.csv").write_bytes(content)
        print(hashlib.sha256(content).hexdigest(), f"clutch/{record.name}.csv")


if __name__ == "__main__":
    main()
