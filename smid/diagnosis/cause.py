"""A named cause with its evidence."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from math import nan
from typing import Any

from smid.display.from_plain import Plain, fields_from_plain, read
from smid.display.result import Part, Result, plain
from smid.display.table import Table
from smid.models import Model

SAME = "says the same in other words"
"""Of a rival that no experiment tells from the named effect: one equation has two names."""


def percent(probability: float) -> str:
    """Return a probability as every result prints it: never 0 or 100 %, which no record gives.

    Examples
    --------
    >>> percent(0.98765), percent(0.99999), percent(1e-9)
    ('98.8 %', 'more than 99.9 %', 'less than 0.1 %')
    """
    if probability > 0.999:
        return "more than 99.9 %"
    return "less than 0.1 %" if probability < 0.001 else f"{100 * probability:.3g} %"


@dataclass(frozen=True)
class CauseParameter:
    """A parameter of a named effect.

    Parameters
    ----------
    value
        Fitted, in its unit.
    lower, upper
        Interval in its unit; None where none was computed.
    null
        Value at which the effect vanishes.
    proven
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

    @property
    def cells(self) -> tuple[str, ...]:
        """Return the row of a table."""
        numbers = (self.value, self.lower, self.upper)
        value, lower, upper, null = ("-" if x is None else f"{x:.4g}" for x in (*numbers, self.null))
        kind = "" if self.lower is None else "proven" if self.proven else "linearised"
        return self.name, value, lower, upper, self.unit, null, kind


@dataclass(frozen=True)
class Rival:
    """An effect that was weighed against a named one.

    Parameters
    ----------
    rmse
        Over the samples that were fitted, in the output's unit.
    odds
        Of the named effect against this one, by their merits; at most 1e12.
    why
        Why it was rejected, in a short phrase.
    model
        The fitted model with this effect in the place of the named one; None for an effect on the noise.

    Examples
    --------
    >>> Rival("extra_lag", rmse=0.31, odds=1e-6, why="rejected: it leaves a larger error").effect
    'extra_lag'
    """

    effect: str
    rmse: float
    odds: float
    why: str
    model: Model | None = field(default=None, repr=False, compare=False)

    def to_dict(self) -> dict[str, Any]:
        """Return plain, JSON-ready content."""
        told = {name: plain(getattr(self, name)) for name in ("effect", "rmse", "odds", "why")}
        return {**told, "model": None if self.model is None else self.model.to_dict()}

    @staticmethod
    def from_dict(content: Mapping[str, Any]) -> Rival:
        """Return the rival that `to_dict` described."""
        model = read(content, "model", Plain | None)
        found: Rival = fields_from_plain(Rival, content, model=None if model is None else Model.from_dict(model))
        return found


@dataclass(frozen=True, repr=False, eq=False)
class Cause(Result):
    """A named effect.

    Parameters
    ----------
    effect, label
        Its name, and which variant of it.
    sentence
        What it is and how large, in words and units.
    confidence
        Probability: the share of the evidence that sets with this effect hold, among all sets visited.
    rivals
        Best first.
    evidence
        ``rmse_before`` and ``rmse_after`` (test part, without and with this cause beside the others),
        ``fit_rmse_before`` and ``fit_rmse_after`` (over the samples that were fitted), ``chance``, ``score_drop``
        (twice the merit that is lost without it), ``structure_before`` and ``structure_after``; for effects on the
        noise those of `Detection`.

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

    @property
    def synonyms(self) -> tuple[str, ...]:
        """Other names of the same equation: rivals that no experiment tells from this effect."""
        return tuple(rival.effect for rival in self.rivals if rival.why == SAME)

    def __str__(self) -> str:
        own = self.evidence.get("fit_rmse_after", nan)
        return "\n".join(
            (
                f"{self.effect} ({percent(self.confidence)}): {self.sentence}",
                *(f"  {p}" for p in self.parameters),
                *(f"  {r.effect} {r.why} (RMSE of the fit {r.rmse:.4g} against {own:.4g})" for r in self.rivals[:3]),
            )
        )

    def _content(self) -> Iterator[Part]:
        yield f"{self.effect} ({percent(self.confidence)}): {self.sentence}"
        if self.parameters:
            header = ("parameter", "value", "lower", "upper", "unit", "no effect at", "interval")
            yield Table("", header, tuple(p.cells for p in self.parameters), "lrrrlrl")
        if self.rivals:
            rows = tuple((r.effect, f"{r.rmse:.4g}", f"{r.odds:.2g}", r.why) for r in self.rivals)
            yield Table("Its rivals.", ("effect", "RMSE of the fit", "odds against it", "why not"), rows, "lrrl")

    def to_dict(self) -> dict[str, Any]:
        """Return plain, JSON-ready content; what is not finite becomes None."""
        parameters = {p.name: {k: v for k, v in plain(p).items() if k != "name"} for p in self.parameters}
        return {**super().to_dict(), "parameters": parameters}

    @staticmethod
    def from_dict(content: Mapping[str, Any]) -> Cause:
        """Return the cause that `to_dict` described."""
        told = read(content, "parameters", Mapping[str, Plain])
        parameters = tuple(fields_from_plain(CauseParameter, one, name=name) for name, one in told.items())
        found: Cause = fields_from_plain(Cause, content, parameters=parameters)
        return found
