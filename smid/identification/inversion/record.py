"""A model and a record: what each sample states about a box of the unknowns, and whether a point fits all samples.

The unknowns are the parameters, and for each experiment the samples of the states before the first that the model
computes. A measured state begins at its measurement, within the noise bound. A hidden signal with bounds counts as
measured. A free run is enclosed over the box
(:mod:`.free_run`), so every sample states a linear inequality in the unknowns, with what is left over as a radius.
"""

from __future__ import annotations

from collections.abc import Mapping
from copy import copy
from dataclasses import dataclass, replace

import numpy as np

from relaxations.algebra.affine_arithmetic import CENTRE, HIGH, LOW, RADIUS, SLOPES
from relaxations.algebra.arrays import Array, Index, Mask
from relaxations.algebra.ball_arithmetic import EPSILON, TINY
from smid.data import Dataset
from smid.identification.inversion.frame import Frame, middle_and_half, static_curves
from smid.identification.inversion.free_run import NO_SAMPLE, ZERO, enclose_run
from smid.identification.inversion.tape import tape_of
from smid.models import Measurement, Model
from smid.models.running import at_sampling_time
from smid.models.symbols import unused

KEPT = 40
"""Symbols for what operations leave over, see :mod:`.free_run`."""

ANCHORS = (np.inf, 1.0)
"""A run that keeps all dependence, and one that is bounded by the measurements; a row may come from either."""

CONSTRAINT, PRIOR = -1, -2
"""In place of an anchor: the row is a constraint of the model, or the box of an unknown."""

_UNKNOWN = 1e12
_UP = 1 + 64 * EPSILON  # covers the sums below


@dataclass(frozen=True, eq=False)
class Rows:
    """``|centre + slopes @ e| <= radius`` for unknowns ``middle + half * e`` with e in [-1, 1].

    Parameters
    ----------
    centre, radius
        Shape (n,).
    slopes
        Shape (n, unknowns).
    sources
        Shape (n, 4). Place of the anchor, experiment, measured output, sample; or `CONSTRAINT` or `PRIOR`, 0, which, 0.
    impossible
        A row that no unknowns of the box keep; -1: none.
    """

    centre: Array
    radius: Array
    slopes: Array
    sources: Index
    impossible: int

    def where(self, kept: Mask | Index) -> Rows:
        """Return some of the rows."""
        return Rows(self.centre[kept], self.radius[kept], self.slopes[kept], self.sources[kept], -1)


@dataclass(frozen=True, eq=False)
class _Forms:
    """Forms of the measured outputs of one experiment, shape (n, width), with output and sample; of the constraints."""

    outputs: Array
    places: Index
    constraints: Array


class Record:
    """A model and a record, prepared for many boxes.

    Parameters
    ----------
    bounds
        Of each noisy channel, in its unit.

    Attributes
    ----------
    names
        Of the unknowns, the parameters first.
    lower, upper
        What is known of the unknowns beforehand, shape (unknowns,).
    initial
        Per experiment, shape (signals, samples): which unknown each initial sample is, `ZERO` or `NO_SAMPLE`.

    Raises
    ------
    ModelError
        For a function without an enclosure.
    """

    def __init__(self, model: Model, data: Dataset, bounds: Mapping[str, float]) -> None:
        model = at_sampling_time(model, data.sampling_time)
        self.model, self.data = model if model.enclosed else model.discretised(), data
        model, runs, bounds = _with_bounds_measured(self.model, data, bounds)
        self.tape = tape = tape_of(model)
        noise = {m.channel: bounds[m.channel] for m in model.measurements if m.noise is not None}
        plain = {m.signal: m.channel for m in model.measurements if m.inverse is None}
        self._noise = np.array(
            [noise.get(name, 0.0) if seen else 0.0 for name, seen in zip(tape.channels, tape.seen, strict=True)]
        )
        self._data = [np.array([values[name] for name in tape.channels]) for values in runs]
        self._outputs = tape.shown
        self._shown = np.array([tape.signals.index(own) for _, own in tape.measured], dtype=np.int64)
        as_it_is = np.array([plain.get(own) == channel for channel, own in tape.measured], dtype=bool)
        self._states = np.where(as_it_is, self._shown, -1)
        # The unknowns: parameters, and initial samples of states.
        names, ends = [p.name for p in model.parameters], [(p.lower, p.upper) for p in model.parameters]
        self.initial = []
        for run, values in zip(data.experiments, runs, strict=True):
            table = np.full((len(tape.signals), max(int(tape.first.max(initial=0)), 1)), NO_SAMPLE)
            for k in np.flatnonzero(tape.states):
                name = tape.signals[k]
                for now in range(tape.first[k]):
                    table[k, now] = ZERO if tape.clocks[k] else len(names)
                    if tape.clocks[k]:
                        continue
                    names.append(f"{name}[{now}]" if len(data.experiments) == 1 else f"{name}[{now}] of {run.name}")
                    measured = values[plain[name]][now] if name in plain else np.nan
                    reach = noise.get(plain.get(name, ""), 0.0)
                    around = (np.nextafter(measured - reach, -np.inf), np.nextafter(measured + reach, np.inf))
                    ends.append(around if np.isfinite(measured) else (-np.inf, np.inf))
            self.initial.append(table)
        self._there = [self._stated(e) for e in range(len(self._data))]
        self.names = tuple(names)
        self.lower, self.upper = (np.array(end, dtype=np.float64) for end in zip(*ends, strict=True))
        self.frame: Frame | None = None

    def _stated(self, e: int) -> Mask:
        """Return of which samples of an experiment each measured output says something, shape (outputs, n)."""
        there: Mask = np.isfinite(self._data[e][self._outputs])
        # Before its first sample the model says nothing, but for the states that begin there.
        for own, place in zip(there, self._shown, strict=True):
            first = self.tape.first[place]
            own[:first] &= (self.initial[e][place] != NO_SAMPLE)[:first][: len(own)]
        return there

    def rows(self, lower: Array, upper: Array) -> Rows:
        """Return what the record states about a box, but for rows that hold anywhere in it or say nothing."""
        parts = [self._rows_of(e, a, lower, upper) for a in range(len(ANCHORS)) for e in range(len(self._data))]
        forms = np.concatenate([forms for forms, _ in parts])
        sources = np.concatenate([sources for _, sources in parts])
        reach = np.abs(forms[:, SLOPES:]).sum(axis=1)
        impossible = np.flatnonzero((forms[:, LOW] > 0) | (forms[:, HIGH] < 0))
        with np.errstate(invalid="ignore"):
            useful = np.isfinite(forms[:, RADIUS]) & (np.abs(forms[:, CENTRE]) + reach > forms[:, RADIUS])
        if len(impossible):
            useful[:] = False
            useful[impossible[0]] = True
        kept = forms[useful]
        return Rows(kept[:, CENTRE], kept[:, RADIUS], kept[:, SLOPES:], sources[useful], 0 if len(impossible) else -1)

    def knowledge(self, lower: Array, upper: Array) -> float:
        """Return how much the rows of a box say: minus the sum of the logarithms of their radii, cut at `_UNKNOWN`."""
        return -float(np.log(np.clip(self._radii(lower, upper), TINY, _UNKNOWN)).sum())

    def says_nothing(self, lower: Array, upper: Array) -> bool:
        """Return whether nothing is known over a box of any output that the model computes."""
        first = self.tape.first[self._shown]
        for e in range(len(self._data)):
            found = self._run(e, 0, lower, upper)
            computed = found.places[:, 1] >= first[found.places[:, 0]]
            if not computed.any() or np.isfinite(found.outputs[computed, RADIUS]).any():
                return False
        return True

    def _radii(self, lower: Array, upper: Array) -> Array:
        parts = [self._run(e, a, lower, upper).outputs for a in range(len(ANCHORS)) for e in range(len(self._data))]
        return np.concatenate([forms[:, RADIUS] for forms in parts])

    def fits(self, point: Array) -> bool:
        """Return whether a point is verified to fit every sample.

        With the noise bound added to the measurement, the form of an output is not positive, and with the bound
        subtracted not negative. So by continuity it is zero for a noise between. And every operation is defined.
        """
        if np.any(point < self.lower) or np.any(point > self.upper):
            return False
        for e in range(len(self._data)):
            for sign in (-1.0, 1.0):
                found = self._run(e, 0, point, point, sign)
                forms = found.outputs
                reach = (np.abs(forms[:, SLOPES:]).sum(axis=1) + forms[:, RADIUS]) * _UP
                # A sensor's curve may fall.
                above, below = forms[:, CENTRE] - reach >= 0, forms[:, CENTRE] + reach <= 0
                if sign < 0:
                    first = above, below
                elif not np.all((first[0] & below) | (first[1] & above)):
                    return False
            bounded = found.constraints
            reach = (np.abs(bounded[:, SLOPES:]).sum(axis=1) + bounded[:, RADIUS]) * _UP
            if not np.all(bounded[:, CENTRE] >= reach):
                return False
        return True

    def _rows_of(self, e: int, a: int, lower: Array, upper: Array) -> tuple[Array, Index]:
        """Return forms that are zero somewhere in their enclosure, and where they come from."""
        found = self._run(e, a, lower, upper)
        count = len(found.outputs)
        sources = np.column_stack([np.full(count, a), np.full(count, e), found.places])
        if e or a:
            return found.outputs, sources
        # A form that is not negative, and at most its own largest value, is within half of that of its half.
        forms = found.constraints.copy()
        most = forms[:, HIGH].copy()
        forms[:, CENTRE] -= 0.5 * most
        forms[:, RADIUS] = (forms[:, RADIUS] + 0.5 * np.abs(most)) * _UP + EPSILON * np.abs(forms[:, CENTRE])
        forms[:, LOW] = np.where(most < 0, 1.0, -np.inf)
        forms[:, HIGH] = np.inf
        own = self._prior(lower, upper)
        places = np.zeros((len(forms) + len(own), 4), dtype=np.int64)
        places[:, 0] = np.repeat([CONSTRAINT, PRIOR], [len(forms), len(own)])
        places[:, 2] = np.concatenate([np.arange(len(forms)), np.arange(len(own))])
        return np.concatenate([found.outputs, forms, own]), np.concatenate([sources, places])

    def _prior(self, lower: Array, upper: Array) -> Array:
        """Return forms that are zero somewhere in their enclosure where the unknowns keep their boxes."""
        if self.frame is None:
            return np.zeros((0, SLOPES + len(lower)))
        forms = self._start(lower, upper, True)[:, : SLOPES + len(lower)]
        middle, half = middle_and_half(self.lower, self.upper)
        forms[:, CENTRE] -= middle
        forms[:, RADIUS] = (forms[:, RADIUS] + half + EPSILON * (np.abs(forms[:, CENTRE]) + np.abs(middle))) * _UP
        forms[:, LOW], forms[:, HIGH] = -np.inf, np.inf
        return forms

    def _run(self, e: int, a: int, lower: Array, upper: Array, shift: float = 0.0) -> _Forms:
        """Return the forms over a box; with a shift, for outputs that are exact and so many noise bounds larger."""
        tape, data, noise, states = self.tape, self._data[e], self._noise, self._states
        if shift:
            moved = np.zeros(len(noise))
            moved[self._outputs] = noise[self._outputs]
            # A measurement less its bound says nothing of the state.
            data, states = data + shift * moved[:, None], np.full_like(states, -1)
            noise = np.where(moved > 0, EPSILON * np.nanmax(np.abs(data), axis=1, initial=0.0), 0.0)  # of the sum above
        # A point, for which alone data are shifted, is one of the unknowns themselves.
        start = self._start(lower, upper, not shift)
        width = SLOPES + len(self.lower)
        outputs = np.zeros((len(tape.rows), data.shape[1], width))
        constraints = np.zeros((len(tape.constraints), width))
        enclose_run(
            (tape.once, tape.each, tape.numbers, tape.defined, tape.remembered, tape.first, tape.rows),
            (
                tape.inner,
                tape.sections,
                tape.integrated,
                float(self.model.sampling_time or self.data.sampling_time),
                self.model.substeps,
            ),
            (self.initial[e], self._outputs, states, tape.constraints),
            start,
            data,
            noise,
            tape.depth,
            KEPT,
            ANCHORS[a],
            bool(shift),
            outputs,
            constraints,
        )
        there = self._there[e]
        return _Forms(outputs[there], np.argwhere(there), constraints)

    @property
    def loose(self) -> tuple[str, ...]:
        """The parameters and the hidden states of which nothing is known beforehand."""
        known, shown = np.isfinite(self.upper - self.lower), {m.signal for m in self.model.measurements}
        names = [name.split("[")[0] for name, k in zip(self.names, known, strict=True) if not k]
        return tuple(dict.fromkeys(name for name in names if name not in shown))

    @property
    def box(self) -> tuple[Array, Array]:
        """The first box: of the coordinates, where there is a frame."""
        return (self.lower, self.upper) if self.frame is None else (self.frame.lower, self.frame.upper)

    def turned(self, signals: Mapping[str, Array]) -> Record:
        """Return the record in coordinates in which the coefficients of static curves are known well or not at all.

        Parameters
        ----------
        signals
            Of any run of the first experiment.
        """
        curves = list(static_curves(self.model, signals))
        if not curves or not np.isfinite(self.upper - self.lower).all():
            return self
        other = copy(self)
        other.frame = Frame.of(self.lower, self.upper, curves)
        return other

    def _start(self, lower: Array, upper: Array, framed: bool) -> Array:
        """Return the forms of the unknowns over a box, of the coordinates where it is framed."""
        count = len(lower)
        forms = np.zeros((count, SLOPES + count + KEPT))
        middle, half = middle_and_half(lower, upper)
        if self.frame is None or not framed:
            forms[:, CENTRE], forms[:, RADIUS] = middle, np.where(np.isfinite(upper - lower), 0.0, np.inf)
            forms[np.arange(count), SLOPES + np.arange(count)] = half
            forms[:, LOW], forms[:, HIGH] = lower, upper
        else:
            self.frame.write(forms, middle, half)
            forms[:, LOW] = np.maximum(forms[:, LOW], self.lower)
            forms[:, HIGH] = np.minimum(forms[:, HIGH], self.upper)
        return forms


def _with_bounds_measured(
    model: Model, data: Dataset, bounds: Mapping[str, float]
) -> tuple[Model, list[dict[str, Array]], dict[str, float]]:
    """Return a model that measures its bounded hidden signals, with the samples of each experiment, and the bounds.

    To lie between two ends is to be measured as their middle, within half of their distance.
    """
    runs = [dict(run.values) for run in data.experiments]
    within, taken = dict(bounds), set(model.names)
    measurements = list(model.measurements)
    for name, (low, high) in model.bounds.items():
        channel, noise = (unused(f"{name}_{what}", taken) for what in ("between", "within"))
        taken |= {channel, noise}
        middle = 0.5 * low + 0.5 * high
        within[channel] = max(high - middle, middle - low) * (1 + 4 * EPSILON)
        for values, run in zip(runs, data.experiments, strict=True):
            values[channel] = np.full(run.n_samples, middle)
        measurements.append(Measurement(channel, name, noise))
    return replace(model, measurements=tuple(measurements), bounds={}), runs, within
