"""One sensor for all temperatures on six plants, five of which have formulas that the sensor does not have.

On each plant, PTX is trained on ``ramp_a`` and ``step_a`` of the three temperatures. The last 30 % of each of these
records choose its effects (`smid.sensors.ptx_selection`); then it is trained on with the whole records. All other
records are held out. They are read once, when everything is chosen and trained.

The rivals are the sensors of the thesis, CPX and PX, one for each temperature, in the forms of
`smid.theses.clutch.sensor_study.single_sensor`. The best of them is taken for each record, with the record in view:
the rivals have the advantage of that choice. Some were also trained on the held-out records themselves.

What sensor and plant share, by plant:

- Dahl: a static curve, a lag behind it, and friction that does not depend on speed. Dahl's friction is no play.
- foreign plants (`smid.theses.clutch.plants`): the kinds of effect, but no formula. "rate", "backlash" and "warm
  friction" have an effect that PTX can represent, by another formula; Bouc-Wen friction and the relays of Preisach are
  no sums of plays.

All plants have the same path from current to pressure. PTX reads the pressure, and does not depend on that path.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from relaxations.deadline import Progress
from smid.display.result import Part, Tabular
from smid.display.table import Table
from smid.sensors import CPX, PTX, PX, VirtualSensor
from smid.sensors.choose import cut_records
from smid.sensors.ptx_selection import choose_effects
from smid.theses.clutch.plants import PLANTS, plant_records
from smid.theses.clutch.sensor_study.single_sensor import HELD_OUT, TRAINING, errors_of, rival_sensors

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["ForeignRow", "ForeignStudy", "foreign_study"]

CHOOSING = 0.7  # share of a training record after which it chooses


@dataclass(frozen=True)
class ForeignRow:
    """A held-out record of a plant; errors are RMSE in mm.

    Parameters
    ----------
    effects
        That PTX has on this plant.
    plain, error
        Of PTX without and with these effects.
    rival
        Best CPX or PX that was trained on no held-out record, and its error.
    favoured
        Best of all rivals, also of those that were trained on this record, and its error.

    Examples
    --------
    >>> ForeignRow("rate", "60C_step_c", ("flow",), 0.16, 0.08, ("CPX same", 0.12), ("CPX all", 0.10)).margin
    1.5
    """

    plant: str
    record: str
    effects: tuple[str, ...]
    plain: float
    error: float
    rival: tuple[str, float]
    favoured: tuple[str, float]

    @property
    def margin(self) -> float:
        """Return how many times as large the error of the best rival is."""
        return self.rival[1] / self.error


@dataclass(frozen=True, eq=False, repr=False)
class ForeignStudy(Tabular):
    """PTX and the sensors of the thesis on the held-out records of the plants."""

    rows: tuple[ForeignRow, ...]

    @property
    def table(self) -> Table:
        """Return the errors as text."""
        header = ("plant", "record", "PTX", "without effects", "best CPX, PX", "margin", "trained on it too", "margin")
        cells = tuple(
            (
                row.plant,
                row.record,
                f"{row.error:.3f}",
                f"{row.plain:.3f}",
                f"{row.rival[1]:.3f} {row.rival[0]}",
                f"{row.margin:.2f}",
                f"{row.favoured[1]:.3f} {row.favoured[0]}",
                f"{row.favoured[1] / row.error:.2f}",
            )
            for row in self.rows
        )
        return Table("RMSE in mm on the held-out records of each plant.", header, cells, "llrrlrlr")

    @property
    def choices(self) -> Table:
        """Return the effects of PTX on each plant."""
        chosen = {row.plant: ", ".join(row.effects) or "none" for row in self.rows}
        return Table("Effects that the selection part chose.", ("plant", "effects"), tuple(chosen.items()), "ll")

    @property
    def conclusion(self) -> str:
        """Return the margins in two sentences."""
        margins = [row.margin for row in self.rows]
        favoured = [row.favoured[1] / row.error for row in self.rows]
        return (
            f"PTX has the smaller RMSE on {sum(m > 1 for m in margins)} of {len(margins)} held-out records. The RMSE "
            f"of the best CPX or PX is {min(margins):.2f} to {max(margins):.2f} times as large. Rivals that were "
            f"trained on the held-out record too are beaten on {sum(m > 1 for m in favoured)} of {len(favoured)}; "
            f"their RMSE is {min(favoured):.2f} to {max(favoured):.2f} times as large."
        )

    def _content(self) -> Iterator[Part]:
        yield self.table
        yield self.choices
        yield self.conclusion

    def _rows(self) -> Iterator[dict[str, Any]]:
        for row in self.rows:
            yield {
                "plant": row.plant,
                "record": row.record,
                "effects": ", ".join(row.effects),
                "ptx": row.error,
                "ptx_plain": row.plain,
                "rival": row.rival[0],
                "rival_rmse": row.rival[1],
                "favoured": row.favoured[0],
                "favoured_rmse": row.favoured[1],
            }

    def plot(self) -> Figure:
        """Draw the errors on each record of each plant."""
        from smid.theses.clutch.sensor_study.figures import foreign_figure

        return foreign_figure(self)

    def to_dict(self) -> dict[str, Any]:
        """Return plain data."""
        return {"rows": list(self._rows())}


def foreign_study(
    plants: Sequence[str] = tuple(PLANTS), *, seed: int = 1, starts: int = 2, progress: Progress | None = None
) -> ForeignStudy:
    """Train and compare the sensors on plants; each takes about two minutes.

    Parameters
    ----------
    plants
        Among `PLANTS`.
    seed
        Of noise, splits and starts.
    starts
        Number of random starts of PTX.

    Raises
    ------
    ModelError
        If a plant is unknown.

    Examples
    --------
    Training takes minutes and is not run here.

    >>> print(foreign_study(progress=print).conclusion)  # doctest: +SKIP
    """
    return ForeignStudy(tuple(row for plant in plants for row in _compared(plant, seed, starts, progress)))


def _compared(plant: str, seed: int, starts: int, progress: Progress | None) -> Iterator[ForeignRow]:
    def say(words: str) -> None:
        if progress is not None:
            progress(f"plant {plant!r}: {words}")

    say("simulating its records")
    data = plant_records(plant, seed=seed)
    known = data.select(TRAINING)
    fitted, choosing = cut_records(known, 0.0, CHOOSING), cut_records(known, CHOOSING, 1.0)
    say("training PTX")
    plain = PTX().fit(fitted, seed=seed, starts=starts)
    say("choosing the effects of PTX")
    chosen = choose_effects(plain, fitted, choosing, seed=seed).sensor
    say("training PTX on")
    sensors: dict[str, VirtualSensor] = {
        "plain": plain.extended(known, seed=seed),
        "PTX": chosen.extended(known, seed=seed),
    }
    structures: dict[str, VirtualSensor] = {"CPX": CPX(), "PX": PX()}
    rivals = rival_sensors(data, structures, seed, say)
    # Everything is chosen and trained: the held-out records are read.
    errors = errors_of("", data.select(HELD_OUT), sensors, rivals)
    fair = [k for k, name in enumerate(errors.sensors[:-2]) if " all" not in name]
    for record, row in zip(errors.records, errors.rmse, strict=True):
        best, favoured = min(fair, key=lambda k: row[k]), int(np.argmin(row[:-2]))
        yield ForeignRow(
            plant,
            record,
            chosen.effects,
            float(row[-2]),
            float(row[-1]),
            (errors.sensors[best], float(row[best])),
            (errors.sensors[favoured], float(row[favoured])),
        )
