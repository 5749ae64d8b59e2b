"""Records of the whole actuator: those that come with the package, and new ones.

The bundled ones bear the names of the thesis's data sets.  They are simulated: ``data/README.md`` in the repository
says how.  They were sampled irregularly, like the thesis's (section 3.1), and are brought to 2 ms when they are loaded.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from smid.clutch.plant import NOISE_BOUND, SAMPLING_TIME, ClutchPlant, simulate_clutch
from smid.clutch.position import POSITION_NOISE_BOUND, ReturnSpring, simulate_position
from smid.data import Channel, DataError, Dataset, Experiment
from smid.data.channel import name_hint
from smid.records import record_path

__all__ = ["CLUTCH_RECORDS", "actuator_record", "load_clutch_records"]

CLUTCH_RECORDS = (
    "20C_ramp_a",
    "20C_ramp_b",
    "20C_step_a",
    "20C_step_b",
    "60C_ramp_a",
    "60C_ramp_b",
    "60C_step_a",
    "60C_step_c",
    "m20C_ramp_a",
    "m20C_step_a",
    "m20C_step_c",
)
"""The data sets that the thesis names; ``20C_step_b``, ``60C_step_c`` and ``m20C_step_c`` are those with hysteresis."""


def load_clutch_records(names: str | Sequence[str] | None = None) -> Dataset:
    """Load bundled records of current, pressure and position, labelled as simulated.

    Parameters
    ----------
    names : str or sequence of str, optional
        Among `CLUTCH_RECORDS`; all of them by default.

    Returns
    -------
    Dataset
        One experiment per record, at 2 ms.  Channels ``current`` (input, mA), ``pressure`` (output, bar), ``position``
        (output, mm) and ``temperature`` (degC, without a role).  For a model from current to pressure alone, take
        ``dataclasses.replace(data, outputs=("pressure",))``.

    Raises
    ------
    DataError
        If a name is unknown or occurs twice, or none is given.

    Examples
    --------
    >>> data = load_clutch_records("m20C_step_a")
    >>> data.names, data.sampling_time, data.n_samples
    (('current', 'pressure', 'position', 'temperature'), 0.002, 5001)

    References
    ----------
    Clutch thesis, figures 3.3, 3.4 and 3.13 to 3.20.
    """
    wanted = CLUTCH_RECORDS if names is None else (names,) if isinstance(names, str) else tuple(names)
    for name in wanted:
        if name not in CLUTCH_RECORDS:
            raise DataError(f"no clutch record {name!r}; {name_hint(str(name), CLUTCH_RECORDS)}")
    data = Dataset.from_csv(
        [record_path(f"clutch/{name}.csv") for name in wanted],
        input="current",
        output=("pressure", "position"),
        sampling_time=SAMPLING_TIME,
    )
    return replace(data, source=f"{data.source} (simulated)")


def actuator_record(
    current: ArrayLike,
    temperature: float = 20.0,
    *,
    seed: int | np.random.Generator,
    name: str = "actuator",
    plant: ClutchPlant | None = None,
    spring: ReturnSpring | None = None,
) -> Dataset:
    """Simulate a measured record of the whole actuator, from current to position.

    Parameters
    ----------
    current : array_like, shape (n,)
        In mA, every 2 ms.
    temperature : float
        Of oil and spring, in degC.
    seed : int or numpy.random.Generator
        Of the noise of pressure (within 0.3 bar) and position (within 0.05 mm).
    name : str
        Of the experiment.
    plant : ClutchPlant, optional
        From current to pressure; by default with all ingredients.
    spring : ReturnSpring, optional
        From pressure to position; by default the one of the bundled records.

    Returns
    -------
    Dataset
        With the channels and roles of `load_clutch_records`.

    Raises
    ------
    DataError
        If the current is no finite series, or the temperature leaves no spring.

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
