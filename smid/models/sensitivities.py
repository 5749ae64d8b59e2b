"""Free run of a model together with its derivatives by parameters and initial states.

Differentiating every line gives the forward sensitivities.  With S the derivative of all signals by one parameter p,

    S_i[t] = sum over reads (j, k) of  (df_i / dx_j[t-k]) S_j[t-k]  +  df_i / dp.

First the compiled lines of `smid.models.compiled` give the trajectory. All partial derivatives along it are NumPy
expressions over time. The rest is a *linear* recursion: for all samples at once, a unit lower triangular banded system
with one right-hand side per parameter. LAPACK's dtbtrs solves it, without a loop through time in Python.

Many parameter vectors run in lockstep, and their derivatives are computed a few at a time to stay in the cache.

States before sample 0 are given. Inputs before sample 0 have their first value, or a given value where a line looks
further back than one sample. At a kink (Max, Abs, sign) a one-sided derivative or their mean is taken.
Reference: Khalil, Nonlinear Systems, 3rd ed., section 3.3 (sensitivity equations).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

import numpy as np
import sympy
from numpy.typing import NDArray
from scipy.linalg.lapack import dtbtrs

from relaxations.algebra.arrays import Array
from smid.models.compiled import Group, compile_lines
from smid.models.differentiate import derivatives
from smid.models.model import Model
from smid.models.parts import Line
from smid.models.structure import exogenous, groups, state_lags
from smid.models.symbols import plain_symbols, references, signal, t

__all__ = ["FreeRun", "Initial", "compile_free_run"]

Reference = tuple[str, int]
Initial = Mapping[Reference, float]
"""Values of states before sample 0: ``(state, k)`` stands for ``state[-k]``, k >= 1."""


@dataclass(frozen=True)
class _Slopes:
    """Partial derivatives of one line: by what it reads and by the parameters it holds."""

    signal: str
    parameters: tuple[str, ...]
    reads: tuple[Reference, ...]
    by_signal: tuple[Reference, ...]
    by_parameter: tuple[str, ...]
    function: Callable[..., Any]

    def along(self, known: Mapping[str, Array], values: Mapping[str, Any], start: int) -> list[Array]:
        """Evaluate every derivative from sample `start` on, each of shape (..., count)."""
        *lead, count = known[self.signal].shape
        shape = (*lead, count - start)
        arguments = [known[name][..., start - lag : count - lag] for name, lag in self.reads]
        found = self.function(*(values[name] for name in self.parameters), *arguments)
        return [item if np.shape(item) == shape else np.broadcast_to(item, shape) for item in found]


@dataclass(frozen=True)
class FreeRun:
    """A model compiled for free runs with sensitivities.

    Attributes
    ----------
    parameters
        Names of the free parameters (those whose box is not a point), in the model's order.
    states
        Values needed before sample 0: ``(state, k)`` for ``state[-k]``, and ``(input, 1)`` for an input that is read
        further back. Clocks are left out.
    """

    parameters: tuple[str, ...]
    states: tuple[Reference, ...]
    _groups: tuple[tuple[Group, tuple[_Slopes, ...], bool], ...]
    _history: int
    _before: frozenset[str]
    _fixed: Mapping[str, float]

    def run(
        self, inputs: Mapping[str, Array], values: Mapping[str, Any], initial: Initial, *, jacobian: bool = True
    ) -> tuple[dict[str, Array], dict[str, Array]]:
        """Simulate one experiment.

        Parameters
        ----------
        inputs
            Input signals, shape (n,).
        values
            Values of `parameters`; arrays of shape (B,) belong to `trajectory` and `slopes`.

        Returns
        -------
        signals : dict of str to numpy.ndarray
            Every signal, shape (n,); inf or NaN where an unstable model runs away.
        derivatives : dict of str to numpy.ndarray
            Per signal, shape (n, n_parameters + n_states): columns by `parameters`, then by `states`; signals that
            depend on neither are missing.  Empty without `jacobian`, or where a signal is not finite.
        """
        known = self.trajectory(inputs, values, initial)
        slopes = self.slopes(known, values) if jacobian else {}
        return self.cut(known), self.cut(slopes)

    def cut(self, found: Mapping[str, Array], *, time: int = 0) -> dict[str, Array]:
        """Return the samples from 0 on, along the axis `time`."""
        samples = (slice(None),) * time + (slice(self._history, None),)
        return {name: item[samples] for name, item in found.items()}

    def trajectory(self, inputs: Mapping[str, Array], values: Mapping[str, Any], initial: Initial) -> dict[str, Array]:
        """Return every signal, with the samples before the first that are read.

        Values of shape (B,) run B parameter vectors in lockstep: the signals that lines define have shape (B, n) then.
        """
        history = self._history
        everything = {**self._fixed, **values}
        lead = next((value.shape for value in values.values() if isinstance(value, np.ndarray)), ())
        known = {
            name: np.concatenate([np.full(history, initial.get((name, 1), x[0])), x]) for name, x in inputs.items()
        }
        shape = (*lead, len(next(iter(known.values()))))
        with np.errstate(all="ignore"):
            for group, _, clock in self._groups:
                self._values(group, clock, known, everything, initial, shape)
        return known

    def finite(self, known: Mapping[str, Array]) -> NDArray[np.bool_]:
        """Return whether each of the runs stays in the finite range."""
        lines = (line for group, _, _ in self._groups for line in group.signals)
        return np.asarray(np.logical_and.reduce([np.isfinite(known[line]).all(axis=-1) for line in lines]))

    def slopes(self, known: Mapping[str, Array], values: Mapping[str, Any]) -> dict[str, Array]:
        """Return the derivatives along a trajectory, with the samples before the first; none where it is not finite.

        Of runs in lockstep, shape (B, n, n_parameters + n_states), and none where one of them is not finite.
        """
        if not self.finite(known).all():
            return {}
        columns = {
            name: value[:, None] if isinstance(value, np.ndarray) else value
            for name, value in {**self._fixed, **values}.items()
        }
        with np.errstate(all="ignore"):
            found = self._sensitivities(known, columns)
        return {name: np.swapaxes(item, -1, -2) for name, item in found.items()}

    def _values(
        self,
        group: Group,
        clock: bool,
        known: dict[str, Array],
        values: Mapping[str, Any],
        initial: Initial,
        shape: tuple[int, ...],
    ) -> None:
        history = self._history
        for name in group.signals:
            samples = known[name] = np.zeros(shape)
            for lag in range(1, history + 1):
                # Samples older than any that is read are not used: hold them.
                held = samples[..., history - lag + 1] if lag > 1 else 0.0
                samples[..., history - lag] = initial.get((name, lag), held)
        group.evaluate(known, values, history + clock)
        if not group.recursive:
            samples = known[group.signals[0]]
            samples[..., :history] = samples[..., history, None]

    def _sensitivities(self, known: Mapping[str, Array], values: Mapping[str, Any]) -> dict[str, Array]:
        """Return the derivatives, shape (..., width, n): samples side by side, as every step here runs along them."""
        history, width = self._history, len(self.parameters) + len(self.states)
        *lead, count = known[self._groups[-1][0].signals[0]].shape
        n = count - history
        column = {name: k for k, name in enumerate((*self.parameters, *self.states))}
        found: dict[str, Array] = {}
        for state in self.states:
            if state[0] in self._before:
                found[state[0]] = np.zeros((*lead, width, count))
                found[state[0]][..., column[state], :history] = 1.0
        for group, slopes, clock in self._groups:
            if clock or not any(s.by_signal or s.by_parameter for s in slopes):
                continue
            # Put in what a line reads at the same time: the forcing and the past are left.
            forcing: dict[str, Array] = {}
            past: dict[str, dict[Reference, Array]] = {}
            for slope in slopes:
                own = np.zeros((*lead, width, n))
                taken: dict[Reference, Array] = {}
                along = slope.along(known, values, history)
                for (name, lag), derivative in zip(slope.by_signal, along, strict=False):
                    if name in found:
                        own += derivative[..., None, :] * found[name][..., history - lag : count - lag]
                    elif lag and name in group.signals:
                        taken[name, lag] = taken.get((name, lag), 0.0) + derivative
                    elif name in group.signals:
                        own += derivative[..., None, :] * forcing[name]
                        for early, share in past[name].items():
                            taken[early] = taken.get(early, 0.0) + derivative * share
                for name, derivative in zip(slope.by_parameter, along[len(slope.by_signal) :], strict=True):
                    own[..., column[name], :] += derivative
                forcing[slope.signal], past[slope.signal] = own, taken
            remembered = [name for name in group.signals if any(name == read for p in past.values() for read, _ in p)]
            for name in remembered:
                found[name] = np.zeros((*lead, width, count))
                for state in self.states:
                    if state[0] == name:
                        # Older samples are held at the oldest that is a state, so they move with it only.
                        found[name][..., : history - state[1] + 1] = 0.0
                        found[name][..., column[state], : history - state[1] + 1] = 1.0
            if remembered:
                self._recur(remembered, forcing, past, found)
            for name in group.signals:
                if name not in found:
                    for (read, lag), share in past[name].items():
                        forcing[name] += share[..., None, :] * found[read][..., history - lag : count - lag]
                    first = forcing[name][..., :1].repeat(history, axis=-1) * (not group.recursive)
                    found[name] = np.concatenate([first, forcing[name]], axis=-1)
        return found

    def _recur(
        self,
        members: Sequence[str],
        forcing: Mapping[str, Array],
        past: Mapping[str, Mapping[Reference, Array]],
        found: dict[str, Array],
    ) -> None:
        """Complete, from sample 0 on, the derivatives of signals that follow from their common past and a forcing."""
        history, size = self._history, len(members)
        *lead, width, n = forcing[members[0]].shape
        deepest = max(lag for name in members for _, lag in past[name])
        right = np.empty((*lead, width, n, size))
        bands = np.zeros((*lead, n * size, deepest * size + size))
        for i, name in enumerate(members):
            right[..., i] = forcing[name]
            for (read, lag), share in past[name].items():
                early, k = min(lag, n), members.index(read)
                before = found[read][..., history - lag : history - lag + early]
                right[..., :early, i] += share[..., None, :early] * before
                # LAPACK's band storage is by column: the row of (t, i) meets the column of (t - lag, k).
                bands[..., k : (n - early) * size : size, lag * size + i - k] = -share[..., lag:]
        systems = bands.reshape(-1, *bands.shape[-2:]), right.reshape(-1, width, n * size)
        for band, columns in zip(*systems, strict=True):
            dtbtrs(band.T, columns.T, uplo="L", diag="U", overwrite_b=True)
        for i, name in enumerate(members):
            found[name][..., history:] = right[..., i]


def compile_free_run(model: Model) -> FreeRun:
    """Compile a model for free runs with sensitivities.

    Examples
    --------
    >>> from smid.models import OutputError
    >>> run = compile_free_run(OutputError())
    >>> run.parameters, run.states
    (('a1', 'b0'), (('w', 1),))
    >>> signals, slopes = run.run({"u": np.ones(3)}, {"a1": -0.5, "b0": 1.0}, {("w", 1): 0.0})
    >>> signals["w"], slopes["w"][:, 1]
    (array([1.  , 1.5 , 1.75]), array([1.  , 1.5 , 1.75]))
    """
    return _compiled(replace(model, values={}))


@lru_cache(maxsize=512)
def _compiled(model: Model) -> FreeRun:
    lines = model.discretised().lines
    free = tuple(p.name for p in model.parameters if p.lower < p.upper)
    fixed = {p.name: p.lower for p in model.parameters if p.lower == p.upper}
    history = max((lag for line in lines for _, lag in line.reads), default=0)
    history = max(history, 1)
    parts = []
    clocks = set()
    symbolic = [group for group, _ in groups(lines)]
    # With one lag only, the state at sample 0 already contains the effect of earlier inputs.
    deep = {name for line in lines for name, lag in line.reads if lag > 1}
    before = tuple(name for name in exogenous(lines) if name in deep)
    defined = {*(line.signal for line in lines), *before}
    for group, own in zip(compile_lines(lines), symbolic, strict=True):
        clock = _is_clock(own)
        clocks |= set(group.signals) if clock else set()
        parts.append((group, tuple(_slopes(line, *_varying(line, free, defined)) for line in own), clock))
    states = tuple(
        (name, lag)
        for name, deepest in state_lags(lines).items()
        if name not in clocks
        for lag in range(1, deepest + 1)
    )
    states += tuple((name, 1) for name in before)
    return FreeRun(free, states, tuple(parts), history, frozenset(before), fixed)


def _is_clock(group: Sequence[Line]) -> bool:
    """Return whether a line depends on its own past only: a clock, which is 0 at sample 0."""
    expression = group[0].expression
    reads = references(expression)
    return (
        len(group) == 1
        and bool(reads)
        and all(name == group[0].signal for name, _ in reads)
        and not plain_symbols(expression)
    )


def _varying(line: Line, free: Sequence[str], defined: set[str]) -> tuple[tuple[Reference, ...], tuple[str, ...]]:
    """Return the reads and parameters of a line that may vary with the fitted numbers."""
    reads = tuple(sorted(read for read in line.reads if read[0] in defined))
    return reads, tuple(sorted(plain_symbols(line.expression) & set(free)))


# Of an edited model one line is new; the others were differentiated before.
@lru_cache(maxsize=4096)
def _slopes(line: Line, by_signal: tuple[Reference, ...], by_parameter: tuple[str, ...]) -> _Slopes:
    reads = tuple(sorted(line.reads))
    names = tuple(sorted(plain_symbols(line.expression)))
    constants = [sympy.Symbol(name, real=True) for name in names]
    read = {(name, lag): signal(name)[t - lag] for name, lag in reads}
    by = [*(read[item] for item in by_signal), *(sympy.Symbol(name, real=True) for name in by_parameter)]
    function = derivatives([*constants, *read.values()], line.expression, by)
    return _Slopes(line.signal, names, reads, by_signal, by_parameter, function)
