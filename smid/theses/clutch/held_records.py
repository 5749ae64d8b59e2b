"""Records that hold each level for 2.5 s, of an actuator with strong friction and a wide dead zone.

The bundled records hold a level for 0.25 s, and their friction is 4 % of the range. A median of half a second removes
such steps, and a sensor without memory errs most where the position settles. The thesis states neither the duration of
its steps nor the sizes of its hysteresis and dead zones, but its findings tell something of them:

- a median of order 250, half a second, improves CFPX20: the levels last longer than half a second;
- CPX20H fails on the record that trained it, but PX20 does well on ``step_a``: the hysteresis is strong, ``step_a``
  settles from one side, and ``step_b`` rests where the return spring is soft, so that friction decides the position;
- a dead zone that is enforced improves PX20: the records rest in it.

The sizes here are chosen so that these findings can occur; they are not identified from the thesis's data, which are
confidential. They are: levels of 2.5 s, friction 2.5 bar, preload 5 bar, one level in five inside the dead zone, and a
return spring of 0.4 bar/mm, so that the curve has a steep part as in the thesis, where a polynomial of order 5 errs six
times as much as PX20.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from relaxations.algebra.arrays import Array
from smid.data import Dataset
from smid.data.channel import name_hint
from smid.models import ModelError
from smid.signals import ramp, step
from smid.theses.clutch.plant import SAMPLING_TIME, ClutchPlant
from smid.theses.clutch.position import ReturnSpring
from smid.theses.clutch.records import actuator_record

__all__ = ["HELD_RECORDS", "STRONG", "held_records"]

HELD_RECORDS = ("20C_step_a", "20C_step_b", "20C_ramp_a", "m20C_step_a")
STRONG = ReturnSpring(preload=5.0, stiffness=0.4, friction=2.5)
HOLD = 2.5  # s
DURATION = 48.0  # s
GOLDEN_SECTION = 0.6180339887498949


def held_records(
    names: str | Sequence[str] = HELD_RECORDS, *, seed: int = 1, plant: ClutchPlant | None = None
) -> Dataset:
    """Simulate records with long holds, with the channels of `smid.data.bundled.load_clutch`.

    Parameters
    ----------
    names
        Among `HELD_RECORDS`.
    seed
        Of the noise: uniform, within 0.3 bar and 0.05 mm.
    plant
        From current to pressure; by default with all effects.

    Raises
    ------
    ModelError
        If a name is unknown.

    Examples
    --------
    >>> data = held_records("20C_step_a")
    >>> data.experiment_names, data.n_samples
    (('20C_step_a',), 24001)
    """
    names = (names,) if isinstance(names, str) else tuple(names)
    made = []
    for name in names:
        if name not in HELD_RECORDS:
            raise ModelError(f"no record {name!r} with long holds; {name_hint(name, HELD_RECORDS)}")
        profile = {"step_a": _excursions, "step_b": _walk, "ramp_a": _ramps}[name.split("C_")[1]]
        temperature = float(name.split("C_")[0].replace("m", "-"))
        noise = np.random.default_rng([seed, HELD_RECORDS.index(name)])
        made.append(actuator_record(profile(), temperature, seed=noise, name=name, plant=plant, spring=STRONG))
    return made[0].with_experiments([data.experiments[0] for data in made])


def _samples(seconds: float) -> int:
    return round(seconds / SAMPLING_TIME) + 1


def _excursions() -> Array:
    """Return a current in mA that rises from zero to a level and falls back: every position is reached from below."""
    levels, time, k = [], 0.5, 0
    while time < DURATION - 2.0 * HOLD:
        # One level in five is in the dead zone of the position, below 470 mA.
        top = 280.0 + 180.0 * (k * GOLDEN_SECTION % 1.0) if k % 5 == 4 else 480.0 + 470.0 * (k * GOLDEN_SECTION % 1.0)
        levels += [(time, round(top)), (time + HOLD, 0)]
        time += 1.6 * HOLD
        k += 1
    return step(_samples(DURATION), levels=levels, sampling_time=SAMPLING_TIME)


def _walk() -> Array:
    """Return a current in mA of steps up and down, every tenth to zero: the same level is reached from both sides."""
    generator = np.random.default_rng(7)
    levels, time, k = [], 0.5, 0
    while time < DURATION - HOLD:
        levels.append((time, 0 if k % 10 == 9 else round(generator.uniform(400.0, 700.0))))
        time += 0.5 * HOLD
        k += 1
    return step(_samples(DURATION), levels=[*levels, (time, 0)], sampling_time=SAMPLING_TIME)


def _ramps() -> Array:
    """Return a current in mA that rises and falls within 2 s, to several levels."""
    corners, time = [(0.5, 0.0)], 0.5
    for top in (1.0, 0.75, 0.9, 0.6, 1.0, 0.85):
        corners += [(time + 2.0, top), (time + 2.5, top), (time + 4.5, 0.0), (time + 5.0, 0.0)]
        time += 5.0
    return ramp(_samples(DURATION), corners=corners, sampling_time=SAMPLING_TIME, amplitude=950.0)
