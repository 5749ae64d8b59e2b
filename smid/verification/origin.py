"""The origin of a certificate: the model's lines as text, priors, noise bounds and a digest of the data."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Iterable, Mapping, Sequence
from fractions import Fraction
from importlib.metadata import PackageNotFoundError, version
from typing import Any

import numpy as np

from relaxations.algebra.arrays import Array
from smid.data import Dataset
from smid.data.window import Window, cut_all
from smid.models import Model
from smid.models.discretise import held_rates
from smid.models.expressions import to_text
from smid.models.hidden_states import without_hidden_states

DIGITS = 6  # hexadecimal digits kept of each sample's own digest, to find the first sample that differs


def origin_of(
    model: Model, data: Dataset, bounds: Mapping[str, float], windows: Sequence[Window] = ()
) -> dict[str, Any]:
    """Return the origin of a proof about a model (bound to the data), data and noise bounds, ready for JSON.

    A proof on ``windows`` states their samples only.
    """
    return {
        "model": model_statement(model),
        "noise_bounds": {channel: float(bound).hex() for channel, bound in sorted(bounds.items())},
        "windows": [window.to_dict() for window in windows],
        **source_of(cut_all(data, windows) if windows else data, model.channels),
    }


def source_of(data: Dataset, channels: tuple[str, ...]) -> dict[str, Any]:
    """Return the software, and what identifies the samples of some channels."""
    return {"software": f"smid {_version()}", "data": data_statement(data, channels)}


def model_statement(model: Model) -> dict[str, Any]:
    """Return the model as text: parameters with their boxes, lines, measurements and constraints.

    Lines in derivatives are stated as the discretised lines that are simulated and bounded, and without the hidden
    states that are eliminated.
    """
    return plain_statement(without_hidden_states(model))


def plain_statement(plain: Model) -> dict[str, Any]:
    """Return a model as text: plain lines, and rates in which all is held that does not move with the states."""
    rates = {name: to_text(rate) for name, rate in held_rates(plain.lines).items()}
    return {
        "name": plain.name,
        "parameters": {p.name: [_end(p.lower), _end(p.upper)] for p in plain.parameters},
        "lines": {line.signal: to_text(line.expression) for line in plain.lines if not line.rate},
        **({"rates": rates, "interval": float(plain.sampling_time or 0.0).hex()} if rates else {}),
        "measurements": [
            {
                "channel": m.channel,
                "signal": m.signal,
                "noise": m.noise,
                "inverse": None if m.inverse is None else to_text(m.inverse),
            }
            for m in plain.measurements
        ],
        "constraints": [to_text(constraint) for constraint in plain.constraints],
        **({"bounds": {n: [_end(low), _end(high)] for n, (low, high) in plain.bounds.items()}} if plain.bounds else {}),
    }


def data_statement(data: Dataset, channels: tuple[str, ...]) -> dict[str, Any]:
    """Return what identifies the samples of some channels: a SHA-256 of all, and a few digits for each sample."""
    names = sorted(channels)
    digest = hashlib.sha256(np.float64(data.sampling_time).astype(">f8").tobytes())
    for run in data.experiments:
        for name in names:
            samples = _canonical(run.values[name])
            digest.update(f"{name}:{samples.size}:".encode() + samples.tobytes())
    return {
        "sha256": digest.hexdigest(),
        "sampling_time": float(data.sampling_time).hex(),
        "inputs": [c for c in data.inputs if c in names],
        "outputs": [c for c in data.outputs if c in names],
        "source": data.source,
        "experiments": [{"name": run.name, "samples": run.n_samples} for run in data.experiments],
        "sample_digests": {name: [_digests(run.values[name]) for run in data.experiments] for name in names},
    }


def samples_as_text(values: Array) -> list[str | None]:
    """Return samples as hexadecimal floats; None for a missing one."""
    return [None if np.isnan(y) else (y + 0.0).hex() for y in values.tolist()]


def _canonical(values: Array) -> Array:
    return (values + 0.0).astype(">f8")  # minus zero becomes zero


def _digests(values: Array) -> str:
    return "".join(hashlib.sha256(sample.tobytes()).hexdigest()[:DIGITS] for sample in _canonical(values))


def _end(value: float) -> str | None:
    return float(value).hex() if np.isfinite(value) else None


def _version() -> str:
    try:
        return version("smid")
    except PackageNotFoundError:
        return "(not installed)"


def exact_samples(data: Dataset, channels: Iterable[str]) -> dict[str, dict[str, list[Fraction | None]]]:
    """Return the samples of each experiment by channel as fractions; None for a missing one."""
    return {
        run.name: {c: [None if math.isnan(v) else Fraction(v) for v in run.values[c].tolist()] for c in channels}
        for run in data.experiments
    }
