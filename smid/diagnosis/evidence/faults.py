"""Faults of the data that no model should be asked to explain, found before there is any model.

What is looked for, and the evidence that is asked for:

- *quantisation*: the values lie on a grid, and its step is coarser than the noise; an input must look like a rounded
  signal, not like a command that takes a few levels by design;
- *saturation*: an output stays exactly at its largest or smallest value while the input moves;
- *frozen*: an output stays exactly at another value while the input moves;
- *outliers*: isolated samples far from both neighbours, which the input and the neighbours do not explain either;
- *jitter*: the time stamps were not uniform, and the samples were interpolated;
- *feedback*: the input reacts on past outputs (`smid.diagnosis.evidence.feedback`);
- *excitation*: the input is too poor to tell more than a few parameters.

A command may rest, or sit at its limits, by design: inputs are not tested for saturation or freezing.  Silence where
nothing is wrong comes first, so every threshold is strict, and small faults pass unseen.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from relaxations.algebra.arrays import Array
from smid.data import Dataset, excitation
from smid.data.gaps import bridged
from smid.diagnosis.effects.parts.naming import quantity
from smid.diagnosis.evidence.feedback import feedback
from smid.diagnosis.evidence.sensor import outlier_mask, quantisation_step, runs_of_equal
from smid.display.result import Part, Result

__all__ = ["Fault", "data_faults", "outlier_mask", "quantisation_step"]

Kind = Literal["quantisation", "saturation", "frozen", "outliers", "jitter", "feedback", "excitation"]

_FEWEST = 40
_STRICT = 1e-7
_SMALLEST_REACTION = 0.02
_FEW_LINES = 6
_SMALLEST_JITTER = 0.02


@dataclass(frozen=True, repr=False)
class Fault(Result):
    """Something wrong with the data.

    Parameters
    ----------
    kind
        "quantisation", "saturation", "frozen", "outliers", "jitter", "feedback" or "excitation".
    channel
        "" where all channels are concerned.
    severity
        One of {"note", "warning"}. A warning spoils the estimates unless something is done.
    sentence
        What, how large, and the cure.
    samples
        Experiment, first sample, and the sample after the last, for each stretch concerned; empty where all are.
    size
        Step, largest glitch, or value at which the sensor stood still, in the channel's unit; jitter in s; share of the
        input's innovation under feedback; order of excitation.
    """

    kind: Kind
    channel: str
    severity: Literal["note", "warning"]
    sentence: str
    samples: tuple[tuple[int, int, int], ...] = ()
    size: float = 0.0

    def _content(self) -> Iterator[Part]:
        yield f"{self.severity}: {self.sentence}"


def data_faults(data: Dataset) -> tuple[Fault, ...]:
    """Look for faults of the data, without a model.

    Examples
    --------
    >>> random = np.random.default_rng(0)
    >>> u = random.standard_normal(300)
    >>> y = np.convolve(u, 0.8 ** np.arange(20))[:300] + 0.1 * random.standard_normal(300)
    >>> data_faults(Dataset.from_arrays(input=u, output=y, sampling_time=0.1))
    ()
    >>> y[50] += 9
    >>> print(data_faults(Dataset.from_arrays(input=u, output=y, sampling_time=0.1))[0])
    warning: output has 1 glitch of up to 9.43, at 5 s: leave the sample out, or treat it as an outlier
    """
    found = list(sample_faults(data))
    for name in data.inputs:
        found += [fault for output in data.outputs for fault in _reacts(data, name, output)]
        found += _poor(data, name)
    return tuple(sorted(found, key=lambda fault: fault.severity != "warning"))


def sample_faults(data: Dataset) -> Iterator[Fault]:
    """Yield the faults of single channels and of the time stamps: quick, for a look before long work."""
    for channel in data.names:
        yield from _quantised(data, channel)
        if data.role(channel) != "input":
            yield from _stood_still(data, channel)
        yield from _glitches(data, channel)
    yield from _jitter(data)


def _quantised(data: Dataset, channel: str) -> Iterable[Fault]:
    values = _present(data, channel)
    step = quantisation_step(values)
    if step is None:
        return
    runs = [run.values[channel] for run in data.experiments]
    if data.role(channel) != "output" and not _looks_rounded(runs, step):
        return
    bends = np.concatenate([np.diff(y, 2) for y in runs])
    bends = bends[~np.isnan(bends)]
    noise = float(np.sqrt(np.mean(bends**2) / 6)) if bends.size else 0.0
    span = float(np.ptp(values))
    # A noise of the size of the step makes the rounding error a small white noise of its own.
    if step < 1e-3 * span or (step < 0.02 * span and step < noise):
        return
    unit = data.channel(channel).unit
    levels = np.unique(np.round((values - values[0]) / step)).size
    half = quantity(step / 2, unit)
    cure = f"add {half} to its noise bound" if data.role(channel) == "output" else f"take it as known to ± {half} only"
    yield Fault(
        "quantisation",
        channel,
        "warning" if step > 0.05 * span else "note",
        f"{channel} is recorded in steps of {quantity(step, unit)} ({levels} levels in {values.size} samples): {cure}, "
        "or record it with a finer resolution",
        size=step,
    )


def _present(data: Dataset, channel: str) -> Array:
    """Return the samples of a channel that are not missing."""
    values = data.stacked(channel)
    return values[~np.isnan(values)]


def _looks_rounded(runs: list[Array], step: float) -> bool:
    """Tell a rounded signal from a command: it goes from level to level without jumps, and at no fixed beat."""
    jumps = np.concatenate([np.diff(u) for u in runs])
    moved = np.abs(jumps[jumps != 0])
    lengths = np.concatenate([runs_of_equal(u)[1][1:-1] for u in runs])
    levels = np.unique(np.round(np.concatenate(runs) / step)).size
    return bool(
        levels >= 8 and moved.size > 20 and np.mean(moved < 1.5 * step) > 0.9 and lengths.std() > 0.2 * lengths.mean()
    )


def _stood_still(data: Dataset, channel: str) -> Iterable[Fault]:
    values = _present(data, channel)
    span, unit = float(np.ptp(values)), data.channel(channel).unit
    if values.size < _FEWEST or span == 0:
        return
    if not data.role(channel) and (
        np.unique(values).size < 0.25 * values.size or np.median(np.abs(np.diff(values, 2))) < 1e-6 * span
    ):
        return  # a set point, a reference or a gear: it may rest by design
    stretches = [
        (number, int(start), int(start + length), float(run.values[channel][start]))
        for number, run in enumerate(data.experiments)
        for start, length in zip(*runs_of_equal(run.values[channel]), strict=True)
        if not np.isnan(run.values[channel][start])
    ]
    lengths = np.array([stop - start for _, start, stop, _ in stretches])
    values_of = np.array([value for *_, value in stretches])
    extreme = (values_of == values.max()) | (values_of == values.min())
    moves = {name: 0.05 * float(np.ptp(data.stacked(name))) for name in data.inputs}
    moving = np.array([_input_moves(data, moves, *stretch[:3]) for stretch in stretches])
    begins = np.array([start == 0 for _, start, _, _ in stretches])
    usual = int(np.quantile(np.repeat(lengths, lengths), 0.5))
    for kind, where in (("saturation", extreme), ("frozen", ~extreme & (lengths >= 6))):
        # Noise never meets the same value twice: a noisy sensor that does has met its limit, wherever the input is. A
        # sensor without noise, or a coarse one, repeats its values anyway: there only what lasts far longer is odd.
        rest = values_of[~where]
        noisy = np.unique(rest).size > 0.95 * lengths[~where].sum()
        longest = int(lengths[~where].max(initial=1)) if kind == "saturation" else 0
        long = lengths >= (1 if noisy else max(20, 5 * usual, 3 * longest))
        # A record may begin at rest, exactly at zero.
        hit = where & long & (moving | (noisy & ~begins & (kind == "saturation")))
        if kind == "saturation":
            fewest = max(5.0, 0.005 * values.size)
            for limit in (values.min(), values.max()):
                if lengths[hit & (values_of == limit)].sum() < fewest:
                    hit &= values_of != limit
        if not hit.any():
            continue
        total = int(lengths[hit].sum())
        samples = tuple(stretches[k][:3] for k in np.flatnonzero(hit))
        at = sorted({stretches[k][3] for k in np.flatnonzero(hit)})
        share = f"{total} samples ({100 * total / values.size:.1f} %)"
        told = " and ".join(quantity(value, unit) for value in at[:3])
        if kind == "saturation":
            said = (
                f"{channel} stays at its limit of {told} for {share}: treat these samples as bounds, or widen the range"
            )
            yield Fault("saturation", channel, "warning", said + " of the sensor", samples, at[-1])
        else:
            said = f"{channel} stands still at {told} for {share} while the input moves: crop them, or check the sensor"
            yield Fault("frozen", channel, "warning", said, samples, at[-1])


def _input_moves(data: Dataset, moves: Mapping[str, float], number: int, start: int, stop: int) -> bool:
    """Return whether an input moves by more than so much within a stretch."""
    values = data.experiments[number].values
    return stop - start >= 3 and any(np.ptp(values[name][start:stop]) > least for name, least in moves.items())


def _glitches(data: Dataset, channel: str) -> Iterable[Fault]:
    masks = []
    for run in data.experiments:
        values = bridged(run.values[channel])
        if np.unique(values).size < 0.5 * values.size and data.role(channel) != "output":
            return  # a command of few levels jumps by design
        mask = outlier_mask(values)
        if mask.any() and data.role(channel) == "output":
            mask &= _unexplained([run.values[name] for name in data.inputs], values)
        masks.append(mask)
    count = sum(int(mask.sum()) for mask in masks)
    if not count:
        return
    largest = 0.0
    for run, mask in zip(data.experiments, masks, strict=True):
        index = np.arange(mask.size)
        values = bridged(run.values[channel])
        clean = np.interp(index, index[~mask], values[~mask])
        largest = max(largest, float(np.abs(values - clean).max()))
    samples = tuple((n, int(k), int(k) + 1) for n, mask in enumerate(masks) for k in np.flatnonzero(mask))
    instants = [f"{data.time(n)[k]:.4g}" for n, k, _ in samples]
    times = ", ".join(instants[:5]) + (", ..." if len(instants) > 5 else "")
    unit = data.channel(channel).unit
    yield Fault(
        "outliers",
        channel,
        "warning",
        f"{channel} has {count} glitch{'es' if count > 1 else ''} of up to {quantity(largest, unit)}, at {times} s: "
        + (
            "leave the samples out, or treat them as outliers"
            if count > 1
            else "leave the sample out, or treat it as an outlier"
        ),
        samples,
        largest,
    )


def _unexplained(inputs: list[Array], y: Array) -> NDArray[np.bool_]:
    """Mark samples that a linear fit on their neighbours and on the recent input does not reach.

    The response to a pulse of the input looks like a glitch; the input explains it.
    """
    reach, memory = 2, 8
    n = y.size
    if n < 5 * (2 * reach + memory * len(inputs)):
        return np.ones(n, dtype=bool)
    padded = [np.pad(u, (memory, 0), mode="edge") for u in inputs]
    columns = [u[memory - lag : memory - lag + n] for u in padded for lag in range(memory)]
    around = np.pad(y, reach, mode="edge")
    columns += [around[reach + shift : reach + shift + n] for shift in range(-reach, reach + 1) if shift]
    phi = np.column_stack([*columns, np.ones(n)])
    kept = np.ones(n, dtype=bool)
    residual = y
    for _ in range(3):  # a fit that the glitches pull on, then twice without them
        gains = np.linalg.lstsq(phi[kept], y[kept], rcond=1e-10)[0]
        residual = np.abs(y - phi @ gains)
        kept = residual <= 4 * 1.4826 * float(np.median(residual))
    far = residual > 6 * 1.4826 * float(np.median(residual))
    far[:memory] = False  # what the input did before the record may explain them
    return np.asarray(far, dtype=bool)


def _jitter(data: Dataset) -> Iterable[Fault]:
    for run, record in zip(data.experiments, data.resampling, strict=bool(data.resampling)):
        share = record.jitter_max / data.sampling_time
        if record.method != "linear" or share < _SMALLEST_JITTER:
            continue
        errors = ", ".join(
            quantity(error, data.channel(name).unit) + f" for {name}"
            for name, error in record.curvature_error.items()
            if name in data.names and error > 0
        )
        cure = f": add the error of the interpolation (about {errors}) to the noise bounds" if errors else ""
        yield Fault(
            "jitter",
            "",
            "warning" if record.jitter_rms > 0.1 * data.sampling_time else "note",
            f"the time stamps of {run.name} are not uniform: they jitter by up to {quantity(record.jitter_max, 's')} "
            f"around {quantity(record.mean_interval, 's')}, and the samples were interpolated{cure}",
            size=record.jitter_max,
        )


def _reacts(data: Dataset, name: str, output: str) -> Iterable[Fault]:
    found = feedback(
        [run.values[name] for run in data.experiments], [bridged(run.values[output]) for run in data.experiments]
    )
    if found.chance > _STRICT or found.share < _SMALLEST_REACTION:
        return
    yield Fault(
        "feedback",
        name,
        "warning",
        f"{name} reacts on past {output}: this explains {100 * found.share:.0f} % of its unforeseen moves, and chance "
        f"would with a probability of {max(found.chance, 1e-99):.0e}; an open-loop estimate is biased: bound the noise "
        "of both channels, or record in open loop",
        size=found.share,
    )


def _poor(data: Dataset, name: str) -> Iterable[Fault]:
    runs = [run.values[name] for run in data.experiments]
    if max(u.size for u in runs) < 2:
        return
    # Singular values below the rounding of a usual converter are not excitation.
    order = excitation(*runs, tolerance=1e-5).order
    if order == 0:
        said = f"{name} is constant: its effect on the output cannot be seen; move it"
        yield Fault("excitation", name, "warning", said, size=0.0)
    elif order < _FEW_LINES and max(u.size for u in runs) >= 4 * _FEW_LINES:
        said = (
            f"{name} excites order {order} only, enough for {order} parameters; use a PRBS or a multisine of more lines"
        )
        yield Fault("excitation", name, "note", said, size=float(order))
