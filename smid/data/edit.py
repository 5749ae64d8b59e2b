"""Selections and transformations of a data set; `Dataset` offers each as a method."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from smid.data.channel import Channel, name_hint
from smid.data.errors import DataError
from smid.data.experiment import Experiment
from smid.data.normalise import Normalisation, NormalisationMethod, measure_normalisation
from smid.data.resample import Resampling

if TYPE_CHECKING:
    from smid.data.dataset import Dataset


def slice_samples(experiment: Experiment, samples: range, sampling_time: float) -> Experiment:
    """Return a range of samples of an experiment, with its start time."""
    values = {
        name: array[samples.start : max(samples.start, samples.stop)] for name, array in experiment.values.items()
    }
    return Experiment(experiment.name, values, experiment.start_time + samples.start * sampling_time)


def rename(dataset: "Dataset", names: Mapping[str, str]) -> "Dataset":
    """See `Dataset.rename`."""
    for name in names:
        if name not in dataset.names:
            raise DataError(
                f"channel {name!r} cannot be renamed: there is no such channel; {name_hint(name, dataset.names)}"
            )
    full = {name: names.get(name, name) for name in dataset.names}
    scaled = dataset.normalisation
    return replace(
        dataset,
        experiments=tuple(
            replace(run, values={full[name]: values for name, values in run.values.items()})
            for run in dataset.experiments
        ),
        channels=tuple(replace(channel, name=full[channel.name]) for channel in dataset.channels),
        inputs=tuple(full[name] for name in dataset.inputs),
        outputs=tuple(full[name] for name in dataset.outputs),
        resampling=tuple(
            replace(r, curvature_error={full[name]: error for name, error in r.curvature_error.items()})
            for r in dataset.resampling
        ),
        normalisation=scaled
        and replace(
            scaled,
            offset={full[name]: value for name, value in scaled.offset.items()},
            scale={full[name]: value for name, value in scaled.scale.items()},
            units={full[name]: value for name, value in scaled.units.items()},
        ),
    )


def crop(dataset: "Dataset", start: int | None = None, stop: int | None = None) -> "Dataset":
    """Return the samples `start:stop` of every experiment, counted as in a Python slice."""
    for bound in (start, stop):
        if bound is not None and not isinstance(bound, (int, np.integer)):
            raise DataError(f"crop counts samples but got {bound!r}; use crop_time for seconds")
    return replace(
        dataset,
        experiments=tuple(
            slice_samples(run, range(run.n_samples)[start:stop], dataset.sampling_time) for run in dataset.experiments
        ),
    )


def crop_time(dataset: "Dataset", start: float | None = None, stop: float | None = None) -> "Dataset":
    """Return the samples with start <= time < stop of every experiment, in seconds."""

    def first_at_or_after(run: Experiment, time: float) -> int:
        # The slack keeps a sample whose instant k Ts misses the asked time by rounding alone.
        k = int(np.ceil((time - run.start_time) / dataset.sampling_time - 1e-6))
        return min(max(k, 0), run.n_samples)

    runs = []
    for run in dataset.experiments:
        first = 0 if start is None else first_at_or_after(run, start)
        last = run.n_samples if stop is None else first_at_or_after(run, stop)
        runs.append(slice_samples(run, range(first, last), dataset.sampling_time))
    return replace(dataset, experiments=tuple(runs))


def split(dataset: "Dataset", fraction: float) -> "tuple[Dataset, Dataset]":
    """See `Dataset.split`."""
    heads, tails = [], []
    for run in dataset.experiments:
        n_head = round(fraction * run.n_samples) if 0 < fraction < 1 else 0
        if not 0 < n_head < run.n_samples:
            raise DataError(
                f"split({fraction}) leaves a part of experiment {run.name!r} empty "
                f"({run.n_samples} samples); give a fraction strictly between 0 and 1 "
                "that leaves samples on both sides"
            )
        heads.append(slice_samples(run, range(n_head), dataset.sampling_time))
        tails.append(slice_samples(run, range(n_head, run.n_samples), dataset.sampling_time))
    return replace(dataset, experiments=tuple(heads)), replace(dataset, experiments=tuple(tails))


def decimate(dataset: "Dataset", factor: int, antialias: bool, held: str | Sequence[str]) -> "Dataset":
    """See `Dataset.decimate`."""
    if not isinstance(factor, (int, np.integer)) or factor < 1:
        raise DataError(f"the decimation factor is {factor!r}; give an integer from 1 on")
    held = (held,) if isinstance(held, str) else held
    for name in held:
        dataset.channel(name)
    if factor == 1:
        return dataset
    lost = [name for name, count in dataset.missing.items() if count and (antialias or name in held)]
    if lost:
        raise DataError(
            f"samples of {lost[0]!r} are missing, and the filter would read them; give antialias=False and leave "
            f"{lost[0]!r} out of held"
        )
    thin = _filtered if antialias else _every
    how = ["zero-phase FIR filter" if antialias else "no filter", *(f"means of {name}" for name in held)]
    return replace(
        dataset,
        experiments=tuple(
            replace(run, values={n: (_mean if n in held else thin)(x, factor) for n, x in run.values.items()})
            for run in dataset.experiments
        ),
        sampling_time=dataset.sampling_time * factor,
        n_init=-(-dataset.n_init // factor),
        source=f"{dataset.source}; decimated by {factor} ({', '.join(how)})".removeprefix("; "),
    )


def _every(array: NDArray[np.float64], factor: int) -> NDArray[np.float64]:
    return array[::factor]


def _mean(array: NDArray[np.float64], factor: int) -> NDArray[np.float64]:
    starts = np.arange(0, array.size, factor)
    return np.add.reduceat(array, starts) / np.diff(np.append(starts, array.size))


def _filtered(array: NDArray[np.float64], factor: int) -> NDArray[np.float64]:
    # scipy pads with zeros, which pulls the ends of a signal with an offset towards zero. Odd reflection about the end
    # samples keeps level and slope.
    if array.size == 1:
        return array
    from scipy.signal import decimate as filter_and_decimate  # takes a second to load

    half_length = 10 * factor
    extended = np.pad(array, half_length, mode="reflect", reflect_type="odd")
    thinned: NDArray[np.float64] = filter_and_decimate(extended, factor, ftype="fir", zero_phase=True)
    first = half_length // factor
    return thinned[first : first + -(-array.size // factor)]


def _map_channels(
    dataset: "Dataset", change: Callable[[str, NDArray[np.float64]], NDArray[np.float64]]
) -> tuple[Experiment, ...]:
    return tuple(
        replace(run, values={name: change(name, array) for name, array in run.values.items()})
        for run in dataset.experiments
    )


def normalise(dataset: "Dataset", method: "NormalisationMethod | Normalisation") -> "Dataset":
    """See `Dataset.normalise`."""
    if dataset.normalisation is not None:
        raise DataError("the data are normalised already; call denormalise() first")
    if isinstance(method, Normalisation):
        record = method
        for channel in dataset.channels:
            if channel.name not in record.offset:
                raise DataError(
                    f"the normalisation has no channel {channel.name!r}; {name_hint(channel.name, record.offset)}"
                )
    else:
        everything = {name: dataset.stacked(name) for name in dataset.names}
        record = measure_normalisation(everything, {c.name: c.unit for c in dataset.channels}, method)
    return replace(
        dataset,
        experiments=_map_channels(dataset, lambda name, x: (x - record.offset[name]) / record.scale[name]),
        channels=tuple(Channel(name) for name in dataset.names),
        normalisation=record,
    )


def denormalise(dataset: "Dataset") -> "Dataset":
    """Undo `normalise`, up to rounding."""
    record = dataset.normalisation
    if record is None:
        raise DataError("the data are not normalised; there is nothing to undo, leave denormalise() out")
    return replace(
        dataset,
        experiments=_map_channels(dataset, lambda name, x: record.offset[name] + record.scale[name] * x),
        channels=tuple(Channel(name, record.units.get(name, "")) for name in dataset.names),
        normalisation=None,
    )


def select(dataset: "Dataset", names: str | Sequence[str]) -> "Dataset":
    """Return the experiments of these names, in this order."""
    wanted = (names,) if isinstance(names, str) else tuple(names)
    positions = {run.name: k for k, run in enumerate(dataset.experiments)}
    for name in wanted:
        if name not in positions:
            raise DataError(f"no experiment {name!r}; {name_hint(name, positions)}")
    return replace(
        dataset,
        experiments=tuple(dataset.experiments[positions[name]] for name in wanted),
        resampling=tuple(dataset.resampling[positions[name]] for name in wanted) if dataset.resampling else (),
    )


def merge(datasets: "Sequence[Dataset]") -> "Dataset":
    """Return the experiments of several data sets in one; channels, roles and sampling time must agree."""
    if not datasets:
        raise DataError("no data sets were given to merge; give at least one")
    first = datasets[0]
    for other in datasets[1:]:
        for what, mine, theirs in (
            ("channels", set(first.channels), set(other.channels)),
            ("inputs", first.inputs, other.inputs),
            ("outputs", first.outputs, other.outputs),
            ("sampling time", first.sampling_time, other.sampling_time),
            ("warm-up", first.n_init, other.n_init),
            ("normalisation", first.normalisation, other.normalisation),
        ):
            if mine != theirs:
                raise DataError(f"the data sets to merge differ in their {what}; bring them to the same {what} first")
    records: list[Resampling] = []
    if any(dataset.resampling for dataset in datasets):
        for dataset in datasets:
            records += dataset.resampling or [
                Resampling("none", dataset.sampling_time, 0.0, 0.0, run.n_samples) for run in dataset.experiments
            ]
    return replace(
        first,
        experiments=tuple(run for dataset in datasets for run in dataset.experiments),
        resampling=tuple(records),
        source=", ".join(dict.fromkeys(dataset.source for dataset in datasets if dataset.source)),
    )
