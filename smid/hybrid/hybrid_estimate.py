"""Result of the estimation of a hybrid model: the model, its free run, and what limits the fit."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from smid.data import Dataset
from smid.display.result import Part, Result, plain
from smid.fitting.problem import Fit
from smid.hybrid.hybrid_model import HybridModel
from smid.hybrid.trained_range import TrainedRange
from smid.models import Model, Parameter
from smid.networks import MultiStart, Stop

__all__ = ["HybridEstimate"]

_END = 1e-6  # of the width of a box
_MOVED = 0.5  # of the RMSE: more change with half the step is told


@dataclass(frozen=True, eq=False, repr=False)
class HybridEstimate(Result):
    """Estimated hybrid model.

    Parameters
    ----------
    hybrid
        Bound to the data; its model has the estimated values.
    fit
        Free run over all experiments.
    search
        Descents from all starts, in scaled parameters and errors.
    stop
        Why the last descent ended.
    trained
        Range of each network input on the fitted samples.
    integration
        RMS change of the free run with half the step of the integration, by output channel, in its unit.
    used
        Shape (n,). Per experiment, the fitted samples.
    scale
        As given to `estimate`.
    """

    hybrid: HybridModel
    fit: Fit
    search: MultiStart
    stop: Stop
    trained: tuple[TrainedRange, ...]
    integration: Mapping[str, float]
    data: Dataset
    used: tuple[NDArray[np.bool_], ...]
    scale: Mapping[str, float] | None = None

    @property
    def model(self) -> Model:
        """Return the estimated model."""
        return self.hybrid.model

    @property
    def rmse(self) -> dict[str, float]:
        """Return the RMSE of the free run on the fitted samples, by output channel, in its unit."""
        found = {}
        for channel in self.model.output_channels:
            errors = zip(self.fit.residual(self.data, channel), self.used, strict=True)
            found[channel] = float(np.sqrt(np.nanmean(np.concatenate([e[mask] for e, mask in errors]) ** 2)))
        return found

    @property
    def notes(self) -> tuple[str, ...]:
        """Return what limits the fit, in sentences."""
        told = []
        if self.stop is Stop.STALLED:
            told.append("The descent stalled before a minimum: try more starts, or other start values.")
        if self.stop is Stop.ITERATIONS:
            told.append("The limit of iterations ended the fit before its minimum: give more iterations.")
        rmse = self.rmse
        for channel, change in self.integration.items():
            if change > _MOVED * rmse[channel]:
                told.append(
                    f"With half the step of the integration the free run of {channel} moves by {change:.4g}, and its "
                    f"RMSE is {rmse[channel]:.4g}: the network has learned the error of the steps too. Give the model "
                    "more substeps."
                )
        weights = self._weights
        ends = [p for p in self.model.parameters if _at_an_end(p, self.model.values.get(p.name, np.nan))]
        for p in ends:
            if p.name not in weights:
                told.append(
                    f"{p.name} = {self.model.values[p.name]:.4g} {p.unit}".rstrip() + " lies at an end of its box."
                )
        if count := sum(p.name in weights for p in ends):
            told.append(
                f"Weights at their limit: {count}. The law that is learned may be steeper, or need less neurons."
            )
        return tuple(told)

    @property
    def _weights(self) -> set[str]:
        return {parameter.name for placed in self.hybrid.networks for parameter in placed.term.parameters}

    def _content(self) -> Iterator[Part]:
        weights = self._weights
        free = [p for p in self.model.parameters if p.lower < p.upper]
        told = "".join(
            f"; {p.name} = {self.model.values[p.name]:.4g} {p.unit}".rstrip() for p in free if p.name not in weights
        )
        where = ", ".join(f"{placed.topology}, {placed.couplings}" for placed in self.hybrid.networks)
        started = f"start {self.search.winner + 1} of {len(self.search.descents)}"
        yield f"{where}, {sum(p.name in weights for p in free)} weights{told}; {started}: {self.stop.value}"
        units = {channel.name: channel.unit for channel in self.data.channels}
        errors = (f"{channel} {rmse:.4g} {units.get(channel, '')}".rstrip() for channel, rmse in self.rmse.items())
        yield f"RMSE of the free run: {', '.join(errors)}"
        yield from self.notes

    def to_dict(self) -> dict[str, Any]:
        """Return the estimated model, the free run and the result of the search as plain data."""
        return {
            "networks": [
                {"name": placed.term.name, "topology": placed.topology, "couplings": plain(placed.couplings)}
                for placed in self.hybrid.networks
            ],
            "model": self.model.to_dict(),
            "cost": plain(self.fit.cost),
            "simulated": plain(self.fit.simulated),
            "trained": plain(self.trained),
            "integration": plain(self.integration),
            "search": str(self.search),
            "notes": list(self.notes),
        }


def _at_an_end(p: Parameter, value: float) -> bool:
    """Return whether a free parameter lies at an end of its box."""
    near = _END * (p.upper - p.lower if np.isfinite(p.upper - p.lower) else 0.0)
    return p.lower < p.upper and min(value - p.lower, p.upper - value) <= near
