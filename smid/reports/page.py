"""Sections that several reports share: the data, the equations, and the label of simulated data."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator
from typing import TYPE_CHECKING

from smid.data import Dataset
from smid.data.listing import missing_notes
from smid.models import Model
from smid.reports import mathml
from smid.reports.content import Block, Equations, Facts, Picture, Rich, Section, joined

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def is_simulated(sources: Iterable[str]) -> bool:
    """Tell whether one of the sources says that its data come from a simulation."""
    return any("simulated" in source.casefold() for source in sources)


def capitalised(text: str) -> str:
    """Return the text with a capital first letter."""
    return text[:1].upper() + text[1:]


def parameter(name: str, unit: str, *, new: bool = False) -> Rich:
    """Return a parameter with its unit, for a table."""
    symbol = Rich(name, mathml.symbol(name, [name] if new else ()))
    return joined(symbol, f" [{unit}]" if unit else "")


def equations(model: Model, new: Collection[str] = ()) -> Equations:
    """Return the lines and measurements of a model, with the parameters ``new`` highlighted."""
    rows = mathml.equations(model, new)
    return Equations("Equations", _paired(model.equations().rows[: len(rows)], rows))


def priors(model: Model) -> Equations:
    """Return the constraints and the boxes of the parameters."""
    rows = mathml.priors(model)
    begin = len(model.lines) + len(model.measurements)
    return Equations("Prior knowledge", _paired(model.equations().rows[begin : begin + len(rows)], rows))


def _paired(latex: Iterable[str], rows: Iterable[str]) -> tuple[Rich, ...]:
    return tuple(Rich(text, html) for text, html in zip(latex, rows, strict=True))


def data_section(data: Dataset, *, drawn: bool) -> Section:
    """Return the section on the record, or on several records merged; ``drawn`` adds the figure of the samples."""
    return Section("Data", tuple(_data(data, drawn)))


def _data(data: Dataset, drawn: bool) -> Iterator[Block]:
    if is_simulated([data.source]):
        label = Rich("Simulated.", '<span class="label">simulated</span>')
        yield joined(
            label, " These data come from a simulation. They show that the method works, not how a real plant behaves."
        )
    # Source, samples and channels.
    samples = f"{data.n_samples}, every {data.sampling_time:.6g} s"
    if len(data.experiments) > 1:
        samples += f", in {len(data.experiments)} experiments: {', '.join(run.name for run in data.experiments)}"
    for note in missing_notes(data):
        samples += f"; {note}"
    if data.n_init:
        samples += f"; the first {data.n_init} of each experiment are warm-up"
    roles = {channel: data.role(channel.name) for channel in data.channels}
    channels = ", ".join(f"{channel} ({role})" if role else str(channel) for channel, role in roles.items())
    yield Facts(
        (
            ("source", data.source or "arrays in memory"),
            ("samples", samples),
            ("channels", channels),
            ("SHA-256 of the samples", Rich(data.checksum, f"<code>{data.checksum}</code>")),
        )
    )
    # Resampling, if there were time stamps.
    for run, record in zip(data.experiments, data.resampling, strict=False):
        if record.method != "none":
            added = "".join(
                f" Interpolation adds up to about {error:.3g} {data.channel(name).unit} to the error of {name}."
                for name, error in record.curvature_error.items()
            )
            yield (
                f"Irregular time stamps ({run.name}): {record.n_original} samples were interpolated linearly. Mean "
                f"interval {record.mean_interval:.4g} s, jitter up to {record.jitter_max:.3g} s (RMS "
                f"{record.jitter_rms:.3g} s).{added} The noise bound must include this error."
            )
    if drawn:
        yield Picture(data_figure(data), "The samples that were used.", "The samples over time")


def data_figure(dataset: Dataset) -> Figure:
    """Draw every channel over time, outputs on top."""
    from smid.display.style import WIDTH, style

    with style():
        figure = dataset.plot()
        figure.set_size_inches(WIDTH, 0.6 + 1.3 * len(figure.axes))
    return figure
