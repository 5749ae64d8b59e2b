"""Rename a model's channels to those of the data, and set its sampling time."""

from __future__ import annotations

import json
from collections.abc import Sequence

from smid.data import DataError, Dataset
from smid.data.dataset import check_dataset
from smid.models import Model, ModelError
from smid.models.edit_lines import rename_channels
from smid.models.running import at_sampling_time
from smid.models.units import check_channel_units, check_units

_DEFAULTS = {"u", "y"}
"""The channels of a built-in model whose user names none; any other name was given, and must be in the data."""


def bind(model: Model, data: Dataset) -> Model:
    """Return the model with the data's sampling time, and with its input ``u`` and output ``y`` renamed.

    They get the names of the only input and the only output of the data. Other names are never changed.

    Raises
    ------
    TypeError
        If the data are no `smid.Dataset`.
    DataError
        If a channel name is not a valid identifier.
    ModelError
        If the model is continuous and has another sampling time than the data, or states another unit of a channel.

    Examples
    --------
    >>> from smid.models import OutputError
    >>> data = Dataset.from_arrays(input={"current": [0, 1, 1]}, output={"pressure": [0, 0, 1]}, sampling_time=1.0)
    >>> bind(OutputError(), data).channels
    ('current', 'pressure')
    """
    check_dataset(data)
    names = {c.name for c in data.channels}
    renamed: dict[str, str] = {}
    clumsy = [c for c in (*data.inputs, *data.outputs) if not c.isidentifier()]
    if clumsy:
        raise DataError(
            f"channel {clumsy[0]!r} is not a valid name: rename it, as in data.rename({{{clumsy[0]!r}: 'u'}})"
        )
    sides = ((model.exogenous_channels, data.inputs), (model.output_channels, data.outputs))
    single = all(len(own) == len(given) == 1 for own, given in sides)
    if single:
        # Rename both: the model's name for one channel may be the data's name for the other, or for a further one.
        renamed = {own[0]: given[0] for own, given in sides if own[0] in _DEFAULTS}
    # Otherwise rename the single missing channel of a side.
    for own, given in () if renamed else sides:
        missing = [c for c in own if c not in names]
        if len(missing) == 1 and missing[0] in _DEFAULTS and len(given) == 1 and given[0] not in own:
            renamed[missing[0]] = given[0]
    bound = at_sampling_time(rename_channels(model, renamed), data.sampling_time)
    check_channel_units(bound, {c.name: c.unit for c in data.channels})
    return bound


def _listed(names: Sequence[str]) -> str:
    return f"[{', '.join(map(json.dumps, names))}]"


def bind_whole(model: Model, data: Dataset) -> Model:
    """Return the model bound to data whose units and roles the user has stated.

    Beside the errors of `bind`, a ModelError for equations that contradict the units, and for one of several inputs or
    outputs that the model does not have.
    """
    model = bind(model, data)
    check_units(model, {channel.name: channel.unit for channel in data.channels})
    for role, given in (("input", data.inputs), ("output", data.outputs)):
        for name in given if len(given) > 1 else ():
            if name not in model.channels:
                raise ModelError(
                    f"the model does not have the channel {name!r} (it has {', '.join(model.channels)}): leave out the "
                    f"{role} {name}, or state all {role}s in the model, as in {role} = {_listed(given)}"
                )
    return model
