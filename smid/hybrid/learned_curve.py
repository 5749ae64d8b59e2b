"""Curve that a network has learned, over the range that it was trained on, with its uncertainty."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from relaxations.algebra.arrays import Array
from smid.display.result import Part, Tabular
from smid.display.table import Table
from smid.hybrid.ensemble import Ensemble
from smid.hybrid.hybrid_estimate import HybridEstimate
from smid.hybrid.neural import NeuralTerm, network_output
from smid.models import ModelError

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["LearnedCurve", "learned_curve"]

_POINTS, _ROWS = 101, 7


@dataclass(frozen=True, eq=False, repr=False)
class LearnedCurve(Tabular):
    """What a network gives for its argument.

    Parameters
    ----------
    network
        Name of the network.
    argument
        Its input, as in the model.
    x, y
        Shape (n,). Over the trained range, in the model's units.
    deviation
        Shape (n,). Standard deviation of y; NaN without an ensemble.
    """

    network: str
    argument: str
    x: Array
    y: Array
    deviation: Array

    @property
    def lower(self) -> float:
        """Return the least argument."""
        return float(self.x[0])

    @property
    def upper(self) -> float:
        """Return the largest argument."""
        return float(self.x[-1])

    @property
    def table(self) -> Table:
        """Return some points of the curve."""
        rows = []
        for k in np.linspace(0, self.x.size - 1, _ROWS).round().astype(int).tolist():
            spread = f"{self.deviation[k]:.2g}" if np.isfinite(self.deviation[k]) else "-"
            rows.append((f"{self.x[k]:.4g}", f"{self.y[k]:.4g}", spread))
        return Table(f"Network {self.network}", (self.argument, "output", "std. deviation"), tuple(rows), "rrr")

    def _rows(self) -> Iterator[dict[str, Any]]:
        for x, y, deviation in zip(self.x.tolist(), self.y.tolist(), self.deviation.tolist(), strict=True):
            yield {"argument": x, "output": y, "standard_deviation": deviation}

    def _content(self) -> Iterator[Part]:
        yield self.table

    def plot(self) -> Figure:
        """Return a figure of the curve, with a band of two standard deviations."""
        from smid.hybrid.figures import curve_figure

        return curve_figure(self)


def learned_curve(found: HybridEstimate | Ensemble, network: str | None = None) -> LearnedCurve:
    """Return the curve that a network of one input has learned.

    Parameters
    ----------
    found
        An ensemble adds the standard deviation.
    network
        Name; needed if there are several.

    Raises
    ------
    ModelError
        If the network has several inputs, or is unknown.

    Examples
    --------
    >>> from smid.data import Dataset
    >>> from smid.hybrid import embedded, estimate
    >>> from smid.models import Reactor, signal, t
    >>> u = np.repeat(np.random.default_rng(1).uniform(0.1, 0.9, 20), 5)
    >>> data = Dataset.from_arrays(input={"u": u}, output={"y": u}, sampling_time=1.0)
    >>> found = estimate(embedded(Reactor(3.0), {"w": 1}, [signal("w")[t]], ()), data, starts=1, seed=1)
    >>> learned_curve(found).argument
    'w[t]'
    """
    whole = found.whole if isinstance(found, Ensemble) else found
    term = argument_of(whole, network)
    trained = next(known for known in whole.trained if known.network == term.name)
    x = np.linspace(trained.lower, trained.upper, _POINTS)

    def read(one: HybridEstimate) -> Array:
        return network_output(one.model, one.hybrid.network(term.name), x[:, None])

    deviation = found.deviation(read) if isinstance(found, Ensemble) else np.full(x.size, np.nan)
    return LearnedCurve(term.name, trained.input, x, read(whole), deviation)


def argument_of(found: HybridEstimate, network: str | None) -> NeuralTerm:
    """Return the network of that name, which has to have one input."""
    term = found.hybrid.network(network)
    if len(term.inputs) != 1:
        raise ModelError(
            f"the network {term.name!r} reads {len(term.inputs)} inputs: a law can be read from a network of one input"
        )
    return term
