"""What the network has to learn, for a linear plant and a linear model: its transfer function and its back couplings.

    series    H_NN = H_P / H_M          parallel    H_NN = H_P - H_M

The input is held from sample to sample, so the samples of plant and model obey the step-invariant z-transforms

    H(z) = (1 - z^-1) Z{H(s) / s},      A / (s - p)^m  ->  A / (m - 1)!  d^(m-1)/dp^(m-1)  1 / (1 - e^(pT) z^-1)

and with q = 1/z their quotient or difference is ``(b_0 + b_1 q + ...) / (1 + a_1 q + ...)`` after cancelling.  The
degree of the numerator is the number of past inputs that the network needs, that of the denominator the number of past
outputs.  Signals whose past two samples are needed cannot be replaced by one, whatever the number of neurons.

The thesis takes (6.2), which samples the impulse response instead of the step response.  That counts one past input
less in parallel, for it lets the present input act at once, and it gives H_NN another gain.

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
from smid.models.symbols import references

__all__ = ["Requirement", "learned_response", "network_alone", "pulse_transfer", "required", "transfer"]

_S, _Q, _MOVING = RATE, DELAY, sympy.Symbol("e")


@dataclass(frozen=True, repr=False)
class Requirement(Result):
    """What a network has to learn.

    Parameters
    ----------
    topology
        One of {"series", "parallel"}.
    transfer
        H_NN in the Laplace variable s.
    pulse
        H_NN in ``q = 1/z``, of the samples.
    couplings
        How many past samples it needs.
    sampling_time
        In seconds.
    """

    topology: str
    transfer: sympy.Expr
    pulse: sympy.Expr
    couplings: BackCouplings
    sampling_time: float

    def step_response(self, count: int, amplitude: float = 1.0) -> Array:
        """Sample the response to a step at time zero, from rest.

        Parameters
        ----------
        count
            Number of samples; the first is that just after the step.
        amplitude
            Of the step.

        Returns
        -------
        ndarray, shape (count,)
        """
        time = sympy.Symbol("time", nonnegative=True)
        total = sympy.Integer(0)
        for residue, pole, order in _partial_fractions(self.transfer / _S):
            total += residue * time ** (order - 1) / sympy.factorial(order - 1) * sympy.exp(pole * time)
        function = sympy.lambdify(time, sympy.re(sympy.N(total)), "numpy")
        times = self.sampling_time * np.arange(count)
        return np.asarray(amplitude * np.broadcast_to(function(times), times.shape), dtype=np.float64)

    def _content(self) -> Iterator[Part]:
        yield f"{self.topology}: H_NN(s) = {self.transfer}, H_NN(q) = {self.pulse}; needs {self.couplings}"


def transfer(model: Model) -> sympy.Expr:
    """Find the transfer function of a linear model in derivatives, from its input to its output.

    Parameters
    ----------
    model
        With one input and one output; parameters that are fixed or carry a value count as numbers.

    Returns
    -------
    sympy.Expr
        In ``s``.

    Raises
    ------
    ModelError
        If the model is not linear, not in derivatives, or has several inputs or outputs.

    Examples
    --------
    >>> from smid.models import Reactor
    >>> transfer(Reactor(2.0))
    19/(25*(2*s + 1))
    """
    if not model.continuous:
        raise ModelError(f"{model.name!r} is a model in samples: it has a pulse transfer function only")
    return sympy.factor(_solved(model))


def pulse_transfer(model: Model, sampling_time: float) -> sympy.Expr:
    """Find the transfer function of a linear model's samples, the input held between them.

    Parameters
    ----------
    model
        With one input and one output, in derivatives or in samples.
    sampling_time
        In seconds.

    Returns
    -------
    sympy.Expr
        In ``q = 1/z``; exact, whatever scheme of integration the model has.

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
    """Find what a network has to learn so that a first-principles model becomes the plant.

    Parameters
    ----------
    plant, white
        Linear, in derivatives, with one input and one output.
    topology
        One of {"series", "parallel"}.
    sampling_time
        In seconds.

    Raises
    ------
    ModelError
        If one is not linear, the topology unknown, or the network would have to read the future.

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
    # The same pole of both is the same symbol, so that it cancels.
    exponentials: dict[sympy.Expr, sympy.Symbol] = {}
    of_plant, of_white = (_pulse(model, sampling_time, exponentials) for model in (plant, white))
    pulse = sympy.cancel(learned(of_plant, of_white))
    numerator, denominator = (sympy.Poly(part, _Q) for part in sympy.fraction(pulse))
    if denominator.eval(0) == 0:
        raise ModelError(
            f"{white.name!r} is later than {plant.name!r}: after it a network would have to read the future, "
            "put it in parallel"
        )
    return Requirement(
        topology,
        sympy.factor(learned(*laplace)),
        _spelled(pulse, exponentials),
        BackCouplings(int(max(numerator.degree(), 0)), int(denominator.degree())),
        sampling_time,
    )


def network_alone(hybrid: HybridModel) -> Model:
    """Take the network out of a hybrid model, to run it on a signal of one's own.

    Parameters
    ----------
    hybrid
        In series or in parallel, with estimated weights.

    Returns
    -------
    Model
        Its inputs are the first principles' signals: in series what it reads, in parallel zero, beside what it reads.

    Raises
    ------
    ModelError
        If the network stands elsewhere.

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
    """Run the network alone on a constant signal.

    Parameters
    ----------
    hybrid
        In series or in parallel, with estimated weights.
    first
        Its first outputs, as many as it looks back.
    count
        Number of samples.
    amplitude
        The constant that it reads.

    Returns
    -------
    ndarray, shape (count,)

    Raises
    ------
    ModelError
        If the network stands elsewhere, or leaves the finite range.

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
    shown = next(item.signal for item in hybrid.white.measurements if item.channel in hybrid.white.output_channels)
    beside = np.full(count, topology_named(hybrid.topology).white_output(amplitude))
    inputs = {name: beside if name == shown else constant for name in alone.inputs}
    start = np.asarray(first, dtype=np.float64)[: alone.max_lag]
    return simulate(alone, inputs, initial={HYBRID: start}, n=count)[HYBRID]


def _solved(model: Model) -> sympy.Expr:
    """Solve the lines for output over input, a rate being s times its signal and a delay a power of q."""
    outputs = [item.signal for item in model.measurements if item.channel in model.output_channels]
    if len(model.inputs) != 1 or len(outputs) != 1:
        raise ModelError(
            f"{model.name!r} has inputs {model.inputs} and outputs {tuple(outputs)}: "
            "a transfer function needs one of each"
        )
    values = {p.name: p.lower for p in model.parameters if p.lower == p.upper} | dict(model.values)
    for line in model.lines if model.continuous else ():
        if any(lag for _, lag in references(line.expression)):
            raise ModelError(f"the line of {line.signal!r} reads past samples: write the model in derivatives alone")
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
        # d/dp acts on e^(pT) alone, where it is T e^(pT) d/d e^(pT).
        term = 1 / (1 - _MOVING * _Q)
        for _ in range(order - 1):
            term = _exact(sampling_time) * _MOVING * sympy.diff(term, _MOVING)
        total += residue * term.xreplace({_MOVING: growth}) / sympy.factorial(order - 1)
    return sympy.cancel((1 - _Q) * total)


def _partial_fractions(function: sympy.Expr) -> list[tuple[sympy.Expr, sympy.Expr, int]]:
    """Split a proper fraction in s: residue, pole and order of each part."""
    numerator, denominator = sympy.fraction(sympy.cancel(function))
    polynomial = sympy.Poly(denominator, _S)
    poles = sympy.roots(polynomial)
    if sum(poles.values()) < polynomial.degree():  # no closed form
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
