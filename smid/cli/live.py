"""A live view on the terminal: the intervals of a recursive set, drawn again in place while samples arrive."""

from __future__ import annotations

import sys
import time

import click

from smid.recursive.set_membership import RecursiveSet
from smid.recursive.tracked_set import Sample

_PAUSE = 0.1  # seconds between two pictures
_BAR = 40  # letters of an interval


class LiveIntervals:
    """Draws the intervals, and prints each certified change once.

    An interval is drawn within the widest one of the last pictures, so that its motion is seen.
    """

    def __init__(self, *, draws: bool) -> None:
        self._draws = draws
        self._drawn, self._last, self._told = 0, 0.0, 0
        self._frame: list[tuple[float, float]] = []

    def __call__(self, estimator: RecursiveSet, sample: Sample) -> None:
        """Show a set after a sample."""
        if len(estimator.changes) > self._told:
            self._told = len(estimator.changes)
            self._clear()
            click.echo(f"{sample.time:.6g} s: a change of the plant is proven", err=True)
        if self._draws and time.monotonic() - self._last >= _PAUSE:
            self.draw(estimator, sample)

    def draw(self, estimator: RecursiveSet, sample: Sample) -> None:
        """Draw the intervals in place of the last picture."""
        self._clear()
        ends = [(i.name, i.lower, i.upper) for i in estimator.intervals]
        kept = self._frame or [(low, high) for _, low, high in ends]
        # The frame narrows slowly towards twice the interval, and always holds the interval.
        self._frame = [
            (min(low, a + 0.2 * (1.5 * low - 0.5 * high - a)), max(high, b + 0.2 * (1.5 * high - 0.5 * low - b)))
            for (a, b), (_, low, high) in zip(kept, ends, strict=True)
        ]
        lines = [f"{sample.time:.6g} s"]
        for (name, low, high), (left, right) in zip(ends, self._frame, strict=True):
            lines.append(f"{name:>8} {low:>12.5g} {_bar(low, high, left, right)} {high:<12.5g}")
        click.echo("\n".join(lines), err=True)
        self._drawn, self._last = len(lines), time.monotonic()

    def close(self) -> None:
        """Remove the picture: the result follows."""
        self._clear()

    def _clear(self) -> None:
        if self._drawn:
            sys.stderr.write(f"\x1b[{self._drawn}A\x1b[J")
            self._drawn = 0


def _bar(low: float, high: float, left: float, right: float) -> str:
    """Return an interval within a frame, as letters."""
    scale = _BAR / (right - left) if right > left else 0.0
    first, last = round((low - left) * scale), round((high - left) * scale)
    return "[" + " " * first + "=" * max(last - first, 1) + " " * (_BAR - max(last, first + 1)) + "]"
