"""A named cause with its evidence."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any


@dataclass(frozen=True)
class CauseParameter:
    """A parameter of a named effect.

    Parameters
    ----------
    name, unit : str
    value : float
        Fitted, in its unit.
    lower, upper : float or None
        Interval in its unit; None where none was computed.
    null : float or None
        Value at which the effect vanishes.
    proven : bool
        Whether the interval is certified; otherwise it is linearised, three standard deviations either side.

    Examples
    --------
    >>> print(CauseParameter("delay", "samples", 2.1, 1.9, 2.3, 0.0, proven=False))
    delay = 2.1 samples in [1.9, 2.3]; no effect at 0
    """

    name: str
    unit: str
    value: float
    lower: float | None
    upper: float | None
    null: float | None
    proven: bool

    def __str__(self) -> str:
        said = f"{self.name} = {self.value:.4g} {self.unit}".rstrip()
        if self.lower is not None and self.upper is not None:
            said += f" in [{self.lower:.4g}, {self.upper:.4g}]" + (" (proven)" if self.proven else "")
        return said if self.null is None else f"{said}; no effect at {self.null:.4g}"


@dataclass(frozen=True)
class Rival:
    """An effect that was weighed against a named one.

    Parameters
    ----------
    effect : str
    rmse : float
        Held out, in the output's unit.
    odds : float
        How many times likelier the named effect makes the data, as Schwarz's criterion tells; at most 1e12.
    why : str
        Why it lost, in words.

    Examples
    --------
    >>> Rival("extra_lag", rmse=0.31, odds=1e-6, why="leaves a held-out RMSE of 0.31 instead of 0.12").effect
    'extra_lag'
    """

    effect: str
    rmse: float
    odds: float
    why: str


@dataclass(frozen=True)
class Cause:
    """A named effect.

    Parameters
    ----------
    effect, label : str
        Its name, and which variant of it.
    sentence : str
        What it is and how large, in words and units.
    confidence : float
        Between 0 and 1: against its rivals and against chance.
    parameters : tuple of CauseParameter
    rivals : tuple of Rival
        Best first.
    evidence : mapping str -> float
        ``rmse_before``, ``rmse_after`` (held out, without and with it beside the other causes), ``chance``,
        ``score_drop``, ``structure_before`` and
        ``structure_after``; what a detection on the noise found instead.

    Examples
    --------
    >>> dead = CauseParameter("upper", "mA", 40.0, 38.0, 42.0, 0.0, proven=False)
    >>> cause = Cause("input_dead_zone", "", "No response below 40 mA.", 0.98, (dead,), (), {})
    >>> f"{cause.effect} ({cause.confidence:.0%})"
    'input_dead_zone (98%)'
    """

    effect: str
    label: str
    sentence: str
    confidence: float
    parameters: tuple[CauseParameter, ...]
    rivals: tuple[Rival, ...]
    evidence: Mapping[str, float]

    def to_dict(self) -> dict[str, Any]:
        """Return plain, JSON-ready content; what is not finite becomes None."""
        parameters = {p.name: {k: _plain(v) for k, v in asdict(p).items() if k != "name"} for p in self.parameters}
        return {
            "effect": self.effect,
            "label": self.label,
            "sentence": self.sentence,
            "confidence": self.confidence,
            "parameters": parameters,
            "rivals": [{k: _plain(v) for k, v in asdict(rival).items()} for rival in self.rivals],
            "evidence": {name: _plain(value) for name, value in self.evidence.items()},
        }


def _plain(value: Any) -> Any:
    return None if isinstance(value, float) and not math.isfinite(value) else value
