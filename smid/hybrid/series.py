"""Series topology: the network reads the first-principles output and gives the hybrid output.

    hybrid[t] = NN(w[t], w[t-1], ..., hybrid[t-1], ...)

w is the first-principles output, always in a free run. The network learns the transfer function ``H_P / H_M``: the
inverse of the model times the plant.

Reference: hybrid thesis, section 4.3.1, figure 4.6, listings K.4 and K.6, appendix B.
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

__all__ = ["Series", "series"]


class Series(Topology):
    """Topology with the network after the first-principles model."""

    name = "series"

    @staticmethod
    def learned(plant: sympy.Expr, white: sympy.Expr) -> sympy.Expr:
        """Return the quotient of the transfer functions."""
        return plant / white


def series(
    white: Model | HybridModel,
    couplings: BackCouplings,
    hidden: tuple[int, ...] = (3,),
    *,
    output: str | None = None,
    name: str = "N",
    neuron: str = "tanh",
) -> HybridModel:
    """Return a hybrid model with a network after a first-principles model.

    Parameters
    ----------
    white
        First-principles model, or a hybrid model that gets one more network. Parameters with lower < upper are
        estimated together with the weights.
    couplings
        Back couplings of the network.
    hidden
        Neurons of each hidden layer; with no layer the network is affine.
    output
        Channel to correct; needed if there are several.
    name
        Prefix of the weights' names.
    neuron
        "tanh", "logistic" or "radial".

    Raises
    ------
    ModelError
        If the output is unknown, or a name is already used.

    Examples
    --------
    >>> from smid.hybrid.back_couplings import SIMPLE
    >>> from smid.models import Reactor
    >>> series(Reactor(2.0), SIMPLE, ()).model.lines[-1].expression
    N_b1_1 + N_w1_1_1*w[t] + N_w1_1_2*hybrid[t - 1]
    """
    before = whole(white)
    shown, result = output_measurement(before, output), hybrid_name(before)
    term = NeuralTerm(name, couplings.samples([signal(shown.signal)], signal(result)[t]), hidden, neuron=neuron)
    model = measure_instead(before.with_line(result, term.expression, term.parameters), shown, result)
    return joined(white, model, Placed(term, Series.name, couplings))
