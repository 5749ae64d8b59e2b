"""Sliding in a static force balance: the output is a force or a torque, and channels tell how something moves.

``F = k x + c v`` has no state that friction could act on: friction adds to the output itself, with the sign of a speed.
Which channel is a speed is not written in the model, so each channel that the output is computed from is offered as a
*speed*, and its difference as that of a *position*: over the samples that the model itself takes a difference of, else
over one.  Near rest the sign is regularised, ``max(-1, min(1, v / vs))``: what holds at rest the speed does not tell.
Reference: Armstrong-Helouvry, Dupont, Canudas de Wit, Automatica 30 (1994) 1083-1138, section 2.
"""

from __future__ import annotations

from collections.abc import Hashable, Iterator
from dataclasses import dataclass

import numpy as np
import sympy

from smid.diagnosis.effects.effect import Site
from smid.diagnosis.effects.parts.extremes import larger, smaller
from smid.diagnosis.effects.parts.naming import signal_of
from smid.diagnosis.effects.parts.plant import state_lines
from smid.models import Model, Parameter, signal, t

__all__ = ["Slide", "slides"]


@dataclass(frozen=True)
class Slide:
    """A speed that the output of a static model may depend on.

    Parameters
    ----------
    line
        The signal that shows the force.
    channel
        The channel that moves.
    kind
        "speed" or "position", what the channel is.
    speed
        In the channel's unit, or in that per sample.
    full
        Largest speed in the data.
    force_scale
        Half the span of the output.
    damped
        Whether the output depends on the speed already.
    """

    line: str
    channel: str
    kind: str
    speed: sympy.Expr
    full: float
    force_scale: float
    damped: bool

    @property
    def what(self) -> str:
        """The speed, in words."""
        return self.channel if self.kind == "speed" else f"the change of {self.channel} per sample"

    @property
    def label(self) -> str:
        """Which way to put friction on the model."""
        return f"force with {self.channel} as {self.kind}"

    @property
    def sticking(self) -> tuple[float, float]:
        """Least and largest speed below which the sign of the speed is regularised."""
        return 1e-3 * self.full, 0.2 * self.full

    @property
    def speeds(self) -> tuple[float, ...]:
        """Starting values within `sticking`."""
        return 0.05 * self.full, 0.005 * self.full

    @property
    def forces(self) -> tuple[float, float]:
        """Least and largest friction; a sensor of the reaction shows the other sign."""
        return -5 * self.force_scale, 5 * self.force_scale

    @property
    def sizes(self) -> tuple[float, ...]:
        """Starting values within `forces`."""
        return 0.1 * self.force_scale, -0.1 * self.force_scale

    def way(self, sticking: Parameter) -> sympy.Expr:
        """Return the regularised sign of the speed."""
        return larger(-1, smaller(1, self.speed / sticking.symbol))


def slides(model: Model, site: Site) -> Iterator[Slide]:
    """Yield the speeds of a model whose output is a static function of channels; none for any other model."""
    force = signal_of(model, site.output)
    lags = _lags_of_inputs(model, force)
    channels = dict(zip(model.inputs, model.input_channels, strict=True))
    for name, read in lags.items():
        if channels[name] not in {c.name for c in site.data.channels}:
            continue
        first, last = min(read), max(read) if len(read) > 1 else min(read) + 1
        low, high = site.span(site.output)
        x, runs = signal(name), [run.values[channels[name]] for run in site.data.experiments]
        changes = np.concatenate([run[last - first :] - run[: first - last] for run in runs])
        for kind, speed, values, damped in (
            ("speed", x[t - first], np.concatenate(runs), True),
            ("position", (x[t - first] - x[t - last]) / (last - first), changes / (last - first), len(read) > 1),
        ):
            # A speed of one sign only makes friction a constant.
            if values.min() < 0 < values.max():
                full = float(np.abs(values).max())
                yield Slide(force, channels[name], kind, speed, full, (high - low) / 2, damped)


def _lags_of_inputs(model: Model, output: str) -> dict[str, set[int]]:
    """Return the lags at which a signal reads the model's inputs; none where it depends on a state of the plant."""
    lines = {line.signal: line for line in model.lines}
    states = {*model.states} - {*model.origins} | {state.line.signal for state in state_lines(model)}
    found: dict[str, set[int]] = {}
    waiting, seen = [(output, 0)], set[Hashable]()
    for name, lag in waiting:
        if name in states:
            return {}
        if name not in lines:
            found.setdefault(name, set()).add(lag)
            continue
        # What an effect remembers reads its own past.
        visit = name if name in model.origins else (name, lag)
        if visit not in seen:
            seen.add(visit)
            waiting += [(other, lag + more) for other, more in lines[name].reads]
    return {name: found[name] for name in model.inputs if name in found}
