"""The least-squares problem of a free run: parameters and initial states whose output is closest to the data.

Minimises the sum of ``((y - y_free_run) / s)^2`` over experiments and output channels, with s the standard deviation of
the channel. Uses analytic sensitivities (`smid.models.sensitivities`) and the trust-region reflective method, which
respects boxes. The result is a local minimum without proof; it is a start for certified methods and for diagnosis.

Initial states are estimated together with the parameters, with these exceptions:

- More than 12 initial states in an experiment, or 100 in all, are not estimated. A measured state then starts at its
  first sample. Other states start at the equilibrium under the first input, or at zero if there is none.
- The memory of a stop with fixed limits starts fixed. Beyond the limits the output does not depend on the initial
  value, so a descent could not return.
- An experiment without fitted samples gets the initial states that fit its first samples best, as in validation.

Reference: Ljung, System Identification, 2nd ed., section 10.2 (output error, gradients by filtering).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
import sympy
from scipy.optimize import least_squares

from relaxations.algebra.arrays import Array, Index, Mask
from relaxations.deadline import check_time
from smid.data import Dataset
from smid.display.result import Part, Result
from smid.models import Line, Model
from smid.models.sensitivities import FreeRun, Initial, compile_free_run
from smid.models.sensor import channel_to_signal, signal_to_channel
from smid.models.symbols import VALUE, distinct_parts, plain_symbols, references

Errors = tuple[tuple[int, str, Array, Array], ...]
"""What `Fitting.errors` yields: index of the experiment, output channel, errors (n,), derivatives (n, n_free)."""

_MOST_INITIAL, _MOST_IN_ALL = 12, 100
_SETTLING = 400
_HALVINGS = 10  # of the way back to where a number still does something
_LEVELS = 9  # at which an abrupt memory may begin
_BEGINNING = 25  # samples per state for the initial states of an experiment that is not fitted
_SMALL, _ENDLESS = 1e-6, 0.95  # change in the second half over change in the first: settled below, no limit above
_RUNAWAY = 1e6  # standard deviations; a larger residual counts as divergence


@dataclass(frozen=True, eq=False, repr=False)
class Fit(Result):
    """Model fitted to data.

    Parameters
    ----------
    initial
        Per experiment, the states before sample 0.
    simulated
        Shape (n,). Per experiment, the free run over the whole record, including samples that were not fitted.
    cost
        Sum of the squared, scaled residuals over the fitted samples.
    n_free
        Number of fitted numbers: parameters and initial states.
    """

    model: Model
    initial: tuple[Initial, ...]
    simulated: tuple[Mapping[str, Array], ...]
    cost: float
    n_free: int

    def _content(self) -> Iterator[Part]:
        yield self.model
        yield f"{self.n_free} fitted numbers; sum of the squared residuals, in standard deviations: {self.cost:.6g}"

    @property
    def is_finite(self) -> bool:
        """Return whether the free run stays finite over the whole record."""
        return all(np.isfinite(samples).all() for run in self.simulated for samples in run.values())

    def residual(self, data: Dataset, channel: str) -> tuple[Array, ...]:
        """Return measured minus simulated, per experiment, in the channel's unit; NaN where a sample is missing."""
        return tuple(
            run.values[channel] - simulated[channel]
            for run, simulated in zip(data.experiments, self.simulated, strict=True)
        )


def _equilibrium(settling: Array) -> float:
    """Return the final value of a step response, by Aitken's extrapolation; zero if it does not settle."""
    half, last = float(settling[len(settling) // 2 - 1]), float(settling[-1])
    if not (np.isfinite(last) and abs(last) < 1e12):
        return 0.0
    left = (last - half) / half if half else 0.0
    if abs(left) < _SMALL:
        return last
    return half / (1 - left) if abs(left) < _ENDLESS else 0.0


class Fitting:
    """Least-squares problem of a model and data, prepared for many evaluations.

    Parameters
    ----------
    model
        Bound to the data's channels.
    used
        Shape (n,). Per experiment, the samples to fit; those that are missing are left out.
    initial
        Per experiment, known states before sample 0; the other states are guessed.
    scale
        Of each output channel: what its errors are divided by; by default its standard deviation.
    difference
        Whether to use finite differences for the Jacobian, for comparison.
    """

    def __init__(
        self,
        model: Model,
        data: Dataset,
        used: Sequence[Mask],
        initial: Sequence[Initial] | None = None,
        *,
        scale: Mapping[str, float] | None = None,
        difference: bool = False,
    ) -> None:
        self.model, self.data, self.difference = model, data, difference
        self.run: FreeRun = compile_free_run(model)
        self.used = [np.asarray(u, bool) for u in used]
        self.known = list(initial) if initial is not None else [{} for _ in data.experiments]
        sensors = {m.signal: m for m in reversed(model.measurements)}
        # While fitting, simulate up to the last fitted sample only.
        self._stop = [int(np.flatnonzero(u)[-1]) + 1 if u.any() else 0 for u in self.used]
        # Input signals, through the inverse of a sensor curve if there is one.
        self.inputs = [
            {name: run.values[channel] for name, channel in zip(model.inputs, model.input_channels, strict=True)}
            for run in data.experiments
        ]
        for name in model.inputs:
            if name in sensors and sensors[name].inverse is not None:
                for inputs in self.inputs:
                    inputs[name] = channel_to_signal(sensors[name], inputs[name], dict(model.values))
        # Outputs, each with its scale.
        self.outputs = list(model.outputs)
        self.scale = scale or {
            m.channel: float(np.nanstd(np.concatenate([r.values[m.channel] for r in data.experiments]))) or 1.0
            for m in self.outputs
        }
        self.there = [{m.channel: ~np.isnan(r.values[m.channel]) for m in self.outputs} for r in data.experiments]
        self._fitted = [
            {channel: _chosen(used[:stop] & there[:stop]) for channel, there in mine.items()}
            for used, stop, mine in zip(self.used, self._stop, self.there, strict=True)
        ]
        self._last: dict[int, tuple[bytes, dict[str, Array]]] = {}
        # Initial states to estimate: all but the memories of stops, if they are few.
        memories = {line.signal for line in model.lines if _is_stop(line.expression)}
        self.begun = [k for k, (name, _) in enumerate(self.run.states) if name not in memories]
        self.frees_initial = len(self.begun) <= min(_MOST_INITIAL, _MOST_IN_ALL / len(data.experiments))
        # A step of the run hides from a descent which way such a state has to go.
        stepping = {line.signal for line in model.lines if _steps_by_itself(line)} - set(sensors)
        self._abrupt = [k for k in self.begun if self.run.states[k][0] in stepping]
        self.lower = np.array([model.parameter(n).lower for n in self.run.parameters])
        self.upper = np.array([model.parameter(n).upper for n in self.run.parameters])

    @property
    def n_free(self) -> int:
        """Return the number of unknowns: parameters and initial states."""
        return len(self.run.parameters) + self.frees_initial * len(self.begun) * len(self.data.experiments)

    @property
    def box(self) -> tuple[Array, Array]:
        """Return the bounds of the unknowns; initial states have none."""
        free = np.full(self.n_free - len(self.run.parameters), np.inf)
        return np.concatenate([self.lower, -free]), np.concatenate([self.upper, free])

    def start(self, values: Mapping[str, float]) -> Array:
        """Return a start vector: parameter values, then known or guessed initial states, whichever fit better."""
        start = self.quick_start(values)
        return self._begun_abruptly(start) if self._abrupt and self.frees_initial else start

    def quick_start(self, values: Mapping[str, float]) -> Array:
        """Return a start vector in which abrupt memories begin where they are guessed."""
        theta = [float(values[name]) for name in self.run.parameters]
        vector = np.clip(theta, self.lower, self.upper)
        inside = dict(zip(self.run.parameters, vector.tolist(), strict=True))
        self._guessed = [self._guess(e, inside, self.known[e]) for e in self._each()]
        self._last.clear()  # stored runs may have another initial state
        if not self.frees_initial:
            return vector
        start = self._joined(vector, self._guessed)
        if any(self.known):
            # States known from other parameters may fit worse than a guess.
            fresh = self._joined(vector, [self._guess(e, inside, {}) for e in self._each()])
            start = min(start, fresh, key=self.cost)
        return start

    def _begun_abruptly(self, start: Array) -> Array:
        """Return a start vector whose abrupt memories begin at the best of some levels that they reach later."""
        for e in self._each():
            signals, _ = self.run.run(self.inputs[e], self._values(start), self.initial(start)[e], jacobian=False)
            for k in self._abrupt:
                if self.run.states[k] in self.known[e]:  # fitted before
                    continue
                reached = signals[self.run.states[k][0]]
                place = len(self.run.parameters) + e * len(self.begun) + self.begun.index(k)
                others = np.repeat(start[None], _LEVELS, axis=0)
                others[:, place] = np.linspace(np.nanmin(reached), np.nanmax(reached), _LEVELS)
                start = min([start, *others], key=self.cost)
        return start

    def cost(self, vector: Array) -> float:
        """Return the sum of the squared residuals; infinite where the simulation diverges."""
        return float(np.nan_to_num(np.sum(self.residual(vector) ** 2), nan=np.inf))

    def at(self, values: Mapping[str, float], initial: Sequence[Initial]) -> Array:
        """Return the vector of parameter values and initial states: a simulation there repeats a fit."""
        self._guessed = [dict(states) for states in initial]
        self._last.clear()  # stored runs may have another initial state
        parameters = np.array([values[name] for name in self.run.parameters], float)
        return self._joined(parameters, self._guessed) if self.frees_initial else parameters

    def _joined(self, parameters: Array, guesses: Sequence[Initial]) -> Array:
        return np.concatenate([parameters, *([guess[self.run.states[k]] for k in self.begun] for guess in guesses)])

    def _each(self) -> range:
        return range(len(self.data.experiments))

    def _guess(self, experiment: int, values: Mapping[str, float], known: Initial) -> dict[tuple[str, int], float]:
        """Return states before sample 0: known, else as measured, else at equilibrium with the first input."""
        measured = {m.signal: m for m in self.outputs}
        guess = {}
        settled: dict[str, Array] | None = None
        for name, lag in self.run.states:
            if (name, lag) in known:
                guess[name, lag] = known[name, lag]
            elif name in self.inputs[experiment]:
                guess[name, lag] = float(self.inputs[experiment][name][0])
            elif name in measured and measured[name].inverse is None:
                samples = self.data.experiments[experiment].values[measured[name].channel]
                guess[name, lag] = float(samples[np.argmax(~np.isnan(samples))])
            else:
                if settled is None:
                    held = {k: np.full(_SETTLING, v[0]) for k, v in self.inputs[experiment].items()}
                    zero = dict.fromkeys(self.run.states, 0.0)
                    settled, _ = self.run.run(held, values, zero, jacobian=False)
                guess[name, lag] = _equilibrium(settled[name])
        return guess

    def initial(self, vector: Array) -> list[Initial]:
        """Return the initial states in a vector, per experiment."""
        if not self.frees_initial:
            return [dict(g) for g in self._guessed]
        rest = vector[len(self.run.parameters) :].reshape(len(self.data.experiments), -1)
        states = [self.run.states[k] for k in self.begun]
        return [
            {**guess, **dict(zip(states, row.tolist(), strict=True))}
            for guess, row in zip(self._guessed, rest, strict=True)
        ]

    def simulate(self, vector: Array) -> list[dict[str, Array]]:
        """Return the output channels of the free run, per experiment, over the whole record."""
        values, result = self._values(vector), []
        for e, initial in enumerate(self.initial(vector)):
            signals, _ = self.run.run(self.inputs[e], values, initial, jacobian=False)
            result.append({m.channel: self._seen(m, e, signals[m.signal], values) for m in self.outputs})
        return result

    def _values(self, vector: Array) -> dict[str, float]:
        return dict(zip(self.run.parameters, vector[: len(self.run.parameters)].tolist(), strict=True))

    def _seen(self, measurement: Any, experiment: int, samples: Array, values: Mapping[str, float]) -> Array:
        if measurement.inverse is None:
            return samples
        anchor = float(np.nanmedian(self.data.experiments[experiment].values[measurement.channel]))
        return signal_to_channel(measurement, samples, values, anchor)

    def residual(self, vector: Array) -> Array:
        """Return simulated minus measured over the fitted samples, scaled."""
        return self._evaluate(vector, False)[0]

    @cached_property
    def places(self) -> Index:
        """Return experiment and sample of each entry of `residual`, shape (n, 2), where all samples are fitted."""
        runs = enumerate(self.there)
        there = [(e, np.flatnonzero(mine[m.channel])) for e, mine in runs for m in self.outputs]
        return np.concatenate([np.stack([np.full(len(samples), e), samples], axis=1) for e, samples in there])

    def jacobian(self, vector: Array) -> Array:
        """Return the derivative of `residual`, shape (n, n_free)."""
        return self._evaluate(vector, True)[1]

    def _evaluate(self, vector: Array, jacobian: bool) -> tuple[Array, Array]:
        residuals, blocks = [], []
        for e, channel, error, slope in self.errors(vector, jacobian):
            fitted, scale = self._fitted[e][channel], self.scale[channel]
            with np.errstate(over="ignore", invalid="ignore"):  # divergence is handled below
                residuals.append(error[fitted] / scale)
                if jacobian:
                    blocks.append(slope[fitted] / scale)
        residual = np.concatenate(residuals)
        if not np.abs(residual).max(initial=0.0) < _RUNAWAY:  # also where it is NaN
            residual = np.full_like(residual, np.inf)
        return residual, np.concatenate(blocks) if jacobian else np.empty((0, 0))

    def errors(self, vector: Array, jacobian: bool) -> Iterator[tuple[int, str, Array, Array]]:
        """Yield the error of each experiment and output channel up to the last fitted sample, with its derivative.

        An item has the index of the experiment, the channel, simulated minus measured in the channel's unit, shape
        (n,), NaN where it is missing, and its derivative by the unknowns, shape (n, n_free); without `jacobian` shape
        (n, 0).
        """
        check_time()
        values, count = self._values(vector), len(self.run.parameters)
        for e, initial in enumerate(self.initial(vector)):
            stop = self._stop[e]
            if not stop:
                continue
            # Simulate, with sensitivities if needed.
            known = self._trajectory(e, vector, values, initial)
            signals, slopes = self.run.cut(known), self.run.cut(self.run.slopes(known, values)) if jacobian else {}
            for m in self.outputs:
                seen = self._seen(m, e, signals[m.signal], values)
                block = np.zeros((stop, self.n_free * jacobian))
                # Jacobian rows: parameters, then the initial states of this experiment.
                if jacobian:
                    slope = slopes.get(m.signal, np.zeros((stop, count + len(self.run.states))))
                    slope = self._through_sensor(m, seen, slope, values)
                    block[:, :count] = slope[:, :count]
                    if self.frees_initial:
                        width = len(self.begun)
                        block[:, count + e * width : count + (e + 1) * width] = slope[:, count:][:, self.begun]
                with np.errstate(over="ignore", invalid="ignore"):  # a run may diverge
                    error = seen - self.data.experiments[e].values[m.channel][:stop]
                yield e, m.channel, error, block

    def _trajectory(
        self, experiment: int, vector: Array, values: Mapping[str, float], initial: Initial
    ) -> dict[str, Array]:
        """Return the free run up to the last fitted sample; the Jacobian reuses the residual's run."""
        asked = vector.tobytes()
        at, known = self._last.get(experiment, (None, {}))
        if at != asked:
            inputs = {name: samples[: self._stop[experiment]] for name, samples in self.inputs[experiment].items()}
            known = self.run.trajectory(inputs, values, initial)
            self._last[experiment] = asked, known
        return known

    def _through_sensor(self, measurement: Any, seen: Array, slope: Array, values: Mapping[str, float]) -> Array:
        """Return slopes of a sensor given by its inverse g: ``g(y, p) = w``, ``dy = (dw - g_p dp) / g_y``."""
        if measurement.inverse is None:
            return slope
        names = sorted(s.name for s in measurement.inverse.free_symbols if s != VALUE)
        symbols = [VALUE, *(sympy.Symbol(n, real=True) for n in names)]
        everything = {p.name: p.lower for p in self.model.parameters} | dict(values)
        arguments = [seen, *(everything[n] for n in names)]
        steep = sympy.lambdify(symbols, sympy.diff(measurement.inverse, VALUE), "numpy")(*arguments)
        slope = slope.copy()
        for name in set(names) & set(self.run.parameters):
            by = sympy.lambdify(symbols, sympy.diff(measurement.inverse, sympy.Symbol(name, real=True)), "numpy")
            slope[:, self.run.parameters.index(name)] -= by(*arguments)
        return np.asarray(slope / np.broadcast_to(steep, seen.shape)[:, None])

    def explained(self, vector: Array, base_cost: float) -> float:
        """Return the share of a base cost that one Gauss-Newton step removes, in the linear approximation."""
        residual, jacobian = self._evaluate(vector, True)
        if not (np.isfinite(residual).all() and np.isfinite(jacobian).all()):
            return -np.inf
        norms = np.linalg.norm(jacobian, axis=0)
        scaled = jacobian / np.where(norms > 0, norms, 1.0)
        step, *_ = np.linalg.lstsq(scaled, -residual, rcond=1e-10)
        return 1.0 - float(np.sum((residual + scaled @ step) ** 2)) / base_cost

    def solve(
        self, vector: Array, evaluations: int = 60, tolerance: float = 1e-7, held: Sequence[str] = ()
    ) -> tuple[Array, float]:
        """Return the best vector found from a start, shape (n_free,), and its cost.

        The cost is infinite if the simulation diverges at the start.

        Parameters
        ----------
        evaluations
            Maximum number of evaluations.
        tolerance
            Relative reduction of the cost at which the search stops.
        held
            Parameters that keep their start values.
        """
        lower, upper = self.box
        inside = np.clip(vector, lower, upper)
        # Fix held parameters, and initial states of experiments without fitted samples.
        moves = np.array(
            [n not in held for n in self.run.parameters]
            + [u.any() for u in self.used for _ in self.begun] * self.frees_initial,
            bool,
        )
        residual = self.residual(inside)
        cost = float(np.sum(residual**2)) if np.isfinite(residual).all() else np.inf
        if not (np.isfinite(cost) and moves.any()):
            return inside, cost

        def whole(x: Array) -> Array:
            full = inside.copy()
            full[moves] = x
            return full

        def error(x: Array) -> Array:
            return self.residual(whole(x))

        def slopes(x: Array) -> Array:
            return np.nan_to_num(self.jacobian(whole(x))[:, moves], posinf=0.0, neginf=0.0)

        def found(start: Array, low: Array, high: Array) -> tuple[Array, float, Mask]:
            """Minimise over the free numbers; return where it ended, the cost, and which numbers do nothing there."""
            try:
                end = least_squares(
                    error,
                    start,
                    jac="2-point" if self.difference else slopes,
                    bounds=(low, high),
                    x_scale="jac",
                    max_nfev=evaluations,
                    ftol=tolerance,
                    xtol=1e-9,
                    gtol=1e-12,
                )
            except (ValueError, np.linalg.LinAlgError):  # a step to the stability limit
                return start, np.inf, np.zeros(start.size, bool)
            return end.x, float(2 * end.cost), np.asarray(~np.asarray(end.jac).any(axis=0))

        start, low, high = inside[moves], lower[moves], upper[moves]
        reached, least, idle = found(start, low, high)
        # A number that ran off to where nothing depends on it, as a state beyond a stop, comes back to the edge.
        lost = idle & ~np.isclose(reached, start)
        if lost.any() and not idle.all():
            inner, outer = _edge(slopes, lost, start, reached)
            low, high = np.where(outer < inner, outer, low), np.where(outer > inner, outer, high)
            again, other, _ = found(inner, low, high)
            reached, least = (again, other) if other < least * (1 + tolerance) else (reached, least)
        return (whole(reached), least) if least <= cost else (inside, cost)

    def result(self, vector: Array, cost: float) -> Fit:
        """Return the fit at a vector; experiments without fitted samples get the best initial states."""
        vector = self._begun(vector)
        model = self.model.with_values(self._values(vector))
        return Fit(model, tuple(self.initial(vector)), tuple(self.simulate(vector)), cost, self.n_free)

    def _begun(self, vector: Array) -> Array:
        """Fit the initial states of each experiment without fitted samples to its first samples."""
        if not self.frees_initial:
            return vector
        vector, count, width = vector.copy(), len(self.run.parameters), len(self.begun)
        for e, used in enumerate(self.used):
            if used.any() or not width:
                continue
            run = self.data.experiments[e]
            first = np.arange(run.n_samples) < _BEGINNING * width
            alone = replace(self.data, experiments=(run,), resampling=())
            problem = Fitting(self.model, alone, [first], [self.initial(vector)[e]])
            found, cost = problem.solve(problem.start(self._values(vector)), held=self.run.parameters)
            if np.isfinite(cost):
                vector[count + e * width : count + (e + 1) * width] = found[count:]
        return vector


def _edge(slopes: Callable[[Array], Array], lost: Mask, start: Array, reached: Array) -> tuple[Array, Array]:
    """Return points on both sides of the edge beyond which nothing depends on the lost numbers, by bisection."""
    inner, outer = np.where(lost, start, reached), reached
    for _ in range(_HALVINGS):
        middle = (inner + outer) / 2
        alive = lost & slopes(middle).any(axis=0)
        inner, outer = np.where(alive, middle, inner), np.where(alive, outer, middle)
    return inner, outer


def _chosen(mask: Mask) -> Index | slice:
    """Return where a mask holds; a slice, which copies nothing, where that is one stretch."""
    places = np.flatnonzero(mask)
    if places.size and places[-1] - places[0] == places.size - 1:
        return slice(int(places[0]), int(places[-1]) + 1)
    return places


def _is_stop(expression: sympy.Expr) -> bool:
    """Return whether a line has numeric limits and no parameters."""
    limited = isinstance(expression, sympy.Max | sympy.Min) and any(a.is_number for a in expression.args)
    return limited and not plain_symbols(expression)


def _steps_by_itself(line: Line) -> bool:
    """Return whether a line makes a step where its own past crosses a threshold."""
    steps = (part for part in distinct_parts(line.expression) if isinstance(part, sympy.sign))
    return any(line.signal in {name for name, _ in references(step.args[0])} for step in steps)
