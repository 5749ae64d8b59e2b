"""A cell of a study: one identification of the grid, and the key under which its outcome is saved."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from relaxations.proof.method import Cuts, Method
from smid.data import Dataset
from smid.display.from_plain import fields_from_plain, read
from smid.display.result import plain
from smid.models import Model, ModelError
from smid.study.versions import computing_versions


@dataclass(frozen=True)
class Settings:
    """The settings that all cells of a study share; see :func:`smid.identify`.

    Examples
    --------
    >>> Settings(rounds=3)
    Settings(solver='clarabel', tolerance=0.0001, rounds=3, nodes=0)
    """

    solver: str = "clarabel"
    tolerance: float = 1e-4
    rounds: int = 10
    nodes: int = 0


@dataclass(frozen=True)
class Cell:
    """One combination of record, samples, noise bound, method and order.

    Parameters
    ----------
    samples
        Number of first samples of each experiment of the record.
    noise_bound
        Of every noisy channel, in the channel's unit.
    method
        The short name, or the name of the method object.

    Examples
    --------
    >>> print(Cell("run", 40, (("y", 0.1),), "auto", 2))
    run, N = 40, bound 0.1, auto, order 2
    """

    record: str
    samples: int
    noise_bound: tuple[tuple[str, float], ...]
    method: str
    order: int

    @property
    def bound_text(self) -> str:
        """Return the noise bounds in words, without the channel if there is only one."""
        if len(self.noise_bound) == 1:
            return f"{self.noise_bound[0][1]:.6g}"
        return ", ".join(f"{bound:.6g} on {channel}" for channel, bound in self.noise_bound)

    def __str__(self) -> str:
        return f"{self.record}, N = {self.samples}, bound {self.bound_text}, {self.method}, order {self.order}"

    def to_dict(self) -> dict[str, Any]:
        """Return plain data."""
        return {**vars(self), "noise_bound": dict(self.noise_bound)}

    @staticmethod
    def from_dict(content: Mapping[str, Any]) -> Cell:
        """Return the cell that :meth:`to_dict` wrote."""
        bounds = read(content, "noise_bound", Mapping[str, float])
        found: Cell = fields_from_plain(Cell, content, noise_bound=tuple(bounds.items()))
        return found


def method_fields(method: Method | Cuts) -> dict[str, Any]:
    """Return class and fields of a method object; ModelError where a field is not plain data.

    Examples
    --------
    >>> from relaxations.proof import Lift
    >>> method_fields(Lift(order=2))
    {'class': 'relaxations.proof.method.Lift', 'order': 2}
    """
    kind = type(method)
    try:
        return {"class": f"{kind.__module__}.{kind.__qualname__}", **plain(vars(method))}
    except TypeError as error:
        raise ModelError(f"method {method.name!r} cannot be saved with a study: {error}") from None


@dataclass(frozen=True)
class Job:
    """A cell with all that its computation needs, for a worker process.

    ``versions`` are those of the process that saves the results; a worker with other versions must not compute.
    """

    cell: Cell
    method: str | Method | Cuts
    model: Model
    data: Dataset
    settings: Settings
    versions: Mapping[str, str]

    @staticmethod
    def of(cell: Cell, method: str | Method | Cuts, model: Model, record: Dataset, settings: Settings) -> Job:
        """Return the job of a cell, with the samples of its record."""
        return Job(cell, method, model, record.crop(0, cell.samples), settings, computing_versions())

    @property
    def key(self) -> str:
        """Return the SHA-256 of data, model, method, settings and versions; equal keys mean equal intervals."""
        content = {
            "data": self.data.checksum,
            "model": self.model.to_dict(),
            "noise_bound": dict(self.cell.noise_bound),
            "method": self.method if isinstance(self.method, str) else method_fields(self.method),
            "order": self.cell.order,
            "settings": vars(self.settings),
            "versions": dict(self.versions),
        }
        return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()
