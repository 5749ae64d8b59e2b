"""One sensor for all temperatures with hysteresis, compared with a CPX for each temperature.

PTX is trained on the records ``ramp_a`` and ``step_a`` of the three temperatures. All others are held out, with every
record that has hysteresis. Each CPX is for one temperature, and is trained on

- its ``step_a``, as in the thesis,
- the same two records of its temperature as PTX,
- all records of its temperature, also the held-out ones: the best possible result of its structure.

Each CPX is shown without filter, with the centred median of order 50, which uses 50 ms of future samples, with the
dead zone enforced, and with the causal median, which works in real time. PTX has no filter and no delay.

The records are simulated, and PTX has the same structure as their plant: friction, a curve scaled by temperature, a
lag. The plant's friction is Dahl's, not plays, its gain is not an exponential, and PTX knows none of its numbers. A
real clutch may fit this structure less well; `smid.theses.clutch.sensor_study.foreign` compares on other plants.

Reference: clutch thesis, section 6.2.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from relaxations.deadline import Progress
from smid.data import Dataset
from smid.data.bundled import CLUTCH_RECORDS, load_clutch
from smid.display.result import Part, Result
from smid.networks import ProgressCallback
from smid.sensors import CPX, PTX, DeadZone, MedianFiltered, VirtualSensor
from smid.sensors.dead_zone import enforced
from smid.theses.clutch.sensor_study.cross import ErrorTable
from smid.theses.clutch.sensor_study.structures import CPX_ORDER

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = [
    "HELD_OUT",
    "TRAINING",
    "SingleSensorStudy",
    "errors_of",
    "rival_sensors",
    "single_sensor_study",
    "train_single_sensor",
]

TRAINING = tuple(name for name in CLUTCH_RECORDS if name.endswith(("ramp_a", "step_a")))
HELD_OUT = tuple(name for name in CLUTCH_RECORDS if name not in TRAINING)
TEMPERATURES = ("20", "60", "m20")

_TRAINED_ON = {"step": "step_a", "same": "ramp_a and step_a, as PTX", "all": "every record of the temperature"}
_FORMS = {"M": "behind the centred median", "MD": "and with dead zone", "C": "behind the causal median, 49 ms late"}


@dataclass(frozen=True, eq=False, repr=False)
class SingleSensorStudy(Result):
    """PTX, compared with the sensors of one temperature.

    Parameters
    ----------
    sensor
        Trained on `TRAINING`.
    rivals
        By name of a column, then by temperature.
    held_out, training
        RMSE on the records that PTX has not seen, and on those that trained it.

    Examples
    --------
    >>> errors = ErrorTable("RMSE in mm.", ("CPX", "PTX"), ("20C_step_b",), np.array([[0.3, 0.1]]))
    >>> study = SingleSensorStudy(PTX(), {}, errors, errors)
    >>> {record: round(times, 3) for record, times in study.advantage.items()}
    {'20C_step_b': 3.0}
    """

    sensor: PTX
    rivals: Mapping[str, Mapping[str, VirtualSensor]]
    held_out: ErrorTable
    training: ErrorTable

    @property
    def advantage(self) -> dict[str, float]:
        """Return the least RMSE of any CPX divided by that of PTX, for each held-out record."""
        best = self.held_out.rmse[:, :-1].min(axis=1) / self.held_out.rmse[:, -1]
        return dict(zip(self.held_out.records, best.tolist(), strict=True))

    @property
    def conclusion(self) -> str:
        """Return the result of the tables in a sentence."""
        ratios = list(self.advantage.values())
        verdict = "below" if min(ratios) > 1 else "not always below"
        parameters = CPX().n_parameters
        return (
            f"One sensor of {self.sensor.n_parameters} parameters, without a filter, is compared with "
            f"{len(TEMPERATURES)} CPX of {parameters} each. On every held-out record its RMSE is {verdict} that of the "
            f"best CPX. The RMSE of the best CPX is {min(ratios):.2f} to {max(ratios):.2f} times as large."
        )

    def _content(self) -> Iterator[Part]:
        yield self.held_out
        yield self.training
        yield self.conclusion

    def plot(self) -> Figure:
        """Draw the errors on the held-out records."""
        return self.held_out.plot()

    def to_dict(self) -> dict[str, Any]:
        """Return plain data."""
        return {
            "parameters": self.sensor.n_parameters,
            "held_out": self.held_out.to_dict(),
            "training": self.training.to_dict(),
            "advantage": self.advantage,
        }


def train_single_sensor(
    seed: int = 1, sensor: PTX | None = None, starts: int = 5, progress: ProgressCallback | None = None
) -> PTX:
    """Train the sensor for all temperatures on `TRAINING`.

    Parameters
    ----------
    sensor
        Of another size than the default.
    starts
        Number of random starts.
    progress
        Called after each step.

    Examples
    --------
    Training takes a minute or two and is not run here.

    >>> TRAINING
    ('20C_ramp_a', '20C_step_a', '60C_ramp_a', '60C_step_a', 'm20C_ramp_a', 'm20C_step_a')
    >>> sensor = train_single_sensor()  # doctest: +SKIP
    """
    return (sensor or PTX()).fit(load_clutch(TRAINING), seed=seed, starts=starts, progress=progress)


def single_sensor_study(
    sensor: PTX | None = None, seed: int = 1, progress: Progress | None = None
) -> SingleSensorStudy:
    """Compare one sensor for all temperatures with a CPX for each.

    Parameters
    ----------
    sensor
        Trained; by default, one is trained.

    Examples
    --------
    Training takes minutes and is not run here.

    >>> HELD_OUT
    ('20C_ramp_b', '20C_step_b', '60C_ramp_b', '60C_step_c', 'm20C_step_c')
    >>> print(single_sensor_study(progress=print).conclusion)  # doctest: +SKIP
    """
    say = progress or (lambda _: None)
    if sensor is None:
        say("training PTX")
        sensor = train_single_sensor(seed)
    data = load_clutch()
    rivals = rival_sensors(data, {"": CPX()}, seed, say)
    captions = ("RMSE in mm on records that PTX has not seen.", "RMSE in mm on the records that trained PTX.")
    held_out, training = (
        errors_of(caption, data.select(names), {"PTX": sensor}, rivals)
        for caption, names in zip(captions, (HELD_OUT, TRAINING), strict=True)
    )
    return SingleSensorStudy(sensor, rivals, held_out, training)


def rival_sensors(
    data: Dataset, structures: Mapping[str, VirtualSensor], seed: int, say: Progress
) -> dict[str, dict[str, VirtualSensor]]:
    """Return sensors of one temperature, trained: by structure, training records and form, then by temperature.

    Parameters
    ----------
    data
        All records of a plant, named as the bundled ones.
    structures
        Name to an untrained sensor.
    """
    rivals: dict[str, dict[str, VirtualSensor]] = {}
    for structure, untrained in structures.items():
        for key, words in _TRAINED_ON.items():
            for temperature in TEMPERATURES:
                say(f"training {structure} of {temperature} degC on {words}")
                own = data.select(_records(key, temperature))
                plain = untrained.fit(own, seed=seed)
                median = MedianFiltered(plain, CPX_ORDER)
                forms: dict[str, VirtualSensor] = {
                    "": plain,
                    "M": median,
                    "MD": enforced(DeadZone(median), own),
                    "C": MedianFiltered(plain, CPX_ORDER, causal=True),
                }
                for form, made in forms.items():
                    rivals.setdefault(f"{structure} {key} {form}".strip(), {})[temperature] = made
    return rivals


def _records(key: str, temperature: str) -> tuple[str, ...]:
    every = tuple(name for name in CLUTCH_RECORDS if name.startswith(f"{temperature}C_"))
    return {"step": (f"{temperature}C_step_a",), "same": tuple(n for n in every if n in TRAINING), "all": every}[key]


def errors_of(
    caption: str,
    data: Dataset,
    sensors: Mapping[str, VirtualSensor],
    rivals: Mapping[str, Mapping[str, VirtualSensor]],
) -> ErrorTable:
    """Return the errors of rivals, each of the record's temperature, then of sensors of all temperatures."""
    rows = []
    for name in data.experiment_names:
        record = data.select(name)
        used = [*(by_temperature[name.split("C_")[0]] for by_temperature in rivals.values()), *sensors.values()]
        rows.append([each.predict(record).rmse(record)[name] for each in used])
    legend = ["; ".join(f"{key}: {words}" for key, words in described.items()) for described in (_TRAINED_ON, _FORMS)]
    caption = f"{caption}\nRivals of the record's temperature, trained on {legend[0]}.\n{legend[1]}."
    return ErrorTable(caption, (*rivals, *sensors), data.experiment_names, np.array(rows))
