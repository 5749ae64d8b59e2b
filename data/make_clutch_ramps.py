"""Make the simulated clutch ramp records in this folder.

The model is the Hammerstein model of a dual clutch actuator, from current to pressure::

    v[t] = 0.01 u[t]                                                scaled current
    x[t] = gamma1 v[t]^5 + gamma2 v[t]^4 + gamma3 v[t]^3            static curve with a dead zone
    w[t] = -alpha w[t-1] + (1 + alpha) x[t-1],   w[0] = 0           one pole, unit DC gain
    y[t] = w[t] + eta[t],   |eta[t]| <= 0.3 bar                     measured pressure

The values at 20 degC are the central estimate of the clutch thesis, section 3.2. The thesis used measured
records, which are not public. These are simulated, and say so in their first line.

Temperature enters by an assumption of ours, not by a measurement:

- Oil thins out when it warms: ``viscosity(T) / viscosity(20) = exp(-(T - 20) / 25)``.
- The time constant is a resistance times a capacity. At 20 degC, 80 % of the resistance is orifice flow and
  does not feel viscosity; 20 % is laminar, and proportional to it. So
  ``tau(T) / tau(20) = 0.8 + 0.2 viscosity(T) / viscosity(20)`` and ``alpha = -exp(-T_s / tau)``.
- Warm oil leaks a little more: every gamma is multiplied by ``1 - 0.0005 (T - 20)``.

The current goes up and down in ramps of many slopes. The steep ramps fix the pole: on a slow one, a change of
the pole moves the pressure by less than the noise. The slow ramps fix the curve.

Run ``python data/make_clutch_ramps.py`` to write the files again, bit for bit, and to print their SHA-256.
"""

from __future__ import annotations

import hashlib
import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

SAMPLING_TIME = 2e-3  # s
INPUT_SCALE = 0.01  # 1/mA
NOISE_BOUND = 0.3  # bar
PRESSURE_STEP = 1e-4  # bar, the last digit written
ALPHA_20 = -0.65142
GAMMA_20 = (-0.00272, 0.03903, -0.08172)

# Corners of the current: (samples since the corner before, current in mA).
Corners = tuple[tuple[int, float], ...]

RAMP_A: Corners = (
    (0, 0), (10, 0), (20, 900), (10, 900), (20, 0), (10, 0),
    (70, 880), (70, 0), (10, 0),
    (12, 900), (8, 900), (40, 300), (20, 700), (30, 0), (10, 0),
    (100, 900), (25, 0), (10, 0),
    (40, 850), (12, 0), (8, 0), (15, 900), (15, 0), (34, 0),
)  # fmt: skip
RAMP_B: Corners = (
    (0, 0), (10, 0), (30, 860), (6, 860), (15, 0), (9, 0),
    (15, 900), (15, 400), (15, 900), (45, 0), (10, 0),
    (120, 920), (10, 920), (60, 0), (10, 0),
    (10, 800), (10, 800), (10, 0), (10, 0),
    (60, 900), (20, 500), (20, 900), (20, 0), (10, 0), (24, 880), (24, 0), (11, 0),
)  # fmt: skip


@dataclass(frozen=True)
class Record:
    """One record to simulate: its file, temperature in degC, seed and current profile."""

    file_name: str
    temperature: float
    seed: int
    corners: Corners


RECORDS = (
    Record("clutch_20C_ramp_a.csv", 20.0, 2001, RAMP_A),
    Record("clutch_20C_ramp_b.csv", 20.0, 2002, RAMP_B),
    Record("clutch_60C_ramp_a.csv", 60.0, 6001, RAMP_A),
    Record("clutch_60C_ramp_b.csv", 60.0, 6002, RAMP_B),
    Record("clutch_m20C_ramp_a.csv", -20.0, 1001, RAMP_A),
)


def pole_parameter(temperature: float) -> float:
    """Return alpha at a temperature in degC, rounded to the five decimals that the files state."""
    viscosity_ratio = math.exp(-(temperature - 20.0) / 25.0)
    tau_ratio = 0.8 + 0.2 * viscosity_ratio
    return round(-math.exp(math.log(-ALPHA_20) / tau_ratio), 5)


def curve_parameters(temperature: float) -> tuple[float, ...]:
    """Return gamma1, gamma2, gamma3 at a temperature in degC, rounded to eight decimals."""
    gain = 1.0 - 0.0005 * (temperature - 20.0)
    return tuple(round(gain * gamma, 8) for gamma in GAMMA_20)


def ramp_current(corners: Corners) -> NDArray[np.float64]:
    """Return the current in mA, straight between the corners, rounded to 0.01 mA as it is written."""
    corner_times = np.cumsum([samples for samples, _ in corners])
    levels = [level for _, level in corners]
    return np.round(np.interp(np.arange(corner_times[-1] + 1), corner_times, levels), 2)


def simulate_pressure(current: NDArray[np.float64], alpha: float, gamma: tuple[float, ...]) -> NDArray[np.float64]:
    """Return the noise-free pressure w in bar, from rest."""
    v = INPUT_SCALE * current
    x = ((gamma[0] * v + gamma[1]) * v + gamma[2]) * v * v * v
    w = np.zeros(len(x))
    for t in range(1, len(x)):
        w[t] = -alpha * w[t - 1] + (1.0 + alpha) * x[t - 1]
    return w


def uniform_noise(seed: int, length: int) -> NDArray[np.float64]:
    """Return noise in bar that stays within the bound after the pressure is rounded.

    It is made from the raw bits of PCG64, which NumPy promises never to change; it does not promise that for
    ``Generator.uniform``.
    """
    unit = (np.random.PCG64(seed).random_raw(length) >> np.uint64(11)) * 2.0**-53
    return np.asarray((NOISE_BOUND - PRESSURE_STEP) * (2.0 * unit - 1.0), dtype=np.float64)


def render(record: Record) -> str:
    """Return the whole text of a record's file."""
    alpha = pole_parameter(record.temperature)
    gamma = curve_parameters(record.temperature)
    current = ramp_current(record.corners)
    pressure = simulate_pressure(current, alpha, gamma) + uniform_noise(record.seed, len(current))
    header = [
        "# SIMULATED clutch record, not a measurement.",
        f"# Made by data/make_clutch_ramps.py, seed {record.seed}.",
        "# Model: v = 0.01 u; x = gamma1 v^5 + gamma2 v^4 + gamma3 v^3; "
        "w[t] = -alpha w[t-1] + (1 + alpha) x[t-1]; w[0] = 0; y = w + eta.",
        f"# True parameters: alpha = {alpha:.5f}, gamma1 = {gamma[0]:.8f}, gamma2 = {gamma[1]:.8f}, "
        f"gamma3 = {gamma[2]:.8f}",
        f"# Noise: uniform, |eta| <= {NOISE_BOUND} bar. Sampling time: {SAMPLING_TIME} s.",
        "time [s],current [mA],pressure [bar],temperature [degC]",
    ]
    rows = [
        f"{t * SAMPLING_TIME:.3f},{u:.2f},{y:.4f},{record.temperature:.1f}"
        for t, (u, y) in enumerate(zip(current, pressure, strict=True))
    ]
    return "\n".join([*header, *rows]) + "\n"


def main() -> None:
    """Write every record beside this script and print its SHA-256."""
    folder = Path(__file__).resolve().parent
    for record in RECORDS:
        content = render(record).encode("ascii")
        (folder / record.file_name).write_bytes(content)
        print(hashlib.sha256(content).hexdigest(), record.file_name)


if __name__ == "__main__":
    main()
