"""``smid track``: certified intervals that follow a record or a stream, sample by sample."""

from __future__ import annotations

import sys
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import click
import numpy as np

from smid.cli.console import Command
from smid.cli.live import LiveIntervals
from smid.cli.loading import load_record
from smid.cli.options import POSITIVE, NoiseBound, Record, option, read_known_bounds, takes
from smid.cli.outputs import Outputs, writes
from smid.cli.stream import Stream
from smid.data import DataError, Dataset
from smid.models.parts import plain_name
from smid.recursive.arx import Arx
from smid.recursive.set_membership import RecursiveSet
from smid.recursive.tracked_set import Sample, TrackedSet, follow, samples_of
from smid.reports.documents import study_document
from smid.reports.formats import write_page
from smid.reports.track_page import track_page

Range = tuple[float, float]

WIDE = 100.0
"""First interval of a numerator coefficient, as a multiple of the span of the output over that of the input."""


def _read_drift(context: click.Context, parameter: click.Parameter, text: str | None) -> float | dict[str, float]:
    """Return the drift in a text such as ``1e-4`` or ``a1=1e-4,b0=1e-3``."""
    try:
        if text is None or "=" not in text:
            return float(text or 0.0)
        return {name.strip(): float(value) for name, value in (part.split("=") for part in text.split(","))}
    except ValueError:
        raise click.BadParameter(
            f"{text!r} gives no drift: write 1e-4, or a1=1e-4,b0=1e-3", context, parameter
        ) from None


def _read_ranges(context: click.Context, parameter: click.Parameter, text: str | None) -> dict[str, Range]:
    """Return the intervals in a text such as ``b0=-10:10,b1=0:5``."""
    found = {}
    for part in (text or "").split(",") if text else ():
        name, _, ends = part.partition("=")
        try:
            low, high = map(float, ends.split(":"))
        except ValueError:
            raise click.BadParameter(f"{part!r} gives no interval: write b0=-10:10", context, parameter) from None
        found[name.strip()] = (low, high)
    return found


@dataclass(frozen=True)
class Structure:
    """The structure of a linear model, and where its noise enters."""

    poles: int = option(type=click.IntRange(min=0), default=1, show_default=True, help="Number of poles.")
    zeros: int = option(type=click.IntRange(min=0), default=0, show_default=True, help="Degree of each numerator.")
    delay: int = option(type=click.IntRange(min=0), default=1, show_default=True, help="Samples from input to output.")
    offset: bool = option(is_flag=True, help="Estimate a constant too.")
    error: str = option(
        type=click.Choice(["output", "equation"]),
        default="output",
        show_default=True,
        help="Noise on the output, or on the equation.",
    )

    def arx(self, inputs: int) -> Arx:
        """Return the structure with so many inputs."""
        return Arx(self.poles, self.zeros, self.delay, offset=self.offset, inputs=inputs)


@dataclass(frozen=True)
class Tracked:
    """How the set is followed."""

    noise_bound: float = option(
        required=True, type=POSITIVE, metavar="D", help="Noise bound of the output in its unit."
    )
    input_noise_bound: tuple[NoiseBound, ...] | None = option(
        callback=read_known_bounds,
        metavar="D|U=D,...",
        help="Noise bound of the inputs: one number, or one for each. [default: exact inputs]",
    )
    drift: float | dict[str, float] = option(
        callback=_read_drift,
        metavar="D|P=D,...",
        help="Largest change of a parameter from one sample to the next. [default: constant parameters]",
    )
    bounds: dict[str, Range] = option(
        callback=_read_ranges,
        metavar="P=LOW:HIGH,...",
        help="First interval of parameters. [default: stable poles; for a file, wide intervals of the others]",
    )
    memory: int = option(type=click.IntRange(min=20), default=400, show_default=True, help="Number of stored samples.")
    refine_every: int = option(
        type=click.IntRange(min=0), default=0, metavar="N", help="Refine after every N samples. [default: at the end]"
    )
    pieces: int = option(
        type=click.IntRange(min=0), default=64, show_default=True, help="Pieces of a refinement; 0: none."
    )
    live: bool | None = option(
        "--live/--no-live", default=None, help="Draw the intervals while samples arrive. [default: on a terminal]"
    )

    def input_bounds(self, inputs: Sequence[str]) -> list[float]:
        """Return the noise bound of each input; a usage error names a bound of no input."""
        stated = {
            plain_name(bound.channel) if bound.channel else None: bound.value for bound in self.input_noise_bound or ()
        }
        wrong = [name for name in stated if name is not None and name not in inputs]
        if wrong:
            raise click.UsageError(f"--input-noise-bound: {wrong[0]!r} is none of {', '.join(inputs)}")
        return [stated.get(name, stated.get(None, 0.0)) for name in inputs]


@click.command(cls=Command)
@takes(record=Record, structure=Structure, tracked=Tracked)
@writes("json", "report")
def track(record: Record, structure: Structure, tracked: Tracked, outputs: Outputs) -> None:
    """Follow certified intervals of a linear model sample by sample, and prove changes of the plant.

    DATA is the record (a CSV file), or - for a stream of comma-separated lines on standard input, with a header line.
    """
    live = sys.stderr.isatty() if tracked.live is None else tracked.live
    errors = list[DataError]()
    if record.path == "-":
        found = _of_stream(record, structure, tracked, live, errors)
    else:
        data = load_record(record, None)
        data = _chosen(data)
        estimator = _estimator(data.inputs, structure, tracked, _wide(data, structure))
        samples = _followed(estimator, samples_of(data), tracked, live, errors)
        found = TrackedSet.of(data, estimator, samples)
    outputs.say(found)
    outputs.write(study_document("track", found.to_dict()))
    settings = {
        "model": str(found.estimator.arx),
        "noise": f"{tracked.noise_bound:g}, on the {structure.error}",
        "noise of inputs": ", ".join(f"{bound:g}" for bound in tracked.input_bounds(found.data.inputs)),
        "drift per sample": str(tracked.drift),
        "first intervals": ", ".join(f"{n} {low:g} to {high:g}" for n, (low, high) in found.estimator.bounds.items()),
        "memory": f"{tracked.memory} samples",
        "refinement": f"{tracked.pieces} pieces, "
        + (f"every {tracked.refine_every} samples" if tracked.refine_every else "at the end"),
    }
    outputs.write_report(lambda path: write_page(track_page(found, settings), path))
    if errors:
        raise DataError(f"{errors[0]}. The result is that of the {len(found.history.lower)} samples before.")


def _chosen(data: Dataset) -> Dataset:
    """Return the record; a usage error unless it has one output."""
    if len(data.outputs) != 1:
        raise click.UsageError(f"smid track follows one output, not {', '.join(data.outputs)}: give one --output")
    return data


def _estimator(inputs: Sequence[str], structure: Structure, tracked: Tracked, wide: dict[str, Range]) -> RecursiveSet:
    return RecursiveSet(
        structure.arx(len(inputs)),
        tracked.noise_bound,
        wide | tracked.bounds,
        error="output" if structure.error == "output" else "equation",
        memory=tracked.memory,
        input_noise_bound=tracked.input_bounds(inputs),
        drift=tracked.drift,
    )


def _wide(data: Dataset, structure: Structure) -> dict[str, Range]:
    """Return wide first intervals of all parameters but the poles, in proportion to the spans of the channels.

    A usage error names an input that does not move.
    """
    arx, output = structure.arx(len(data.inputs)), data.stacked(data.output)
    height, found = float(np.nanmax(np.abs(output))) or 1.0, list[Range]()
    for name in data.inputs:
        span = float(np.nanmax(data.stacked(name)) - np.nanmin(data.stacked(name)))
        if not span > 0:
            raise click.UsageError(
                f"the input {name} is constant, which says nothing of the plant: take samples in which it moves"
            )
        reach = WIDE * (float(np.nanmax(output) - np.nanmin(output)) or height) / span
        found += [(-reach, reach)] * (structure.zeros + 1)
    found += [(-WIDE * height, WIDE * height)] if structure.offset else []
    return dict(zip(arx.names[structure.poles :], found, strict=True))


def _followed(
    estimator: RecursiveSet, samples: Iterable[Sample], tracked: Tracked, live: bool, errors: list[DataError]
) -> list[Sample]:
    """Return the samples that were followed; an error after the first one ends them, and is kept."""
    view, every = LiveIntervals(draws=live), tracked.refine_every
    try:
        return follow(estimator, samples, every=every, pieces=tracked.pieces, show=view, ended=errors.append)
    finally:
        view.close()


def _of_stream(
    record: Record, structure: Structure, tracked: Tracked, live: bool, errors: list[DataError]
) -> TrackedSet:
    """Follow standard input until it ends, or until Ctrl-C or an error."""
    columns = record.columns
    if not columns.input or len(columns.output) != 1:
        raise click.UsageError("a stream needs --input U and one --output Y, as its header line names them")
    if record.start is not None or record.stop is not None:
        raise click.UsageError("--start and --stop belong to a file: leave them out for a stream")
    stream = Stream(sys.stdin, columns.input, columns.output[0], columns.time, columns.sampling_time)
    names = [plain_name(name) for name in columns.input]
    estimator = _estimator(names, structure, tracked, {})
    samples = _followed(estimator, stream, tracked, live, errors)
    table = np.array([[*sample.inputs, sample.output] for sample in samples])
    channels = dict(zip([*names, plain_name(columns.output[0])], table.T, strict=True))
    run = Dataset.from_arrays(
        input={name: channels[name] for name in names},
        output={plain_name(columns.output[0]): channels[plain_name(columns.output[0])]},
        sampling_time=stream.sampling_time or 1.0,
    )
    return TrackedSet.of(replace(run, source="standard input"), estimator, samples)
