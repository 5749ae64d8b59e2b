"""Which further effects a PTX has: those that lower the error on samples that did not train it.

Each effect is offered once. The sensor is trained on with it, from its present parameters,
and keeps it if the RMSE on the selection part falls by more than 1 %. A sensor on whose plant no effect acts stays as
it is.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from smid.data import Dataset
from smid.networks import ProgressCallback
from smid.sensors.ptx import PTX
from smid.sensors.ptx_dynamics import EFFECTS

__all__ = ["EffectChoice", "choose_effects"]

LEAST = 0.01  # share of the RMSE


@dataclass(frozen=True, eq=False)
class EffectChoice:
    """A sensor with the effects that were kept.

    Parameters
    ----------
    sensor
        Trained on the training part.
    tried
        The effects that were offered, each with the RMSE on the selection part that it led to.
    plain, chosen
        RMSE on the selection part without and with the effects.

    Examples
    --------
    >>> EffectChoice(PTX(effects=("flow",)), (("flow", 0.07),), plain=0.1, chosen=0.07).sensor.effects
    ('flow',)
    """

    sensor: PTX
    tried: tuple[tuple[str, float], ...]
    plain: float
    chosen: float


def choose_effects(
    sensor: PTX,
    training: Dataset,
    selection: Dataset,
    *,
    effects: Sequence[str] = EFFECTS,
    seed: int = 1,
    progress: ProgressCallback | None = None,
) -> EffectChoice:
    """Return a trained sensor with the effects that serve it on the selection part.

    Parameters
    ----------
    sensor
        Trained on the training part.
    selection
        Other samples, in the same units.
    effects
        To be offered, in their order.
    progress
        Called after each step of training.

    Raises
    ------
    ModelError
        If the sensor is not trained.
    """
    plain = best = _rmse(sensor, selection)
    tried = []
    for effect in effects:
        if effect == "temperature" and sensor.temperature is None:
            continue
        longer = sensor.extended(training, effect, seed=seed, progress=progress)
        error = _rmse(longer, selection)
        tried.append((effect, error))
        if error < (1.0 - LEAST) * best:
            sensor, best = longer, error
    return EffectChoice(sensor, tuple(tried), plain, best)


def _rmse(sensor: PTX, data: Dataset) -> float:
    return float(sensor.predict(data).mse(data) ** 0.5)
