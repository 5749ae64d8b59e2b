"""Section 6.2.4: a time constant and a network estimated at once, on the plant of (5.12).

The plant has tau = 2 and a = 2. The model starts at tau = 4 and a = 1, and the network must learn the missing y. There
are three ways: the network in the balance, reading the concentration (listing K.11); a static network parallel to the
model; and a dynamic one parallel to the model, the thesis's first attempt.

Reference: hybrid thesis, section 6.2.4, appendix E, (5.12)-(5.13), listings K.9 to K.11.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from relaxations.deadline import Progress
from smid.display.result import Part, Tabular
from smid.display.table import Table
from smid.hybrid.back_couplings import SIMPLE, STATIC, BackCouplings
from smid.hybrid.embedded import embedded
from smid.hybrid.estimate import estimate
from smid.hybrid.hybrid_model import HybridModel
from smid.hybrid.simultaneous import simultaneous
from smid.models import Model, signal, t
from smid.theses.hybrid.plants import MISMATCHES
from smid.theses.hybrid.reactor.records import free_run, reactor_record, white_reactor

__all__ = ["TimeConstants", "balance_with_network", "time_constant_study"]

PLANT = "time_constant_and_factor"
BOX = (0.5, 8.0)
WAYS: Mapping[str, BackCouplings | None] = {
    "static, in the balance": None,
    "static, beside the model": STATIC,
    "simple, beside the model": SIMPLE,
    "(2, 2), beside the model": BackCouplings(2, 2),
}


@dataclass(frozen=True, eq=False, repr=False)
class TimeConstants(Tabular):
    """Estimates of the time constant by way, one for each start, shape (n_starts,).

    Parameters
    ----------
    tau
        In seconds.
    rmse
        Of the free run on the training record.
    largest
        Output error under the constant input.
    """

    tau: Mapping[str, np.ndarray[Any, np.dtype[np.float64]]]
    rmse: Mapping[str, np.ndarray[Any, np.dtype[np.float64]]]
    largest: Mapping[str, np.ndarray[Any, np.dtype[np.float64]]]

    @property
    def table(self) -> Table:
        """Return the ranges over the starts."""
        rows = tuple(
            (way, *(_range(values[way]) for values in (self.tau, self.rmse, self.largest))) for way in self.tau
        )
        return Table(
            f"The time constant, 4 s at the start and {MISMATCHES[PLANT].tau:g} s in the plant: "
            f"range over {len(next(iter(self.tau.values())))} starts.",
            ("network", "tau in s", "RMSE in training", "largest error, constant input"),
            rows,
            "lrrr",
        )

    @property
    def conclusion(self) -> str:
        """Return the estimated time constants in a sentence."""
        true, ranges = MISMATCHES[PLANT].tau, []
        for way, values in self.tau.items():
            ranges.append(f"{_range(values)} s with a network, {way}")
        return f"The time constant, {true:g} s in the plant, is estimated as {'; '.join(ranges)}."

    def _content(self) -> Iterator[Part]:
        yield self.table
        yield self.conclusion

    def _rows(self) -> Iterator[dict[str, Any]]:
        """Return a row for each way and start."""
        for way in self.tau:
            columns = (values[way].tolist() for values in (self.tau, self.rmse, self.largest))
            for start, (tau, rmse, largest) in enumerate(zip(*columns, strict=True)):
                yield {"network": way, "start": start, "tau": tau, "rmse": rmse, "largest": largest}

    def to_dict(self) -> dict[str, Any]:
        """Return plain data."""
        return {
            way: {"tau": self.tau[way].tolist(), "rmse": self.rmse[way].tolist(), "largest": self.largest[way].tolist()}
            for way in self.tau
        }


def balance_with_network(white: Model, hidden: tuple[int, ...] = (1,)) -> HybridModel:
    """Return the reactor with a network in its balance: ``tau y' + y + N(y) = K(tau) u``."""
    return embedded(white, {"w": -1 / white.parameter("tau").symbol}, [signal("w")[t]], hidden)


def time_constant_study(
    *, starts: int = 5, iterations: int = 100, seed: int = 1, progress: Progress | None = None
) -> TimeConstants:
    """Estimate tau together with the network, from several starts for each way.

    Examples
    --------
    >>> sorted(time_constant_study(starts=1, iterations=1).tau) == sorted(WAYS)
    True
    """
    data, held_out = reactor_record(PLANT, seed=seed), reactor_record(PLANT, "constant")
    base = white_reactor(PLANT)
    begin = {"tau": base.parameter("tau").lower}
    results: dict[str, list[tuple[float, float, float]]] = {}
    for way, couplings in WAYS.items():
        hybrid = (
            balance_with_network(base.bound(tau=BOX).with_values(begin))
            if couplings is None
            else simultaneous(base.with_values(begin), {"tau": BOX}, couplings)
        )
        for number in range(starts):
            if progress is not None:
                progress(f"{way}: start {number + 1}")
            found = estimate(hybrid, data, starts=1, iterations=iterations, seed=seed + number)
            deviation = np.abs(free_run(found.hybrid, held_out) - held_out.values("y"))
            rmse = float(np.sqrt(np.mean(found.fit.residual(data, "y")[0] ** 2)))
            results.setdefault(way, []).append((found.model.values["tau"], rmse, float(deviation.max())))
    columns = {way: np.array(rows).T for way, rows in results.items()}
    return TimeConstants(*({way: rows[k] for way, rows in columns.items()} for k in range(3)))


def _range(values: np.ndarray[Any, np.dtype[np.float64]]) -> str:
    low, high = f"{values.min():.4g}", f"{values.max():.4g}"
    return low if low == high else f"{low} to {high}"
