"""Fit a model's channel names and sampling time to the data's.

A model written with the default names ``u`` and ``y`` is meant for whatever the data call their input and output, and
one in derivatives without a sampling time for whatever the data were sampled at.
"""

from __future__ import annotations

from smid.data import DataError, Dataset
from smid.models import Model
from smid.models.edit_lines import rename_channels
from smid.models.running import at_sampling_time


def bind(model: Model, data: Dataset) -> Model:
    """Rename the model's only missing input and output channel, and take over the data's sampling time.

    Returns
    -------
    Model
        The model itself where all its channels are in the data, or where no single pair fits (the check of the data
        names what is missing).

    Raises
    ------
    DataError
        If a channel's name cannot stand in an equation.
    ModelError
        If the model has rates and another sampling time than the data.

    Examples
    --------
    >>> from smid.models import OutputError
    >>> data = Dataset.from_arrays(input={"current": [0, 1, 1]}, output={"pressure": [0, 0, 1]}, sampling_time=1.0)
    >>> bind(OutputError(), data).channels
    ('current', 'pressure')
    """
    names = {c.name for c in data.channels}
    renamed: dict[str, str] = {}
    clumsy = [c for c in (*data.inputs, *data.outputs) if not c.isidentifier()]
    if clumsy:
        raise DataError(
            f"channel {clumsy[0]!r} cannot stand in an equation: rename it, as in data.rename({{{clumsy[0]!r}: 'u'}})"
        )
    sides = ((model.input_channels, data.inputs), (model.output_channels, data.outputs))
    if not names.issuperset(model.channels) and all(len(own) == len(given) == 1 for own, given in sides):
        # One input and one output on either side: the default name of one may be the other's column.
        renamed = {own[0]: given[0] for own, given in sides}
    for own, given in () if renamed else sides:
        missing = [c for c in own if c not in names]
        if len(missing) == 1 and len(given) == 1 and given[0] not in own:
            renamed[missing[0]] = given[0]
    return at_sampling_time(rename_channels(model, renamed), data.sampling_time)
