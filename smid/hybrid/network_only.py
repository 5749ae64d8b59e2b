"""Network alone: the baseline without first principles, one network for each output.

    y[t] = NN(u[t], u[t-1], ..., y[t-1], y[t-2], ...)

Each network reads all inputs and the past of its own output. What a hybrid model gains over this baseline is what the
first principles are worth.

Reference: hybrid thesis, section 6.2.3, observation (d).
"""

from __future__ import annotations

from dataclasses import replace

import sympy

from smid.hybrid.back_couplings import EXTRA, BackCouplings
from smid.hybrid.hybrid_model import HYBRID, HybridModel, Placed, hybrid_name
from smid.hybrid.neural import NeuralTerm
from smid.hybrid.topology import Topology
from smid.models import Line, Model, signal, t

__all__ = ["NetworkOnly", "network_only"]


class NetworkOnly(Topology):
    """Topology without first principles."""

    name = "network only"

    @staticmethod
    def learned(plant: sympy.Expr, white: sympy.Expr) -> sympy.Expr:  # noqa: ARG004
        """Return the transfer function of the plant."""
        return plant


def network_only(
    white: Model, couplings: BackCouplings = EXTRA, hidden: tuple[int, ...] = (3,), *, neuron: str = "tanh"
) -> HybridModel:
    """Return networks in the place of a model, with its inputs and outputs.

    Parameters
    ----------
    white
        Gives inputs and outputs.

    Examples
    --------
    >>> from smid.models import Reactor
    >>> network_only(Reactor(2.0), hidden=()).model.lines[0].expression
    N_b1_1 + N_w1_1_1*u[t] + N_w1_1_2*u[t - 1] + N_w1_1_3*hybrid[t - 1]
    """
    bare = Model(f"network in place of {white.name}", (), (), ())
    networks = []
    for number, shown in enumerate(white.outputs, start=1):
        result = HYBRID if number == 1 else hybrid_name(bare)
        term = NeuralTerm(
            "N" if len(white.outputs) == 1 else f"N{number}",
            couplings.samples([signal(item) for item in white.inputs], signal(result)[t]),
            hidden,
            neuron=neuron,
        )
        bare = replace(
            bare,
            parameters=(*bare.parameters, *term.parameters),
            lines=(*bare.lines, Line(signal(result)[t], term.expression)),
            measurements=(*bare.measurements, replace(shown, signal=result)),
        )
        networks.append(Placed(term, NetworkOnly.name, couplings))
    return HybridModel(bare, white, tuple(networks))
