"""Simulate the record `tank/heated_tank.csv`: a tank that is heated and flushed, as a plant historian exports it.

The balance of heat is solved exactly between two samples; no formula of smid is used.
"""

from datetime import datetime, timedelta
from pathlib import Path

import numpy as np

VOLUME, INLET, HEAT = 90.0, 14.0, 4.186  # l, °C, kJ/(l K)
DEAD_ZONE = 4.0  # kW: less than this does not arrive in the water
SAMPLES, INTERVAL = 240, 30.0  # s
NOISE = 0.19  # °C; with the rounding to 0.01 °C the noise keeps the bound of 0.2 °C
HEADER = "Zeit;FI-101 Durchfluss;JI-102 Heizung;TI-103 Temperatur;Status\r\n;l/min;kW;°C;\r\n"


def render() -> str:
    """Return the text of the record."""
    rng = np.random.default_rng(7)
    flow = np.round(np.repeat(rng.uniform(4, 12, 40), 9)[:SAMPLES], 2)
    power = np.round(np.repeat(rng.uniform(1, 28, 60), 5)[:SAMPLES], 2)
    temperature = [38.0]
    for litres, kilowatt in zip(flow[:-1], power[:-1], strict=True):
        rate = litres / 60 / VOLUME
        final = INLET + max(kilowatt - DEAD_ZONE, 0.0) / (VOLUME * HEAT * rate)
        temperature.append(final + (temperature[-1] - final) * np.exp(-INTERVAL * rate))
    measured = np.array(temperature) + rng.uniform(-NOISE, NOISE, SAMPLES)
    missing = {*rng.choice(np.arange(5, SAMPLES), 6, replace=False).tolist(), 101, 102, 103}
    begin = datetime(2025, 3, 12, 6)
    rows = ""
    for k in range(SAMPLES):
        reading = "" if k in missing else f"{measured[k]:.2f}"
        row = f"{(begin + timedelta(seconds=k * INTERVAL)).isoformat()};{flow[k]:.2f};{power[k]:.2f};{reading};Good\r\n"
        rows += row.replace(".", ",")
    return HEADER + rows


if __name__ == "__main__":
    folder = Path(__file__).resolve().parent / "tank"
    folder.mkdir(exist_ok=True)
    (folder / "heated_tank.csv").write_bytes(render().encode("cp1252"))
