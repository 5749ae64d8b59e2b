"""Transfer function and back couplings that a network must learn, for a linear plant and a linear model.

    series    H_NN = H_P / H_M          parallel    H_NN = H_P - H_M

The input is held between samples, so plant and model have the step-invariant z-transforms

    H(z) = (1 - z^-1) Z{H(s) / s},      A / (s - p)^m  ->  A / (m - 1)!  d^(m-1)/dp^(m-1)  1 / (1 - e^(pT) z^-1)

With q = 1/z and common factors cancelled, H_NN is ``(b_0 + b_1 q + ...) / (1 + a_1 q + ...)``. The degree of the
numerator is the number of past inputs that the network needs. The degree of the denominator is the number of past
outputs. More neurons do not replace a missing past sample.

The thesis uses the impulse-invariant transform (6.2). It gives another gain and, in parallel, one past input less.

Reference: hybrid thesis, section 6.2.2, (6.1)-(6.5), appendices B and D.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import sympy
from numpy.typing import ArrayLike
from sympy.solvers.solveset import NonlinearError

from relaxations.algebra.arrays import Array
from smid.display.result import Part, Result
from smid.hybrid.back_couplings import BackCouplings
from smid.hybrid.hybrid_model import HYBRID, HybridModel
from smid.hybrid.topology import topology_named
from smid.models import Model, ModelError, simulate
from smid.models.linear_block import DELAY, RATE, exact_values, response

__all__ = ["Requirement", "learned_response", "network_alone", "pulse_transfer", "required", "transfer"]

_S, _Q, _MOVING = RATE, DELAY, sympy.Symbol("e")


@dataclass(frozen=True, repr=False)
class Requirement(Result):
    """Transfer function and back couplings that a network must learn.

    Parameters
    ----------
    topology
        "series" or "parallel".
    transfer
        H_NN(s).
    pulse
        H_NN of the samples, in ``q = 1/z``.
    sampling_time
        In seconds.
    """

    topology: str
    transfer: sympy.Expr
    pulse: sympy.Expr
    couplings: BackCouplings
    sampling_time: float

    def step_response(self, count: int, amplitude: float = 1.0) -> Array:
        """Return the response to a step at time zero from rest, shape (count,).

        The first sample is taken just after the step.
        """
        time = sympy.Symbol("time", nonnegative=True)
        total = sympy.Integer(0)
        for residue, pole, order in _partial_fractions(self.transfer / _S):
            total += residue * time ** (order - 1) / sympy.factorial(order - 1) * sympy.exp(pole * time)
        function = sympy.lambdify(time, sympy.re(sympy.N(total)), "numpy")
        times = self.sampling_time * np.arange(count)
        return np.asarray(amplitude * np.broadcast_to(function(times), times.shape), dtype=np.float64)

    def _content(self) -> Iterator[Part]:
        yield f"{self.topology}: H_NN(s) = {self.transfer}, H_NN(q) = {self.pulse}; the network needs {self.couplings}"


def transfer(model: Model) -> sympy.Expr:
    """Return the transfer function of a linear continuous-time model, in ``s``.

    Parameters
    ----------
    model
        With one input and one output. Fixed parameters and parameters with a value are inserted as numbers.

    Raises
    ------
    ModelError
        If the model is not linear, not continuous, or has several inputs or outputs.

    Examples
    --------
    >>> from smid.models import Reactor
    >>> transfer(Reactor(2.0))
    19/(25*(2*s + 1))
    """
    if not model.continuous:
        raise ModelError(f"{model.name!r} is a discrete-time model: it only has a pulse transfer function")
    return sympy.factor(_solved(model))


def pulse_transfer(model: Model, sampling_time: float) -> sympy.Expr:
    """Return the transfer function of a linear model's samples, with the input held between samples.

    The result is in ``q = 1/z``. It is exact and does not depend on the model's integration scheme.

    Parameters
    ----------
    model
        With one input and one output, in continuous or discrete time.
    sampling_time
        In seconds.

    Raises
    ------
    ModelError
        If the model is not linear, or has several inputs or outputs.

    Examples
    --------
    >>> from smid.models import OutputError, Reactor
    >>> pulse_transfer(Reactor(2.0), 2.0)
    19*q*(-1 + exp(-1))/(25*(q*exp(-1) - 1))
    >>> pulse_transfer(OutputError().with_values({"a1": -0.5, "b0": 1}), 1.0)
    -2*q/(q - 2)
    """
    exponentials: dict[sympy.Expr, sympy.Symbol] = {}
    return _spelled(_pulse(model, sampling_time, exponentials), exponentials)


def required(plant: Model, white: Model, topology: str, sampling_time: float) -> Requirement:
    """Return what a network must learn so that first-principles model and network together equal the plant.

    Parameters
    ----------
    plant, white
        Plant and first-principles model: linear, continuous, with one input and one output.
    topology
        "series" or "parallel".
    sampling_time
        In seconds.

    Raises
    ------
    ModelError
        If a model is not linear, the topology is unknown, or the network would need future samples.

    Examples
    --------
    >>> from smid.models import Reactor
    >>> found = required(Reactor(2.0), Reactor(4.0), "series", 1.0)
    >>> found.transfer, found.couplings
    (19*(4*s + 1)/(13*(2*s + 1)), BackCouplings(inputs=1, outputs=1))
    >>> required(Reactor(2.0), Reactor(4.0), "parallel", 1.0).couplings
    BackCouplings(inputs=2, outputs=2)
    """
    learned = topology_named(topology).learned
    laplace = [transfer(model) for model in (plant, white)]
    # A pole of both models gets the same symbol, so it cancels.
    exponentials: dict[sympy.Expr, sympy.Symbol] = {}
    of_plant, of_white = (_pulse(model, sampling_time, exponentials) for model in (plant, white))
    pulse = sympy.cancel(learned(of_plant, of_white))
    # A denominator that is zero at q = 0 means a negative delay.
    numerator, denominator = (sympy.Poly(part, _Q) for part in sympy.fraction(pulse))
    if denominator.eval(0) == 0:
        raise ModelError(
            f"{white.name!r} has a longer delay than {plant.name!r}, so a network in series would need future samples: "
            "use the parallel topology"
        )
    return Requirement(
        topology,
        sympy.factor(learned(*laplace)),
        _spelled(pulse, exponentials),
        BackCouplings(int(max(numerator.degree(), 0)), int(denominator.degree())),
        sampling_time,
    )


def network_alone(hybrid: HybridModel) -> Model:
    """Return the network of a hybrid model as a model of its own.

    In series, its input is the first-principles output. In parallel, its inputs are the plant's input and the
    first-principles output, which should be zero.

    Parameters
    ----------
    hybrid
        In series or in parallel, with estimated weights.

    Raises
    ------
    ModelError
        If the topology is neither series nor parallel.

    Examples
    --------
    >>> from dataclasses import replace
    >>> from smid.hybrid import BackCouplings, parallel
    >>> from smid.models import Reactor
    >>> hybrid = parallel(Reactor(2.0, sampling_time=1.0), BackCouplings(1, 1), hidden=(1,))
    >>> weights = {parameter.name: 0.1 for parameter in hybrid.term.parameters}
    >>> network_alone(replace(hybrid, model=hybrid.model.with_values(weights))).output_channels
    ('y',)
    """
    topology_named(hybrid.topology)
    line = next(line for line in hybrid.model.lines if line.signal == HYBRID)
    names = {parameter.name for parameter in hybrid.term.parameters}
    return Model(
        f"network in {hybrid.topology}",
        hybrid.term.parameters,
        (line,),
        tuple(item for item in hybrid.model.measurements if item.signal == HYBRID),
        values={name: value for name, value in hybrid.model.values.items() if name in names},
    )


def learned_response(hybrid: HybridModel, first: ArrayLike, count: int, amplitude: float) -> Array:
    """Return the response of the network alone to a constant input, shape (count,).

    Parameters
    ----------
    hybrid
        In series or in parallel, with estimated weights.
    first
        First outputs, as many as the network has past outputs.
    amplitude
        Value of the constant input.

    Raises
    ------
    ModelError
        If the topology is neither series nor parallel, or the response diverges.

    Examples
    --------
    >>> from dataclasses import replace
    >>> from smid.hybrid import BackCouplings, parallel
    >>> from smid.models import Reactor
    >>> hybrid = parallel(Reactor(2.0, sampling_time=1.0), BackCouplings(1, 1), hidden=(1,))
    >>> weights = {parameter.name: 0.1 for parameter in hybrid.term.parameters}
    >>> hybrid = replace(hybrid, model=hybrid.model.with_values(weights))
    >>> learned_response(hybrid, [0.0], count=3, amplitude=1.0).shape
    (3,)
    """
    alone = network_alone(hybrid)
    constant = np.full(count, amplitude)
    shown = hybrid.white.outputs[0].signal
    beside = np.full(count, topology_named(hybrid.topology).white_output(amplitude))
    inputs = {name: beside if name == shown else constant for name in alone.inputs}
    start = np.asarray(first, dtype=np.float64)[: alone.max_lag]
    return simulate(alone, inputs, initial={HYBRID: start}, n=count)[HYBRID]


def _solved(model: Model) -> sympy.Expr:
    """Solve the lines for output over input: a derivative is a factor s, a delay a power of q."""
    outputs = [item.signal for item in model.outputs]
    if len(model.inputs) != 1 or len(outputs) != 1:
        raise ModelError(
            f"{model.name!r} has inputs {model.inputs} and outputs {tuple(outputs)}: "
            "a transfer function needs one of each"
        )
    values = {p.name: p.lower for p in model.parameters if p.lower == p.upper} | dict(model.values)
    for line in model.lines if model.continuous else ():
        if any(lag for _, lag in line.reads):
            raise ModelError(f"the line of {line.signal!r} reads past samples: use derivatives only")
    try:
        return response(model.lines, model.inputs[0], outputs[0], exact_values(values))[0]
    except NonlinearError:
        raise ModelError(f"{model.name!r} is not linear: it has no transfer function") from None


def _exact(value: float) -> sympy.Rational:
    return sympy.Rational(repr(float(value)))


def _pulse(model: Model, sampling_time: float, exponentials: dict[sympy.Expr, sympy.Symbol]) -> sympy.Expr:
    """Return the transfer function in q, with a symbol for each ``e^(pT)``."""
    if not model.continuous:
        return _solved(model)
    total = sympy.Integer(0)
    for residue, pole, order in _partial_fractions(_solved(model) / _S):
        growth = (
            sympy.Integer(1)
            if pole == 0
            else exponentials.setdefault(sympy.exp(pole * _exact(sampling_time)), sympy.Dummy(f"e{len(exponentials)}"))
        )
        # Only e^(pT) depends on p, so d/dp = T e^(pT) d/d e^(pT).
        term = 1 / (1 - _MOVING * _Q)
        for _ in range(order - 1):
            term = _exact(sampling_time) * _MOVING * sympy.diff(term, _MOVING)
        total += residue * term.xreplace({_MOVING: growth}) / sympy.factorial(order - 1)
    return sympy.cancel((1 - _Q) * total)


def _partial_fractions(function: sympy.Expr) -> list[tuple[sympy.Expr, sympy.Expr, int]]:
    """Return residue, pole and order of each partial fraction of a proper fraction in s."""
    numerator, denominator = sympy.fraction(sympy.cancel(function))
    polynomial = sympy.Poly(denominator, _S)
    poles = sympy.roots(polynomial)
    if sum(poles.values()) < polynomial.degree():  # no closed form: numerical roots
        poles = dict.fromkeys(polynomial.nroots(), 1)
    parts = []
    for pole, multiplicity in poles.items():
        rest = polynomial.LC() * sympy.Mul(*((_S - p) ** m for p, m in poles.items() if p != pole))
        smooth = numerator / rest
        for order in range(multiplicity, 0, -1):
            parts.append((sympy.simplify(smooth.subs(_S, pole)) / sympy.factorial(multiplicity - order), pole, order))
            smooth = sympy.diff(smooth, _S)
    return parts


def _spelled(pulse: sympy.Expr, exponentials: dict[sympy.Expr, sympy.Symbol]) -> sympy.Expr:
    return sympy.factor(pulse).xreplace({symbol: exponential for exponential, symbol in exponentials.items()})
