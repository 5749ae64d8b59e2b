"""Topologies: properties of a hybrid structure that the analysis needs."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import ClassVar

import sympy

from smid.display.plugins import find_subclass, subclass_names
from smid.models.errors import refuse_unknown

__all__ = ["Topology", "topology_named"]

GROUP = "smid.topologies"


class Topology(ABC):
    """Structure of a hybrid model; its name is the `HybridModel.topology`.

    A subclass is found by name after its import, or by an entry point of the group ``smid.topologies``.

    Examples
    --------
    >>> from smid.hybrid.topology import topology_named
    >>> topology_named("series").__name__
    'Series'
    """

    name: ClassVar[str]

    @staticmethod
    @abstractmethod
    def learned(plant: sympy.Expr, white: sympy.Expr) -> sympy.Expr:
        """Return the transfer function that the network must learn, from those of plant and model."""

    @staticmethod
    def white_output(amplitude: float) -> float:
        """Return the first-principles output that belongs to a constant input of the network alone."""
        return amplitude


def topology_named(name: str) -> type[Topology]:
    """Return the topology with a name; raise ModelError if there is none."""
    found = find_subclass(Topology, name, GROUP, _name)  # type: ignore[type-abstract]
    if found is None:
        known = subclass_names(Topology, GROUP, _name)  # type: ignore[type-abstract]
        refuse_unknown("topology", [name], [item for item in known if item != name])
    assert found is not None
    return found


def _name(item: type[Topology]) -> str:
    return item.name
