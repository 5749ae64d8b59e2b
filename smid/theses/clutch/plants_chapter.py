"""One sensor on six plants, as a study with its page."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from smid.data import Dataset
from smid.theses.chapter import Chapter, Drawing, Topic
from smid.theses.clutch.plants import plant_records
from smid.theses.clutch.sensor_study import HELD_OUT, ForeignStudy

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["PlantsChapter"]

SHARED = (
    "Sensor and plant share most on the plant Dahl: a static curve, a first-order lag behind it, and friction that "
    "does not depend on speed. The foreign plants share no formula with the sensor. Their piston moves against a "
    "diaphragm spring through oil with viscous and turbulent resistance, and depends on temperature by other laws. "
    "Kinds of effect are shared: the sensor has friction that depends on temperature, level and speed, a flow, and "
    "backlash, by other formulas than the plants.",
    "The selection part is the last 30 % of each training record. The held-out records are read once, after the "
    "choice.",
)


@dataclass(frozen=True, eq=False, repr=False)
class PlantsChapter(Chapter):
    """The study of the six plants."""

    title = "Clutch: one virtual sensor on six plants"
    command = "clutch plants"
    not_compared = (
        "The thesis asks for one sensor for all temperatures with hysteresis (section 6.2), and has none. Its records "
        "are confidential. All plants are simulated; their sizes are assumptions.",
    )

    study: ForeignStudy

    @property
    def conclusion(self) -> str:
        """Return the margins."""
        return self.study.conclusion

    def records(self) -> Dataset:
        """Return the held-out records of the first plant."""
        return plant_records(self.study.rows[0].plant, names=HELD_OUT)

    def topics(self) -> Iterator[Topic]:
        """Return what is shared, then the errors."""
        yield Topic("What sensor and plant share", *SHARED)
        yield Topic(
            "Errors on the held-out records",
            self.study.table,
            self.study.choices,
            Drawing(self.study.plot, "Errors on the held-out records of each plant."),
        )

    def plot(self) -> Figure:
        """Draw the errors."""
        return self.study.plot()

    def to_dict(self) -> dict[str, Any]:
        """Return plain data."""
        return self.study.to_dict()
