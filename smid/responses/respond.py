"""Step and frequency response of an estimate with certified bands."""

from __future__ import annotations

import time
from collections.abc import Sequence
from contextlib import suppress
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from relaxations.algebra.arrays import Array
from relaxations.deadline import STOPS, limited
from smid.identification.estimate import Estimate
from smid.models import ModelError
from smid.responses.band import Band, ResponseBand
from smid.responses.bounding import Bounder
from smid.responses.certified import BOXES, certified_ends
from smid.responses.coefficients import Coefficients
from smid.responses.functions import Circle, Phase, Reflections, SquaredGain, Step
from smid.responses.outer_set import OuterSet
from smid.responses.taylor import Taylor

__all__ = ["bode", "step"]

LAST = 10_000  # sample of a step response: all up to it are computed
FREQUENCIES = 40  # by default, over two decades below the Nyquist frequency
_UP = 1 + 1e-15  # more than the rounding of a root and of a change of unit


@limited
def step(estimate: Estimate, samples: int | Sequence[int] = 50, *, seconds: float = np.inf) -> ResponseBand:  # noqa: ARG001
    """Return the step response of the linear block with a certified band over the feasible set.

    For every parameter vector that fits all samples within the noise bound, the response to a unit step, from rest,
    lies within the band. A Hammerstein model's block begins behind its curve, a Wiener model's ends before it, as in
    :meth:`Estimate.to_control`.

    Parameters
    ----------
    samples
        How many, from the step on; or the samples themselves, counted from 0.
    seconds
        Time allowed, wall clock; then the bands proven so far are returned, some of them infinite.

    Raises
    ------
    ModelError
        Where the intervals are not proven, the model has no linear block, or a sample is negative.

    Examples
    --------
    >>> from smid import Dataset, OutputError, identify
    >>> u, y = [1.0, 0, 1, 1, 0, 0, 1, 0], [0.0, 1, 0.5, 1.3, 1.6, 0.8, 0.4, 1.2]
    >>> data = Dataset.from_arrays(input={"u": u}, output={"y": y}, sampling_time=1.0)
    >>> response = step(identify(OutputError(stable=True), data, noise_bound=0.1), 5)["response"]
    >>> bool((response.lower <= response.inner_lower).all()), bool((response.inner_upper <= response.upper).all())
    (True, True)
    >>> float(response.lower[3]) < 1.75 < float(response.upper[3])  # a1 = -0.5, b0 = 1
    True
    """
    chosen = np.atleast_1d(np.arange(min(samples, LAST + 2)) if isinstance(samples, int) else np.asarray(samples))
    whole = chosen.ndim == 1 and len(chosen) > 0 and chosen.dtype.kind == "i"
    if not whole or chosen.min() < 0 or chosen.max() > LAST:
        raise ModelError(f"samples = {samples!r}: give a count of at least 1, or whole numbers from 0 to {LAST}")
    started = time.perf_counter()
    block, outer = _begin(estimate)
    function = Step(block, chosen)
    ends = certified_ends(outer, function)
    centre = function(_centre(estimate, block), 0).value
    unit = _unit(estimate, block)
    band = Band("response", unit, ends.lower, ends.upper, ends.inner_lower, ends.inner_upper, centre)
    at = estimate.data.sampling_time * chosen.astype(np.float64)
    return _response("step", estimate, block, outer, at, (band,), ends.complete, started)


@limited
def bode(estimate: Estimate, frequencies: ArrayLike | None = None, *, seconds: float = np.inf) -> ResponseBand:  # noqa: ARG001
    """Return gain and phase of the linear block with certified bands over the feasible set.

    For every parameter vector that fits all samples within the noise bound, gain and phase lie within their bands: the
    phase up to whole turns. A band is infinite where no bound can be proven: where a pole (for the phase, also a zero)
    may lie on the unit circle at the frequency.

    Parameters
    ----------
    frequencies
        In rad/s, from 0 to the Nyquist frequency pi / T. By default 40 over the two decades below it.
    seconds
        Time allowed, wall clock; then the bands proven so far are returned, some of them infinite.

    Raises
    ------
    ModelError
        Where the intervals are not proven, the model has no linear block, or a frequency is out of range.

    Examples
    --------
    >>> from smid import Dataset, OutputError, identify
    >>> u, y = [1.0, 0, 1, 1, 0, 0, 1, 0], [0.0, 1, 0.5, 1.3, 1.6, 0.8, 0.4, 1.2]
    >>> data = Dataset.from_arrays(input={"u": u}, output={"y": y}, sampling_time=1.0)
    >>> gain = bode(identify(OutputError(stable=True), data, noise_bound=0.1), [0.0])["gain"]
    >>> bool(gain.lower[0] < 2 < gain.upper[0])  # a1 = -0.5, b0 = 1
    True
    """
    nyquist = np.pi / estimate.data.sampling_time
    chosen: Array = np.geomspace(nyquist / 100, nyquist, FREQUENCIES)
    if frequencies is not None:
        chosen = np.atleast_1d(np.asarray(frequencies, dtype=np.float64))
        # The last digit of pi / T may be rounded up.
        if chosen.ndim != 1 or not len(chosen) or not ((chosen >= 0) & (chosen <= nyquist * _UP)).all():
            raise ModelError(f"frequencies must be between 0 and the Nyquist frequency, {nyquist:.6g} rad/s")
    started = time.perf_counter()
    block, outer = _begin(estimate)
    circle = Circle.of(chosen, estimate.data.sampling_time, max(block.numerator.n_rows, block.denominator.n_rows))
    # Gain
    square = SquaredGain(block, circle)
    ends = certified_ends(outer, square)
    low, high, inner_low, inner_high, centre = (
        np.sqrt(np.maximum(part, 0.0))
        for part in (
            ends.lower,
            ends.upper,
            ends.inner_lower,
            ends.inner_upper,
            square(_centre(estimate, block), 0).value,
        )
    )
    gain = Band("gain", _unit(estimate, block), low / _UP, high * _UP, inner_low, inner_high, centre)
    # Phase, continuous along the frequencies for the central model
    pairs = [circle.polynomial(part) for part in block.at(_centre(estimate, block), 0)]
    reference = np.array([real.value + 1j * imaginary.value for real, imaginary in pairs])
    reference[reference == 0] = 1.0
    angles = np.angle(reference[0]) - np.angle(reference[1])
    turns = np.round((np.unwrap(angles) - angles) / (2 * np.pi))
    argument = Phase(block, circle, reference, turns)
    ends = certified_ends(outer, argument)
    low, high, inner_low, inner_high, centre = (
        np.degrees(part)
        for part in (
            ends.lower,
            ends.upper,
            ends.inner_lower,
            ends.inner_upper,
            argument(_centre(estimate, block), 0).value,
        )
    )
    outwards = (_UP - 1) * np.abs([low, high])
    phase = Band("phase", "deg", low - outwards[0], high + outwards[1], inner_low, inner_high, centre)
    return _response("bode", estimate, block, outer, chosen, (gain, phase), ends.complete, started)


def _begin(estimate: Estimate) -> tuple[Coefficients, OuterSet]:
    """Return the linear block, and the set around its parameters, bounded along the axes of the verified points."""
    block = Coefficients.of(estimate.model, {i.name: i.lower for i in estimate.intervals if i.lower == i.upper})
    outer = OuterSet(estimate, block.free)
    with suppress(*STOPS):
        for axis in outer.axes:
            outer.push(axis)
            outer.push(-axis)
    return block, outer


def _centre(estimate: Estimate, block: Coefficients) -> list[Taylor]:
    return [Taylor.linear(estimate.parameters[name], np.zeros(0)) for name in block.free]


def _unit(estimate: Estimate, block: Coefficients) -> str:
    """Return the unit of the output per unit of the input; empty where one of them is a signal without a channel."""
    units = {c.name: c.unit for c in estimate.data.channels}
    above, below = units.get(block.output, ""), units.get(block.input, "")
    return f"{above}/{below}" if above and below and above != below else ""


def _response(
    kind: Literal["step", "bode"],
    estimate: Estimate,
    block: Coefficients,
    outer: OuterSet,
    at: Array,
    bands: tuple[Band, ...],
    complete: bool,
    started: float,
) -> ResponseBand:
    stable = block.denominator.n_rows == 1
    with suppress(*STOPS):
        stable = stable or _is_stable(Bounder(outer, Reflections(block)), block)
    spent = time.perf_counter() - started
    return ResponseBand(kind, estimate, block.input, block.output, at, bands, stable, complete, outer.solves, spent)


def _is_stable(bounder: Bounder, block: Coefficients) -> bool:
    """Return whether all reflection coefficients are proven to lie between -1 and 1."""
    goal = np.nextafter(-1.0, 0.0)
    ends = [(k, sign) for k in range(block.denominator.n_rows - 1) for sign in (1, -1)]
    return all(bounder.search(*end, bounder.bound(bounder.root, *end), goal, BOXES) > -1 for end in ends)
