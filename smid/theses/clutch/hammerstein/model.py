"""The thesis's Hammerstein model of the clutch actuator, from current in mA to pressure in bar, (3.1)-(3.12)."""

from __future__ import annotations

from collections.abc import Sequence

from smid.models import Hammerstein, Model
from smid.theses.clutch.plant import INPUT_SCALE

__all__ = ["clutch_hammerstein"]


def clutch_hammerstein(poles: int = 1, powers: Sequence[int] = (5, 4, 3)) -> Model:
    """Return a stable Hammerstein model of unit DC gain, with the input scaled as in the thesis.

    Parameters
    ----------
    powers
        Of the static polynomial; by default those of (3.5).

    Raises
    ------
    ModelError
        If poles or powers are not valid.

    Examples
    --------
    >>> [p.name for p in clutch_hammerstein().parameters]
    ['alpha', 'gamma1', 'gamma2', 'gamma3']
    """
    return Hammerstein(poles=poles, powers=powers, input_scale=INPUT_SCALE, unit_dc_gain=True, stable=True)
