"""The thesis's Hammerstein model of the clutch actuator, from current in mA to pressure in bar, (3.1)-(3.12)."""

from __future__ import annotations

from collections.abc import Sequence

from smid.models import Hammerstein, Model
from smid.theses.clutch.plant import INPUT_SCALE

__all__ = ["clutch_hammerstein"]


def clutch_hammerstein(poles: int = 1, powers: Sequence[int] = (5, 4, 3)) -> Model:
    """Return the thesis's stable Hammerstein model of unit DC gain; by default with the powers of (3.5)."""
    return Hammerstein(poles=poles, powers=powers, input_scale=INPUT_SCALE, unit_dc_gain=True, stable=True)
