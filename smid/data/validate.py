"""The checks that every data set passes before any work."""

from collections import Counter
from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

import numpy as np

from smid.data.channel import name_hint
from smid.data.errors import DataError

if TYPE_CHECKING:
    from smid.data.dataset import Dataset
    from smid.data.experiment import Experiment


_LARGEST = 1e100  # the cube of it, summed over a record, does not overflow


def positive(sampling_time: Any) -> float:
    """Return a sampling time as a float; DataError if it is no positive number."""
    try:
        found = float(sampling_time)
    except (TypeError, ValueError):
        found = np.nan
    if not (np.isfinite(found) and found > 0):
        raise DataError(f"sampling_time = {sampling_time} is not positive; give it in seconds")
    return found


def validate(dataset: "Dataset") -> None:
    """Refuse a data set that is not consistent: DataError with the cause and the cure."""
    positive(dataset.sampling_time)
    if not dataset.experiments:
        raise DataError("the data set has no experiments; give at least one")
    _refuse_duplicates("channel", dataset.names)
    _refuse_duplicates("experiment", (run.name for run in dataset.experiments))
    for role, names in (("input", dataset.inputs), ("output", dataset.outputs)):
        if not names:
            raise DataError(f"no {role} is named; name at least one channel as {role}")
        for name in names:
            if name not in dataset.names:
                raise DataError(f"the {role} {name!r} is not a channel; {name_hint(name, dataset.names)}")
    _refuse_duplicates("input or output", (*dataset.inputs, *dataset.outputs))
    for run in dataset.experiments:
        _validate_run(dataset, run)
    if len(dataset.resampling) not in (0, len(dataset.experiments)):
        raise DataError(
            f"{len(dataset.resampling)} resampling records for {len(dataset.experiments)} experiments; "
            "give one for each or none"
        )


def _validate_run(dataset: "Dataset", run: "Experiment") -> None:
    """Refuse an experiment whose channels, samples or warm-up do not fit the data set."""
    for name in dataset.names:
        if name not in run.values:
            raise DataError(f"experiment {run.name!r} has no channel {name!r}; {name_hint(name, run.values)}")
    for name, array in run.values.items():
        if name not in dataset.names:
            raise DataError(
                f"experiment {run.name!r} has a channel {name!r} that the data set does not list; "
                "add it to the channels or leave it out"
            )
        if name in dataset.outputs and np.isnan(array).all():
            raise DataError(f"every sample of {name!r} is missing in experiment {run.name!r}; leave one of them out")
        bad = np.flatnonzero(np.isinf(array) if name in dataset.outputs else ~np.isfinite(array))
        if bad.size:
            k = int(bad[0])
            instant = run.start_time + k * dataset.sampling_time
            raise DataError(
                f"channel {name!r} of experiment {run.name!r} is {array[k]} at sample {k} "
                f"(t = {instant:g} s); correct it, or crop the record around it"
            )
        largest = float(np.nanmax(np.abs(array), initial=0.0))
        if largest > _LARGEST:
            raise DataError(
                f"channel {name!r} of experiment {run.name!r} reaches {largest:g}, and the products of "
                f"such samples exceed what a float holds; state the channel in a larger unit, below {_LARGEST:g}"
            )
    if not 0 <= dataset.n_init < run.n_samples:
        raise DataError(
            f"n_init = {dataset.n_init} leaves no sample of experiment {run.name!r} "
            f"({run.n_samples} samples); choose a warm-up from 0 to below the number of samples"
        )


def _refuse_duplicates(what: str, names: Iterable[str]) -> None:
    for name, count in Counter(names).items():
        if count > 1:
            raise DataError(f"{what} {name!r} occurs {count} times; give each its own name")
