"""Offsets and scales that bring channels to comparable ranges."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Literal, get_args

import numpy as np
from numpy.typing import NDArray

from smid.data.errors import DataError

NormalisationMethod = Literal["unit", "share", "standard"]


@dataclass(frozen=True)
class Normalisation:
    """Offset and scale of every channel: normalised = (value - offset) / scale.

    Parameters
    ----------
    method
        "unit" maps the measured range onto [-1, 1], "share" onto [0, 1]; "standard" gives mean 0 and standard
        deviation 1.
    offset, scale
        Per channel, in its original unit; every scale is positive.
    units
        The original units; normalised channels have none.

    Examples
    --------
    >>> Normalisation("unit", {"u": 1.0}, {"u": 0.5}, {"u": "A"}).scale["u"]
    0.5
    """

    method: NormalisationMethod
    offset: Mapping[str, float] = field(hash=False)
    scale: Mapping[str, float] = field(hash=False)
    units: Mapping[str, str] = field(hash=False)

    def __str__(self) -> str:
        maps = ", ".join(f"{n} = {o:.4g} + {self.scale[n]:.4g} x" for n, o in self.offset.items())
        return f"normalised ({self.method}): {maps}"

    def to_dict(self) -> dict[str, Any]:
        """Return plain numbers and strings; `Normalisation(**record.to_dict())` is the same record."""
        maps = {"offset": dict(self.offset), "scale": dict(self.scale), "units": dict(self.units)}
        return {"method": self.method, **maps}


def measure_normalisation(
    values: Mapping[str, NDArray[np.float64]], units: Mapping[str, str], method: NormalisationMethod
) -> Normalisation:
    """Return offsets and scales of measured channels; a constant channel gets scale 1.

    Raises
    ------
    DataError
        If the method is unknown.
    """
    if method not in get_args(NormalisationMethod):
        raise DataError(f"unknown normalisation {method!r}; choose 'unit', 'share' or 'standard'")
    offset: dict[str, float] = {}
    scale: dict[str, float] = {}
    for name, array in values.items():
        lowest, highest = float(np.nanmin(array)), float(np.nanmax(array))
        if method == "unit":
            # Halves before the sum: the sum of two huge samples could overflow.
            offset[name], spread = 0.5 * lowest + 0.5 * highest, 0.5 * highest - 0.5 * lowest
        elif method == "share":
            offset[name], spread = lowest, highest - lowest
        else:
            offset[name], spread = float(np.nanmean(array)), float(np.nanstd(array))
        scale[name] = spread if highest > lowest and spread > 0 else 1.0
    return Normalisation(method, offset, scale, dict(units))
