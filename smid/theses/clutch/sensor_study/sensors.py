"""The sensors of chapter 5, trained on simulated records.

CPX20 is CPX trained on ``20C_step_a``; 60 and m20 are the other temperatures, H is a record with hysteresis.

Reference: clutch thesis, 5.2.3, 5.3.3 and 5.3.4.
"""

from __future__ import annotations

from collections.abc import Mapping

from relaxations.deadline import Progress
from smid.data.bundled import load_clutch
from smid.data.channel import name_hint
from smid.models import ModelError
from smid.sensors import CFPX, CPX, PX, VirtualSensor
from smid.theses.clutch.sensor_study.structures import CFPX_ORDER, CPX_ORDER, Loader, final_form

__all__ = ["THESIS_SENSORS", "train_thesis_sensors"]

STEPS = {"20": "20C_step_a", "60": "60C_step_a", "m20": "m20C_step_a"}
HYSTERESIS = "20C_step_b"

THESIS_SENSORS: Mapping[str, tuple[VirtualSensor, str]] = {
    **{f"CPX{t}": (CPX(), record) for t, record in STEPS.items()},
    "CPX20H": (CPX(), HYSTERESIS),
    **{f"CPX{t} filtered": (final_form(CPX(), CPX_ORDER), record) for t, record in STEPS.items()},
    **{f"PX{t}": (PX(), record) for t, record in STEPS.items()},
    "PX20H": (PX(), HYSTERESIS),
    **{f"PX{t} enforced": (final_form(PX(), None), record) for t, record in STEPS.items()},
    **{f"CFPX20 order {order}": (final_form(CFPX(order), None), STEPS["20"]) for order in (5, 10, 20)},
    "CFPX20 filtered": (final_form(CFPX(20), CFPX_ORDER), STEPS["20"]),
}
"""Name to sensor and the record that trains it.

"filtered": with median and dead zone. "enforced", and a polynomial's order: with the dead zone alone.
"""


def train_thesis_sensors(
    names: tuple[str, ...] = tuple(THESIS_SENSORS),
    seed: int = 1,
    progress: Progress | None = None,
    load: Loader = load_clutch,
) -> dict[str, VirtualSensor]:
    """Train sensors of the thesis.

    Parameters
    ----------
    names
        Among `THESIS_SENSORS`.
    load
        Returns the record of a name.

    Raises
    ------
    ModelError
        If a name is unknown.

    Examples
    --------
    >>> train_thesis_sensors(("CFPX20 filtered",))["CFPX20 filtered"].n_parameters
    23
    """
    result = {}
    for name in names:
        if name not in THESIS_SENSORS:
            raise ModelError(f"no sensor {name!r} in the thesis; {name_hint(name, THESIS_SENSORS)}")
        if progress is not None:
            progress(f"training {name}")
        sensor, record = THESIS_SENSORS[name]
        result[name] = sensor.fit(load(record), seed=seed)
    return result
