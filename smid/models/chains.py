"""Chains of effects on an input or on a sensor, in which the order matters.

A limit behind a lag is not a lag behind a limit. By default an edit stands at the end of a chain that the record shows,
next to the channel. The other places are between two effects, and next to the plant.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from smid.models.model import Model

__all__ = ["behind", "in_front_of", "signal_of"]


def signal_of(model: Model, channel: str) -> str:
    """Return the signal that a channel measures, or stands for at the place of the edit under way.

    An exact input has the name of its channel.

    Examples
    --------
    >>> from smid.models import OutputError
    >>> signal_of(OutputError(), "y"), signal_of(OutputError(), "u")
    ('w', 'u')
    """
    place = model.edit.places.get(channel) if model.edit else None
    if place is None:
        return _measured(model, channel)
    path = _path(model, channel)
    return path[path.index(place) + 1] if place in path else place


def behind(model: Model, channel: str) -> Iterator[str]:
    """Yield what each effect of the chain behind an input makes of it, from the channel to the plant.

    Examples
    --------
    >>> from smid.models import OutputError
    >>> limited = OutputError().edited_by("limit").insert_before("u", lambda u: u / 2)
    >>> list(behind(limited, "u"))
    ['u_new']
    """
    name = _measured(model, channel)
    while True:
        readers = {line.signal for line in model.lines if name in {read for read, _ in line.reads}}
        effects = {model.origins.get(reader, "") for reader in readers}
        (effect,) = effects if len(effects) == 1 else ("",)
        own = {line.signal for line in model.lines if effect and model.origins.get(line.signal) == effect}
        read = {read for line in model.lines if line.signal not in own for read, _ in line.reads}
        if len(own & read) != 1 or name in own:
            return
        (name,) = own & read
        yield name


def in_front_of(model: Model, channel: str) -> Iterator[str]:
    """Yield where each effect of the chain in front of an output begins, from the channel to the plant.

    Examples
    --------
    >>> from smid.models import OutputError
    >>> list(in_front_of(OutputError().edited_by("limit").insert_sensor("y", lambda w: w / 2), "y"))
    ['w_seen']
    """
    path = _path(model, channel)
    for outer, inner in pairwise(path):
        if model.origins[outer] != model.origins.get(inner):
            yield outer


def _measured(model: Model, channel: str) -> str:
    return next((m.signal for m in model.measurements if m.channel == channel), channel)


def _path(model: Model, channel: str) -> list[str]:
    """Return the signals from a sensor inwards: those that effects added, then one of the plant."""
    lines = {line.signal: line for line in model.lines}
    waiting = [[m.signal] for m in model.measurements if m.channel == channel and m.signal in lines]
    for path in waiting:
        if path[-1] not in model.origins:
            return path
        now = {name for name, lag in lines[path[-1]].reads if lag == 0}
        # In the order of the lines, whatever the signals are called.
        waiting += [[*path, name] for name in lines if name in now and name not in path]
    return []
