"""The play operator: a part that is pushed by another part with slack between them.

    h_t = max(s_t - r, min(s_t + r, h_{t-1})),     g_t = (s_t - h_t) / r  in [-1, 1]

h moves only when s has moved through the slack, so g depends on the last reversal, but not on the speed. A sum of plays
with several thresholds r is a Prandtl-Ishlinskii hysteresis.

If s was last in contact at sample l, on the side c = +1 (from above, ``h = s + r``) or -1, then ``h_t = s_l + c r``.
So with a derivative s' of s, ``h_t' = s_l'``, and ``d h_t / d r = c``.

Each sample clips h to an interval, and two clips in a row are one clip: ``[a, b]`` then ``[c, d]`` clip to
``[clip(a), clip(b)]``, clipped to ``[c, d]``. So all samples are computed at once by recursive doubling, as in `lag`.
Clipping only selects numbers, so the result does not depend on the grouping of samples.

Reference: Brokate, Sprekels, "Hysteresis and Phase Transitions" (1996), chapter 2.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from relaxations.algebra.arrays import Array
from relaxations.algebra.ball_arithmetic import Balls
from smid.sensors.c_ranges import c_range
from smid.sensors.program import Block, Code
from smid.sensors.ranges import Range
from smid.sensors.tensor import Tensor

__all__ = ["Play", "Pushed", "play"]


@dataclass(frozen=True, eq=False)
class Play:
    """The response of a play operator to a signal.

    Parameters
    ----------
    position
        Shape (n,). Of the part that is pushed, h.
    contact
        Shape (n,). The last sample with contact; 0 before the first.
    side
        Shape (n,). Side of that contact: 1 from above, -1 from below, 0 before the first.
    """

    position: Array
    contact: NDArray[np.intp]
    side: Array


def play(signal: Array, threshold: Array | float, before: float) -> Play:
    """Return the response of a play operator.

    Parameters
    ----------
    signal
        Shape (n,). Position of the part that pushes.
    threshold
        Half the slack, in the unit of the signal; one number, or shape (n,).
    before
        Position of the pushed part before the first sample.

    Examples
    --------
    >>> play(np.array([0.0, 3.0, 2.5, 0.0]), 1.0, 0.0).position
    array([0., 2., 2., 1.])
    """
    # Combine the clips of neighbouring samples, of twice as many in each pass.
    low, high, shift = signal - threshold, signal + threshold, 1
    while shift < signal.size:
        ends = (np.clip(end[:-shift], low[shift:], high[shift:]) for end in (low, high))
        low, high = (np.concatenate([end[:shift], later]) for end, later in zip((low, high), ends, strict=True))
        shift *= 2
    position = np.clip(before, low, high)
    side = np.where(position == signal + threshold, 1.0, np.where(position == signal - threshold, -1.0, 0.0))
    contact = np.maximum.accumulate(np.where(side != 0.0, np.arange(signal.size), 0))
    return Play(position, contact, side[contact])


@dataclass(frozen=True)
class Pushed(Block):
    """The position of the pushed part; it may read a temperature, on which the slack depends.

    Parameters
    ----------
    threshold
        Half the slack at the reference temperature, in the unit of the signal.
    slope
        Relative fall of the slack per unit of the temperature.
    reference
        In the unit of the temperature.
    """

    threshold: float
    slope: float = 0.0
    reference: float = 0.0

    def slack(self, temperature: Array) -> Array:
        """Return half the slack at each temperature."""
        return np.asarray(self.threshold * np.exp(-self.slope * (temperature - self.reference)))

    def rest(self, first: Sequence[Array]) -> Array:
        """Return the middle of the slack; see `Block.rest`."""
        return np.atleast_1d(first[0])

    def advance(self, signals: Sequence[Array], memory: Array) -> tuple[Array, Array]:
        """Return the positions; see `Block.advance`."""
        slack = self.slack(signals[1]) if len(signals) > 1 else self.threshold
        position = play(signals[0], slack, float(memory[0])).position
        return position, position[-1:]

    def enclose(self, signals: Sequence[Range], memory: Range, cells: int) -> tuple[Range, Range]:  # noqa: ARG002
        """Return the range; see `Block.enclose`.

        The position rises with the signal and with the memory, and is monotone in the slack.
        """
        slack = Range.exact(self.threshold)
        if len(signals) > 1:
            cold = Balls.exact(-self.slope) * (signals[1].balls - Balls.exact(self.reference))
            slack = Range.of(Balls.exact(self.threshold) * Range.of(cold).exp().balls)

        def clipped(before: Array, s: Array) -> Array:
            return np.array([np.clip(before, s - r, s + r) for r in (slack.lower, slack.upper)])

        lower = clipped(memory.lower[0], signals[0].lower).min(axis=0)
        upper = clipped(memory.upper[0], signals[0].upper).max(axis=0)
        # The two sums of the clip are rounded; where the memory stays, it is exact.
        rounding = np.spacing(np.abs(signals[0].lower) + np.abs(signals[0].upper) + slack.upper)
        found = Range(
            np.where(lower == memory.lower[0], lower, lower - rounding),
            np.where(upper == memory.upper[0], upper, upper + rounding),
        )
        return found, found[None]

    def onnx(self, signals: Sequence[Tensor], memory: Tensor) -> tuple[Tensor, Tensor]:
        """Return the position; see `Block.onnx`."""
        signal, *warmth = signals
        slack: Tensor | float = self.threshold
        if warmth:
            slack = self.threshold * (-self.slope * (warmth[0] - self.reference)).exp()
        position = memory.begun(signal).clip(signal - slack, signal + slack)
        return position, position

    def code(self, name: str, signals: Sequence[str]) -> Code:
        """Return the two clips; see `Block.code`."""
        s, r = signals[0], repr(self.threshold)
        if len(signals) > 1:
            r = f"{r} * exp({-self.slope!r} * ({signals[1]} - ({self.reference!r})))"
        return Code(
            update=(
                f"{{ const double r = {r};\n"
                f"  {name} = m[0];\n"
                f"  if ({name} < {s} - r) {name} = {s} - r;\n"
                f"  if ({name} > {s} + r) {name} = {s} + r; }}\n"
                f"m[0] = {name};"
            ),
            size=1,
            rest=f"m[0] = {s};",
        )

    def range_code(self, name: str, signals: Sequence[str]) -> Code:
        """Return the clips with the least and the largest slack; see `Block.range_code`."""
        s, *warmth = signals
        slack = c_range("slack", Range.exact(self.threshold))
        if warmth:
            cold = f"times(exact({-self.slope!r}), minus(balls({warmth[0]}), exact({self.reference!r})))"
            slack = f"const range slack = bounds(times(exact({self.threshold!r}), exp_ball({cold})));"
        lower, upper = (
            f"clipped({end}[0], {s}.{side}, slack.lower), clipped({end}[0], {s}.{side}, slack.upper)"
            for end, side in (("low", "lower"), ("high", "upper"))
        )
        return Code(
            f"{{ {slack}\n"
            f"  const double lower = smaller({lower});\n"
            f"  const double upper = larger({upper});\n"
            f"  const double rounding = DBL_EPSILON * (fabs({s}.lower) + fabs({s}.upper) + slack.upper);\n"
            f"  low[0] = {name}.lower = lower == low[0] ? lower : lower - rounding;\n"
            f"  high[0] = {name}.upper = upper == high[0] ? upper : upper + rounding; }}"
        )
