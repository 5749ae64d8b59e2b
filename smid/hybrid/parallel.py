"""Parallel topology: the network adds a correction to the first-principles output.

    hybrid[t] = w[t] + NN(u[t], u[t-1], ..., d[t-1], ...),    d = hybrid - w

The network learns the transfer function ``H_P - H_M``. Its past outputs are the differences d, not a separate signal.
So a predictor reads the measured output minus the model's output, as in listing K.7.

Reference: hybrid thesis, section 4.3.2, figure 4.8, listing K.7, appendix D.
"""

from __future__ import annotations

import sympy

from smid.hybrid.back_couplings import BackCouplings
from smid.hybrid.hybrid_model import (
    HybridModel,
    Placed,
    hybrid_name,
    joined,
    measure_instead,
    output_measurement,
    whole,
)
from smid.hybrid.neural import NeuralTerm
from smid.hybrid.topology import Topology
from smid.models import Model, signal, t

__all__ = ["Parallel", "parallel"]


class Parallel(Topology):
    """Topology with the network beside the first-principles model."""

    name = "parallel"

    @staticmethod
    def learned(plant: sympy.Expr, white: sympy.Expr) -> sympy.Expr:
        """Return the difference of the transfer functions."""
        return plant - white

    @staticmethod
    def white_output(amplitude: float) -> float:  # noqa: ARG004
        """Return zero: the first-principles model adds nothing."""
        return 0.0


def parallel(
    white: Model | HybridModel,
    couplings: BackCouplings,
    hidden: tuple[int, ...] = (2,),
    *,
    output: str | None = None,
    name: str = "N",
    neuron: str = "tanh",
) -> HybridModel:
    """Return a hybrid model with a network beside a first-principles model.

    The parameters are those of `series`.

    Raises
    ------
    ModelError
        If the output is unknown, or a name is already used.

    Examples
    --------
    >>> from smid.hybrid.back_couplings import SIMPLE
    >>> from smid.models import Reactor
    >>> parallel(Reactor(2.0), SIMPLE, ()).model.lines[-1].expression
    N_b1_1 + N_w1_1_1*u[t] + N_w1_1_2*(hybrid[t - 1] - w[t - 1]) + w[t]
    """
    before = whole(white)
    shown, result = output_measurement(before, output), hybrid_name(before)
    w, hybrid = signal(shown.signal)[t], signal(result)[t]
    term = NeuralTerm(
        name, couplings.samples([signal(item) for item in before.inputs], hybrid - w), hidden, neuron=neuron
    )
    model = measure_instead(before.with_line(result, w + term.expression, term.parameters), shown, result)
    return joined(white, model, Placed(term, Parallel.name, couplings))
