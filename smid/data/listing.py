"""A data set as a small table, in text and in HTML."""

from html import escape
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from smid.data.dataset import Dataset

HEADINGS = ("channel", "unit", "role", "min", "max", "mean")


def _rows(dataset: "Dataset") -> list[tuple[str, ...]]:
    rows = []
    for channel in dataset.channels:
        samples = dataset.stacked(channel.name)
        figures = (f"{x:.5g}" for x in (samples.min(), samples.max(), samples.mean()))
        rows.append((channel.name, channel.unit, dataset.role(channel.name), *figures))
    return rows


def _heading(dataset: "Dataset") -> str:
    n_runs = len(dataset.experiments)
    parts = [
        f"{n_runs} experiment{'s' if n_runs > 1 else ''}",
        f"{dataset.n_samples} samples",
        f"sampling time {dataset.sampling_time:.6g} s",
    ]
    if dataset.n_init:
        parts.append(f"{dataset.n_init} warm-up samples each")
    return f"Dataset: {', '.join(parts)}"


def _notes(dataset: "Dataset") -> list[str]:
    notes = [f"source: {dataset.source}"] if dataset.source else []
    notes += [
        f"{run.name}: {record}"
        for run, record in zip(dataset.experiments, dataset.resampling, strict=False)
        if record.method != "none"
    ]
    if dataset.normalisation is not None:
        notes.append(str(dataset.normalisation))
    return notes


def as_text(dataset: "Dataset") -> str:
    """Table of the channels: unit, role, range and mean over all experiments.

    Parameters
    ----------
    dataset : Dataset
        The data set.

    Returns
    -------
    str
        Several lines without a line break at the end.
    """
    rows = [HEADINGS, *_rows(dataset)]
    widths = [max(len(row[k]) for row in rows) for k in range(len(HEADINGS))]
    lines = [
        "  ".join(
            cell.ljust(width) if k < 3 else cell.rjust(width)
            for k, (cell, width) in enumerate(zip(row, widths, strict=True))
        )
        for row in rows
    ]
    return "\n".join([_heading(dataset), *(line.rstrip() for line in lines), *_notes(dataset)])


def as_html(dataset: "Dataset") -> str:
    """Write the same table for notebooks.

    Parameters
    ----------
    dataset : Dataset
        The data set.

    Returns
    -------
    str
        An HTML fragment; names are escaped.
    """
    head = "".join(f"<th>{heading}</th>" for heading in HEADINGS)
    body = "".join("<tr>" + "".join(f"<td>{escape(cell)}</td>" for cell in row) + "</tr>" for row in _rows(dataset))
    notes = "".join(f"<p>{escape(note)}</p>" for note in _notes(dataset))
    return (
        f"<p>{escape(_heading(dataset))}</p><table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>{notes}"
    )
