"""New records of the whole actuator: current, pressure, position and temperature."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from smid.data import Channel, Dataset, Experiment
from smid.theses.clutch.plant import NOISE_BOUND, SAMPLING_TIME, ClutchPlant, simulate_clutch
from smid.theses.clutch.position import POSITION_NOISE_BOUND, ReturnSpring, simulate_position

__all__ = ["actuator_record"]


def actuator_record(
    current: ArrayLike,
    temperature: float = 20.0,
    *,
    seed: int | np.random.Generator,
    name: str = "actuator",
    plant: ClutchPlant | None = None,
    spring: ReturnSpring | None = None,
) -> Dataset:
    """Simulate a measured record of the whole actuator, with the channels of `smid.data.bundled.load_clutch`.

    Parameters
    ----------
    current
        Shape (n,). In mA, every 2 ms.
    temperature
        Of oil and spring, in degC.
    seed
        Of the noise of pressure (within 0.3 bar) and position (within 0.05 mm).
    plant
        From current to pressure; by default with all effects.
    spring
        From pressure to position; by default that of the bundled records.

    Raises
    ------
    DataError
        If the current is not a finite series, or the temperature is not valid.

    Examples
    --------
    >>> data = actuator_record(np.repeat([0.0, 900.0], 200), seed=1)
    >>> data.outputs, round(float(data.values("position").max()), 1)
    (('pressure', 'position'), 8.5)
    """
    u = np.asarray(current, dtype=np.float64)
    pressure = simulate_clutch(u, temperature, plant)
    position = simulate_position(pressure, temperature, spring)
    generator = np.random.default_rng(seed)
    values = {
        "current": u,
        "pressure": pressure + generator.uniform(-NOISE_BOUND, NOISE_BOUND, u.size),
        "position": position + generator.uniform(-POSITION_NOISE_BOUND, POSITION_NOISE_BOUND, u.size),
        "temperature": np.full(u.size, float(temperature)),
    }
    units = (("current", "mA"), ("pressure", "bar"), ("position", "mm"), ("temperature", "degC"))
    return Dataset(
        experiments=(Experiment(name, values),),
        channels=tuple(Channel(channel, unit) for channel, unit in units),
        inputs=("current",),
        outputs=("pressure", "position"),
        sampling_time=SAMPLING_TIME,
        source="simulated clutch actuator",
    )
