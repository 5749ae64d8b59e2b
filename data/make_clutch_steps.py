"""Make the simulated clutch step record in this folder.

The ramps were made by the Hammerstein model of the clutch thesis (make_clutch_ramps.py). On steps that model fails:
there the thesis found a pole of 0.9562 instead of 0.65142 (equation 3.22, section 3.2). This record comes from
`smid.theses.clutch.plant`, the same actuator with one thing more: its pole depends on the pressure, slow near zero
and fast above, ::

    d p/dt = (x - p) / tau(p),   tau(p) = fast + (slow - fast) exp(-p / 3 bar)

with the thesis's poles as ends. That it is the pressure that decides, and the 3 bar, are assumptions of ours. The
dependence on direction and the hysteresis of that plant are switched off, so that there is one thing to find.

The steps stay below 530 mA, about 7 bar. Over a wider range a pole that moves in proportion to the pressure is no
longer close to this plant, and a diagnosis names a second effect for the rest.

Run ``python data/make_clutch_steps.py`` to write the file again and to print its SHA-256.
"""

from __future__ import annotations

import hashlib
from pathlib import Path

import numpy as np
from make_clutch_ramps import NOISE_BOUND, SAMPLING_TIME, uniform_noise
from numpy.typing import NDArray

from smid.theses.clutch.plant import ClutchPlant, simulate_clutch

FILE_NAME = "clutch_20C_steps.csv"
TEMPERATURE = 20.0  # degC
SEED = 2003
PLANT = ClutchPlant(level=True, direction=False, hysteresis=False, temperature=False)

# Steps of the current: (samples, current in mA).
STEPS = (
    (10, 0), (40, 500), (25, 0), (30, 520), (35, 400), (25, 530), (30, 0), (40, 450), (25, 520), (30, 350),
    (25, 520), (30, 0), (20, 530), (35, 450), (30, 0), (20, 510), (25, 380), (30, 0), (25, 500), (30, 400),
    (20, 530), (20, 0),
)  # fmt: skip


def step_current() -> NDArray[np.float64]:
    """Return the current in mA."""
    return np.concatenate([np.full(samples, float(level)) for samples, level in STEPS])


def columns() -> tuple[NDArray[np.float64], NDArray[np.float64], float]:
    """Return current in mA, measured pressure in bar, and the temperature in degC."""
    current = step_current()
    return current, simulate_clutch(current, TEMPERATURE, PLANT) + uniform_noise(SEED, len(current)), TEMPERATURE


def render() -> str:
    """Return the whole text of the file."""
    current, pressure, temperature = columns()
    header = [
        "# SIMULATED clutch record, not a measurement.",
        f"# Made by data/make_clutch_steps.py, seed {SEED}.",
        "# Plant: the model of the ramps, but with a pole that depends on the pressure (smid.theses.clutch.plant).",
        f"# Noise: uniform, |eta| <= {NOISE_BOUND} bar. Sampling time: {SAMPLING_TIME} s.",
        "time [s],current [mA],pressure [bar],temperature [degC]",
    ]
    rows = [
        f"{t * SAMPLING_TIME:.3f},{u:.2f},{y:.4f},{temperature:.1f}"
        for t, (u, y) in enumerate(zip(current, pressure, strict=True))
    ]
    return "\n".join([*header, *rows]) + "\n"


def main() -> None:
    """Write the record beside this script and print its SHA-256."""
    content = render().encode("ascii")
    (Path(__file__).resolve().parent / FILE_NAME).write_bytes(content)
    print(hashlib.sha256(content).hexdigest(), FILE_NAME)


if __name__ == "__main__":
    main()
