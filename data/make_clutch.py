"""Make the simulated clutch records in the folder ``clutch``; data/README.md describes plants, files and assumptions.

Three plants made them:

- ``hammerstein_*``: the Hammerstein model of the clutch thesis, section 3.2, at three temperatures;
- ``varying_pole_20C_steps``: the actuator of `smid.theses.clutch.plant` whose only difference from that model is a pole
  that depends on the pressure;
- all other records: the whole actuator, from current to pressure (`smid.theses.clutch.plant`) and from pressure to
  position (`smid.theses.clutch.position`), simulated every 0.1 ms and sampled irregularly, about every 2 ms.

Noise is uniform. Its bounds hold for the numbers as they are written, rounding included.

Run ``python data/make_clutch.py`` to write the files again, bit for bit, and to print their SHA-256.
"""

from __future__ import annotations

import hashlib
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import accumulate
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from smid.signals import ramp, step
from smid.theses.clutch import POSITION_NOISE_BOUND, simulate_clutch, simulate_position
from smid.theses.clutch.plant import INPUT_SCALE, NOISE_BOUND, SAMPLING_TIME, ClutchPlant

Array = NDArray[np.float64]

ALPHA_20 = -0.65142  # central estimates of the thesis at 20 degC
GAMMA_20 = (-0.00272, 0.03903, -0.08172)
PLANT = ClutchPlant(level=True, direction=False, hysteresis=False, temperature=False)  # of the varying pole
LAST_DIGIT = 1e-4  # bar, of the short records

DURATION = 10.0  # s, of the actuator's records
TICK = 1e-4  # s, of the simulation and of the stamps
TICKS_PER_SAMPLE = 20
LARGEST_JITTER = 5  # ticks
LARGEST_CURRENT = 950.0  # mA
PRESSURE_STEP, POSITION_STEP = 1e-3, 1e-3  # bar, mm: the last digits written
LAST_TICK = round(DURATION / TICK)
GOLDEN_SECTION = 0.6180339887498949

Corners = tuple[tuple[float, float], ...]

# Corners of the current of short ramps: (samples since the corner before, current in mA).
SHORT_A: Corners = (
    (0, 0), (10, 0), (20, 900), (10, 900), (20, 0), (10, 0),
    (70, 880), (70, 0), (10, 0),
    (12, 900), (8, 900), (40, 300), (20, 700), (30, 0), (10, 0),
    (100, 900), (25, 0), (10, 0),
    (40, 850), (12, 0), (8, 0), (15, 900), (15, 0), (34, 0),
)  # fmt: skip
SHORT_B: Corners = (
    (0, 0), (10, 0), (30, 860), (6, 860), (15, 0), (9, 0),
    (15, 900), (15, 400), (15, 900), (45, 0), (10, 0),
    (120, 920), (10, 920), (60, 0), (10, 0),
    (10, 800), (10, 800), (10, 0), (10, 0),
    (60, 900), (20, 500), (20, 900), (20, 0), (10, 0), (24, 880), (24, 0), (11, 0),
)  # fmt: skip

# Steps of the current: (samples, current in mA). Below 530 mA, about 7 bar, the pole is nearly linear in the pressure.
SHORT_STEPS = (
    (10, 0), (40, 500), (25, 0), (30, 520), (35, 400), (25, 530), (30, 0), (40, 450), (25, 520), (30, 350),
    (25, 520), (30, 0), (20, 530), (35, 450), (30, 0), (20, 510), (25, 380), (30, 0), (25, 500), (30, 400),
    (20, 530), (20, 0),
)  # fmt: skip

# Corners of the current of the actuator's ramps: (seconds since the corner before, current in mA).
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
    """One record: its name, temperature in degC, seed of noise and time stamps, and the text of its file."""

    name: str
    temperature: float
    seed: int
    text: Callable[[Record], str]

    @property
    def profile(self) -> str:
        """Which current it has, such as ``"step_a"``."""
        return self.name.split("C_")[1]

    def render(self) -> str:
        """Return the whole text of the file."""
        return self.text(self)


def uniform(seed: int, length: int) -> Array:
    """Return numbers in [0, 1), from the raw bits of PCG64, which NumPy promises never to change."""
    return np.asarray((np.random.PCG64(seed).random_raw(length) >> np.uint64(11)) * 2.0**-53, dtype=np.float64)


def written(record: Record, facts: Sequence[str], columns: str, rows: Sequence[str]) -> str:
    """Return the text of a file: its label, script and seed, some facts, the names of the columns, the samples."""
    label = ("# SIMULATED clutch record, not a measurement.", f"# Made by data/make_clutch.py, seed {record.seed}.")
    return "\n".join([*label, *(f"# {fact}" for fact in facts), columns, *rows]) + "\n"


def short_record(record: Record, facts: Sequence[str], current: Array, pressure: Array) -> str:
    """Return the text of a record of current and pressure every 2 ms, noise added."""
    noise = (NOISE_BOUND - LAST_DIGIT) * (2.0 * uniform(record.seed, current.size) - 1.0)
    rows = [
        f"{t * SAMPLING_TIME:.3f},{u:.2f},{y:.4f},{record.temperature:.1f}"
        for t, (u, y) in enumerate(zip(current, pressure + noise, strict=True))
    ]
    bound = f"Noise: uniform, |eta| <= {NOISE_BOUND} bar. Sampling time: {SAMPLING_TIME} s."
    return written(record, (*facts, bound), "time [s],current [mA],pressure [bar],temperature [degC]", rows)


def hammerstein(record: Record) -> str:
    """Return the text of a short record of ramps, made by the thesis's Hammerstein model."""
    alpha, gamma = true_parameters(record.temperature)
    corners = {"ramp_a": SHORT_A, "ramp_b": SHORT_B}[record.profile]
    times = np.cumsum([samples for samples, _ in corners])
    current = np.round(np.interp(np.arange(times[-1] + 1), times, [level for _, level in corners]), 2)
    v = INPUT_SCALE * current
    x = ((gamma[0] * v + gamma[1]) * v + gamma[2]) * v * v * v
    w = np.zeros(len(x))
    for t in range(1, len(x)):
        w[t] = -alpha * w[t - 1] + (1.0 + alpha) * x[t - 1]
    facts = (
        "Model: v = 0.01 u; x = gamma1 v^5 + gamma2 v^4 + gamma3 v^3; "
        "w[t] = -alpha w[t-1] + (1 + alpha) x[t-1]; w[0] = 0; y = w + eta.",
        f"True parameters: alpha = {alpha:.5f}, gamma1 = {gamma[0]:.8f}, gamma2 = {gamma[1]:.8f}, "
        f"gamma3 = {gamma[2]:.8f}",
    )
    return short_record(record, facts, current, w)


def true_parameters(temperature: float) -> tuple[float, tuple[float, ...]]:
    """Return alpha and the gammas at a temperature in degC, rounded to the decimals that the files state."""
    viscosity_ratio = math.exp(-(temperature - 20.0) / 25.0)
    tau_ratio = 0.8 + 0.2 * viscosity_ratio
    gain = 1.0 - 0.0005 * (temperature - 20.0)
    alpha = round(-math.exp(math.log(-ALPHA_20) / tau_ratio), 5)
    return alpha, tuple(round(gain * gamma, 8) for gamma in GAMMA_20)


def short_steps() -> Array:
    """Return the current of the short steps in mA."""
    return np.concatenate([np.full(samples, float(level)) for samples, level in SHORT_STEPS])


def varying_pole(record: Record) -> str:
    """Return the text of the short record of steps, made by the plant whose pole depends on the pressure."""
    current = short_steps()
    facts = ("Plant: the model of the ramps, but with a pole that depends on the pressure (smid.theses.clutch.plant).",)
    return short_record(record, facts, current, simulate_clutch(current, record.temperature, PLANT))


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
    """Return the current of a profile of the actuator in mA, every 0.1 ms."""
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
    """Return current in mA, pressure in bar and position in mm of the actuator, every 0.1 ms, without noise."""
    current = current_of(record.profile)
    pressure = simulate_clutch(current, record.temperature, sampling_time=TICK)
    return current, pressure, simulate_position(pressure, record.temperature, sampling_time=TICK)


def actuator(record: Record) -> str:
    """Return the text of a record of the whole actuator."""
    stamps = stamps_of(record)
    current, pressure, position = (values[stamps] for values in truth_of(record))
    noise = 2.0 * uniform(record.seed + 100, 2 * stamps.size).reshape(2, -1) - 1.0
    pressure = pressure + (NOISE_BOUND - PRESSURE_STEP) * noise[0]
    position = position + (POSITION_NOISE_BOUND - POSITION_STEP) * noise[1]
    facts = (
        "Plant: smid.theses.clutch.plant with all its ingredients, then smid.theses.clutch.position.",
        f"Noise: uniform, within {NOISE_BOUND} bar and {POSITION_NOISE_BOUND} mm. Sampling: irregular, about 2 ms.",
    )
    rows = [
        f"{t * TICK:.4f},{u:.1f},{p:.3f},{x:.3f},{record.temperature:.0f}"
        for t, u, p, x in zip(stamps, current, pressure, position, strict=True)
    ]
    return written(record, facts, "time [s],current [mA],pressure [bar],position [mm],temperature [degC]", rows)


RECORDS = (
    Record("20C_ramp_a", 20.0, 20001, actuator),
    Record("20C_ramp_b", 20.0, 20002, actuator),
    Record("20C_step_a", 20.0, 20003, actuator),
    Record("20C_step_b", 20.0, 20004, actuator),
    Record("60C_ramp_a", 60.0, 60001, actuator),
    Record("60C_ramp_b", 60.0, 60002, actuator),
    Record("60C_step_a", 60.0, 60003, actuator),
    Record("60C_step_c", 60.0, 60004, actuator),
    Record("m20C_ramp_a", -20.0, 10001, actuator),
    Record("m20C_step_a", -20.0, 10003, actuator),
    Record("m20C_step_c", -20.0, 10004, actuator),
    Record("hammerstein_20C_ramp_a", 20.0, 2001, hammerstein),
    Record("hammerstein_20C_ramp_b", 20.0, 2002, hammerstein),
    Record("hammerstein_60C_ramp_a", 60.0, 6001, hammerstein),
    Record("hammerstein_60C_ramp_b", 60.0, 6002, hammerstein),
    Record("hammerstein_m20C_ramp_a", -20.0, 1001, hammerstein),
    Record("varying_pole_20C_steps", 20.0, 2003, varying_pole),
)


def main() -> None:
    """Write every record into the folder and print its SHA-256."""
    folder = Path(__file__).resolve().parent / "clutch"
    folder.mkdir(exist_ok=True)
    for record in RECORDS:
        content = record.render().encode("ascii")
        (folder / f"{record.name}.csv").write_bytes(content)
        print(hashlib.sha256(content).hexdigest(), f"clutch/{record.name}.csv")


if __name__ == "__main__":
    main()
