"""The error of a PTX as a least-squares problem, with analytic sensitivities.

    theta = (log tau_s, log tau_0, c_3 R, c_1 R, c_2 R / S, those of the effects, log r_k, log w_k, weights)

R and S are half the ranges of temperature and pressure. Without a temperature all parameters that go with it have no
effect and stay 0. The logarithms keep time constants, thresholds and forces positive, so that friction opposes motion
and two plays cannot cancel each other.

The dynamic part is differentiated forward (`dual`), the network backward; the lag and the backlash behind it act on the
whole Jacobian. A play is not differentiable at the samples where a contact begins.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from relaxations.algebra.arrays import Array
from smid.networks import NormalEquations, Scaling, TanhNetwork, fold, sum_normal_equations
from smid.sensors.dual import Dual, parameters
from smid.sensors.flow import FlowLaw
from smid.sensors.ptx_dynamics import Dynamics, LevelLaw, RateLaw

__all__ = ["SCHEDULED", "STARTS", "PTXError", "Record"]

T = TypeVar("T")

SCHEDULED = 5  # parameters before those of effects and plays
STARTS = {
    "temperature": (0.0,),  # c_4 R
    "level": (0.0,),  # c_5 S
    "rate": (0.0, -2.0, 0.0),  # c_6, log(d_0 / S), log(tau_r / 20 T_s)
    "flow": (0.0, 0.0, 0.0, 0.0, -1.0),  # log(tau / T_s), cooling R, curvature R^2, stiffening S, log(growth S / T_s)
    "backlash": (-4.0,),  # log of the slack, of half the range of the position
}
"""Parameters of each effect where it begins to be trained."""
RATE_SAMPLES = 20.0


def _exp(value: float) -> float:
    return float(np.exp(value))


def _log(value: float) -> float:
    return float(np.log(value))


@dataclass(frozen=True, eq=False)
class Record:
    """A record for training.

    Parameters
    ----------
    pressure, temperature
        Shape (n,). In bar and degC.
    target
        Shape (n,). Scaled position.
    rows
        Numbers of the samples that count.
    """

    pressure: Array
    temperature: Array
    target: Array
    rows: NDArray[np.intp]


@dataclass(frozen=True, eq=False)
class PTXError:
    """The error of a PTX on chosen samples of records, as a least-squares problem.

    Parameters
    ----------
    sizes
        Of the network.
    plays
        Number of play operators.
    scaling
        Of the pressure.
    reference, warmth
        Centre and half the range of the temperature.
    sampling_time
        In seconds.
    effects
        Among `EFFECTS`, in their order.
    """

    sizes: tuple[int, ...]
    plays: int
    records: tuple[Record, ...]
    scaling: Scaling
    reference: float
    warmth: float
    sampling_time: float
    effects: tuple[str, ...] = ()

    def _parts(self, theta: Sequence[T]) -> tuple[dict[str, Sequence[T]], Sequence[T], Sequence[T]]:
        """Return the parameters of each effect, of the thresholds and of the forces."""
        begin = SCHEDULED
        found: dict[str, Sequence[T]] = {}
        for effect in self.effects:
            found[effect] = theta[begin : begin + len(STARTS[effect])]
            begin += len(STARTS[effect])
        return found, theta[begin : begin + self.plays], theta[begin + self.plays : begin + 2 * self.plays]

    @property
    def n_dynamic(self) -> int:
        """Number of parameters before the weights."""
        return SCHEDULED + sum(len(STARTS[effect]) for effect in self.effects) + 2 * self.plays

    def dynamics(self, theta: Array) -> Dynamics:
        """Return the dynamics of a parameter vector; the backlash is that of scaled positions."""
        unit, centre = float(self.scaling.half_range[0]), float(self.scaling.centre[0])
        values: list[float] = theta[: self.n_dynamic].tolist()
        effects, thresholds, forces = self._parts(values)
        smoothing, lag_0 = np.exp(values[:2]).tolist()
        lag_slope, gain_slope, shift_slope = (v / self.warmth for v in values[2:SCHEDULED])
        made = Dynamics(
            smoothing,
            lag_0,
            lag_slope,
            gain_slope,
            unit * shift_slope,
            tuple(np.exp(thresholds).tolist()),
            tuple(np.exp(forces).tolist()),
            self.reference,
        )
        if "temperature" in effects:
            made = replace(made, friction_slope=effects["temperature"][0] / self.warmth)
        if "level" in effects:
            made = replace(made, level=LevelLaw(effects["level"][0] / unit, centre))
        if "rate" in effects:
            change, scale, lag = effects["rate"]
            made = replace(
                made, rate=RateLaw(change, unit * _exp(scale), RATE_SAMPLES * self.sampling_time * _exp(lag))
            )
        if "flow" in effects:
            lag, cooling, curvature, stiffening, growth = effects["flow"]
            law = FlowLaw(
                self.sampling_time * _exp(lag),
                cooling / self.warmth,
                curvature / self.warmth**2,
                stiffening / unit,
                centre,
                self.sampling_time * _exp(growth) / unit,
            )
            made = replace(made, flow=law)
        return replace(made, backlash=_exp(effects["backlash"][0])) if "backlash" in effects else made

    def theta(self, dynamics: Dynamics, weights: Array) -> Array:
        """Return the parameter vector of dynamics and of the weights of the scaled network.

        An effect that the dynamics lack is at its start.
        """
        unit, interval, level, rate, flow = (
            float(self.scaling.half_range[0]), self.sampling_time, dynamics.level, dynamics.rate, dynamics.flow
        )  # fmt: skip
        known: dict[str, tuple[float, ...]] = dict(STARTS)
        if dynamics.friction_slope is not None:
            known["temperature"] = (dynamics.friction_slope * self.warmth,)
        if level is not None:
            known["level"] = (level.slope * unit,)
        if rate is not None:
            known["rate"] = (
                rate.change, _log(rate.scale / unit), _log(rate.time_constant / (RATE_SAMPLES * interval))
            )  # fmt: skip
        if flow is not None:
            known["flow"] = (
                _log(flow.time_constant / interval), flow.cooling * self.warmth, flow.curvature * self.warmth**2,
                flow.stiffening * unit, _log(flow.growth * unit / interval),
            )  # fmt: skip
        if dynamics.backlash is not None:
            known["backlash"] = (_log(dynamics.backlash),)
        slopes = np.array([dynamics.lag_slope, dynamics.gain_slope, dynamics.shift_slope / unit]) * self.warmth
        return np.concatenate(
            [
                np.log([dynamics.smoothing, dynamics.lag]),
                slopes,
                *(known[effect] for effect in self.effects),
                np.log(dynamics.thresholds),
                np.log(dynamics.forces),
                weights,
            ]
        )

    def network(self, theta: Array) -> TanhNetwork:
        """Return the network, of scaled inputs, of a parameter vector."""
        return TanhNetwork(self.sizes, theta[self.n_dynamic :])

    def error(self, theta: Array) -> float:
        """Return the mean squared error of the samples that count."""
        # After a too long step exponentials overflow: the error is then not finite, and the step is rejected.
        with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
            residuals = [self.positions(theta, record) - record.target for record in self.records]
        counted = np.concatenate([e[record.rows] for e, record in zip(residuals, self.records, strict=True)])
        return float(np.mean(counted**2))

    def positions(self, theta: Array, record: Record) -> Array:
        """Return the scaled positions, shape (n,)."""
        kept = Scaling(np.zeros(1), np.ones(1))
        network = fold(self.network(theta), self.scaling, kept)
        program = self.dynamics(theta).program(network, self.sampling_time, "p", "t")
        signals, _ = program.advance({"p": record.pressure, "t": record.temperature})
        return signals[program.output]

    def normal_equations(self, theta: Array) -> NormalEquations:
        """Return the normal equations of the samples that count."""
        return sum_normal_equations(self._blocks(theta))

    def _blocks(self, theta: Array) -> Iterator[tuple[Array, Array]]:
        for record in self.records:
            position, jacobian = self.sensitivities(theta, record)
            yield (position - record.target)[record.rows], jacobian[record.rows]

    def sensitivities(self, theta: Array, record: Record) -> tuple[Array, Array]:
        """Return the scaled positions, shape (n,), and their derivatives, shape (n, p)."""
        numbers = parameters(theta[: self.n_dynamic])
        effects, thresholds, forces = self._parts(numbers)
        n, interval, unit = record.pressure.size, self.sampling_time, float(self.scaling.half_range[0])
        warmth = (record.temperature - self.reference) / self.warmth
        pressure = Dual((record.pressure - self.scaling.centre[0]) / unit, np.zeros((self.n_dynamic, n)))

        # The dynamic part, in units of half the range of the pressure.
        s = pressure.lagged((-((-numbers[0]).exp() * interval)).exp())
        friction = Dual(np.zeros(n), np.zeros((self.n_dynamic, n)))
        cold = (effects["temperature"][0] * -warmth).exp() if "temperature" in effects else None
        for log_r, log_w in zip(thresholds, forces, strict=True):
            r = log_r.exp()
            slack = (r if cold is None else r * cold) * (1.0 / unit)
            friction = friction + (s - s.pushed(slack)) * (log_w.exp() / r)
        if "level" in effects:
            friction = friction * (effects["level"][0] * s).exp()
        if "rate" in effects:
            change, scale, slow = effects["rate"]
            d = s - s.lagged((-((-slow).exp() * (1.0 / RATE_SAMPLES))).exp())
            fast = (d / scale.exp()).tanh()
            friction = friction * (change * fast * fast).exp()
        middle = float(self.scaling.centre[0]) / unit
        q = (numbers[3] * warmth).exp() * (s - friction + middle) + numbers[4] * warmth - middle
        if "flow" in effects:
            log_tau, cooling, curvature, stiffening, log_growth = effects["flow"]
            q = q.flowed((log_tau - cooling * warmth + curvature * warmth**2).exp(), stiffening, log_growth)

        # The network, then the lag and the backlash, which act on the derivatives by the weights too.
        part = self.network(theta).linearise(q.value[:, None])
        slopes = np.zeros((theta.size, n))
        slopes[: self.n_dynamic] = part.by_inputs[:, 0] * q.slopes
        slopes[self.n_dynamic :] = part.by_weights.T
        late = (-(((-numbers[1]) + numbers[2] * warmth).exp() * interval)).exp()
        poles = np.zeros((theta.size, n))
        poles[: self.n_dynamic] = late.slopes
        x = Dual(part.outputs, slopes).lagged(Dual(late.value, poles))
        if "backlash" in effects:
            gap = effects["backlash"][0].exp()
            x = x.pushed(Dual(gap.value, np.concatenate([gap.slopes, np.zeros((theta.size - self.n_dynamic, 1))])))
        return x.value, x.slopes.T
