"""Free run of a model together with its derivatives by parameters and initial states.

Differentiating every line gives the forward sensitivities.  With S the derivative of all signals by one parameter p,

    S_i[t] = sum over reads (j, k) of  (df_i / dx_j[t-k]) S_j[t-k]  +  df_i / dp.

First the compiled lines of `smid.models.compiled` give the trajectory, then those of `smid.models.machine_slopes` the
derivatives along it, group by group.

States before sample 0 are given. Inputs before sample 0 have their first value, or a given value where a line looks
further back than one sample. At a kink (Max, Abs, sign) a one-sided derivative or their mean is taken.
Reference: Khalil, Nonlinear Systems, 3rd ed., section 3.3 (sensitivity equations).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from relaxations.algebra.arrays import Array
from smid.models.compiled import Group, compile_lines
from smid.models.machine_slopes import SlopesLoop, compile_slopes
from smid.models.model import Model
from smid.models.structure import exogenous, is_clock, state_lags
from smid.models.symbols import plain_symbols

__all__ = ["FreeRun", "Initial", "compile_free_run"]

Reference = tuple[str, int]
Initial = Mapping[Reference, float]
"""Values of states before sample 0: ``(state, k)`` stands for ``state[-k]``, k >= 1."""


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
    _groups: tuple[tuple[Group, SlopesLoop | None, bool], ...]
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
        return self._sensitivities(known, {**self._fixed, **values})

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
        history, width = self._history, len(self.parameters) + len(self.states)
        shape = (*known[self._groups[-1][0].signals[0]].shape, width)
        column = {name: k for k, name in enumerate(self.parameters)}
        found: dict[str, Array] = {}
        for group, slopes, _ in self._groups:
            for name in group.signals if slopes else ():
                found[name] = np.zeros(shape)
        for name in self._before:
            found[name] = np.zeros(shape)
        for k, (name, lag) in enumerate(self.states):
            # Older samples are held at the oldest that is a state, so they move with it only.
            samples = slice(0, history - lag + 1)
            found[name][..., samples, :] = 0.0
            found[name][..., samples, len(column) + k] = 1.0
        for group, slopes, _ in self._groups:
            if slopes:
                slopes.run(known, values, found, column, history)
                if not group.recursive:
                    first = found[group.signals[0]]
                    first[..., :history, :] = first[..., history, None, :]
        return found


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
    # With one lag only, the state at sample 0 already contains the effect of earlier inputs.
    deep = {name for line in lines for name, lag in line.reads if lag > 1}
    before = tuple(name for name in exogenous(lines) if name in deep)
    parts, clocks, moving = [], set(), set(before)
    for group in compile_lines(lines):
        clock = len(group.lines) == 1 and is_clock(group.lines[0])
        clocks |= set(group.signals) if clock else set()
        slopes = None if clock else _slopes(group, moving, frozenset(free))
        moving |= set(group.signals) if slopes else set()
        parts.append((group, slopes, clock))
    states = tuple(
        (name, lag)
        for name, deepest in state_lags(lines).items()
        if name not in clocks
        for lag in range(1, deepest + 1)
    )
    states += tuple((name, 1) for name in before)
    return FreeRun(free, states, tuple(parts), history, frozenset(before), fixed)


def _slopes(group: Group, moving: set[str], free: frozenset[str]) -> SlopesLoop | None:
    """Return the derivatives of a group; None where neither fitted numbers nor states move it."""
    defined = moving | set(group.signals)
    varying = tuple(tuple(sorted(read for read in line.reads if read[0] in defined)) for line in group.lines)
    held = free & set().union(*(plain_symbols(line.expression) for line in group.lines))
    return compile_slopes(group.lines, varying, held) if held or any(varying) else None
