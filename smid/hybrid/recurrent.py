"""Recurrent network: single neurons are fed back, each to all of them.

    a_i[t] = neuron(w_i u[t] + sum_j r_ij a_j[t-1] + b_i),    y[t] = sum_i v_i a_i[t] + c

The neurons are the states, so the output need not be fed back. Their weights start at random; the output's start at
zero.

References: clutch thesis, section 4.4.3 and figure 4.11; Elman, "Finding structure in time", Cognitive Science 14
(1990).
"""

from __future__ import annotations

from dataclasses import replace

import sympy

from smid.hybrid.back_couplings import STATIC, BackCouplings
from smid.hybrid.hybrid_model import HYBRID, HybridModel, Placed
from smid.hybrid.neural import NeuralTerm
from smid.hybrid.neurons import NEURONS, RECURRENT
from smid.models import Line, Model, ModelError, signal, t

__all__ = ["recurrent"]


def recurrent(white: Model, neurons: int = 3, *, neuron: str = "tanh") -> HybridModel:
    """Return a recurrent network in the place of a model, with its inputs and its output.

    Parameters
    ----------
    white
        Gives inputs and the output.
    neuron
        A kind that reads a weighted sum, such as "tanh".

    Raises
    ------
    ModelError
        If there is no neuron, the kind is unknown or radial, or the model has several outputs.

    Examples
    --------
    >>> from smid.models import Reactor
    >>> recurrent(Reactor(2.0), 1).model.lines[0].expression
    tanh(N1_b1_1 + N1_w1_1_1*u[t] + N1_w1_1_2*neuron1[t - 1])
    """
    if neurons < 1 or neuron == "radial" or len(white.outputs) != 1:
        raise ModelError(
            f"{neurons} {neuron} neurons for the outputs {', '.join(white.output_channels)}: give one or more neurons "
            "of a kind that reads a weighted sum, and a model with one output"
        )
    states = [signal(f"neuron{k}") for k in range(1, neurons + 1)]
    read = (*(signal(item)[t] for item in white.inputs), *(state[t - 1] for state in states))
    terms = [NeuralTerm(f"N{k}", read, (), neuron=neuron) for k in range(1, neurons + 1)]
    out = NeuralTerm("N", tuple(state[t] for state in states), ())
    kind, one, none = NEURONS[neuron].output, sympy.Integer(1), sympy.Integer(0)
    lines = [Line(state[t], kind([one], none, [term.expression])) for state, term in zip(states, terms, strict=True)]
    model = Model(
        f"recurrent network in place of {white.name}",
        tuple(parameter for term in (*terms, out) for parameter in term.parameters),
        (*lines, Line(signal(HYBRID)[t], out.expression)),
        (replace(white.outputs[0], signal=HYBRID),),
    )
    placed = [Placed(term, RECURRENT, BackCouplings(0, 1)) for term in terms]
    return HybridModel(model, white, (*placed, Placed(out, "network only", STATIC)))
