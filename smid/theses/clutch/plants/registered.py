"""The plants by name, and their records."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace

import numpy as np

from relaxations.algebra.arrays import Array
from smid.data import Dataset
from smid.data.bundled import CLUTCH_RECORDS, load_clutch
from smid.data.channel import name_hint
from smid.models import ModelError
from smid.theses.clutch.plant import NOISE_BOUND, SAMPLING_TIME, simulate_clutch
from smid.theses.clutch.plants.backlash import backlash
from smid.theses.clutch.plants.bouc_wen import bouc_wen
from smid.theses.clutch.plants.lugre import lugre
from smid.theses.clutch.plants.piston import Piston
from smid.theses.clutch.plants.preisach import preisach
from smid.theses.clutch.plants.warm_friction import warm_friction
from smid.theses.clutch.position import POSITION_NOISE_BOUND, simulate_position

__all__ = ["PLANTS", "plant_records"]

TICKS = 20  # of the simulation, per sample

Plant = Callable[[Array, float, float], Array]

PLANTS: Mapping[str, Plant] = {
    "Dahl": lambda p, t, interval: simulate_position(p, t, sampling_time=interval),
    "Bouc-Wen": lambda p, t, interval: Piston(t).moved(bouc_wen(p), interval),
    "Preisach": lambda p, t, interval: Piston(t).moved(preisach(p), interval),
    "rate": lambda p, t, interval: lugre(Piston(t), p, interval),
    "backlash": lambda p, t, interval: backlash(Piston(t).moved(p, interval), interval),
    "warm friction": lambda p, t, interval: Piston(t).moved(warm_friction(p, t), interval),
}
"""Name to the position from pressure, temperature and sampling time."""


def plant_records(plant: str, *, seed: int = 1, names: tuple[str, ...] = CLUTCH_RECORDS) -> Dataset:
    """Simulate records of a plant with the currents and temperatures of bundled records.

    Parameters
    ----------
    plant
        Among `PLANTS`.
    seed
        Of the noise: uniform, within 0.3 bar and 0.05 mm.
    names
        Of the bundled records.

    Raises
    ------
    ModelError
        If the plant is unknown.

    Examples
    --------
    >>> data = plant_records("backlash", names=("20C_step_a",))
    >>> data.experiment_names, data.source
    (('20C_step_a',), "simulated clutch actuator, plant 'backlash'")
    """
    if plant not in PLANTS:
        raise ModelError(f"no plant {plant!r}; {name_hint(plant, PLANTS)}")
    bundled = load_clutch(names)
    runs = []
    for run in bundled.experiments:
        # A seed for each record, whatever others are asked for.
        generator = np.random.default_rng([seed, CLUTCH_RECORDS.index(run.name)])
        n, temperature = run.n_samples, float(run.values["temperature"][0])
        ticks = np.arange((n - 1) * TICKS + 1) / TICKS
        current = np.interp(ticks, np.arange(n), run.values["current"])
        pressure = simulate_clutch(current, temperature, sampling_time=SAMPLING_TIME / TICKS)
        position = PLANTS[plant](pressure, temperature, SAMPLING_TIME / TICKS)
        measured = {
            "pressure": pressure[::TICKS] + generator.uniform(-NOISE_BOUND, NOISE_BOUND, n),
            "position": position[::TICKS] + generator.uniform(-POSITION_NOISE_BOUND, POSITION_NOISE_BOUND, n),
        }
        runs.append(replace(run, values={**run.values, **measured}))
    return replace(bundled.with_experiments(runs), source=f"simulated clutch actuator, plant {plant!r}", resampling=())
