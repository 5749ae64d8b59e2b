"""Parallel: the network adds to the output what first principles leave over.

    hybrid[t] = w[t] + NN(u[t], u[t-1], ..., d[t-1], ...),    d = hybrid - w

In terms of transfer functions the network has to learn ``H_P - H_M``.  Its past outputs stand as differences, not as a
signal of their own, so that a predictor reads the measured output less the model's, as in listing K.7.

Reference: hybrid thesis, section 4.3.2, figure 4.8, listing K.7, appendix D.
"""

from __future__ import annotations

import sympy

from smid.hybrid.back_couplings import BackCouplings
from smid.hybrid.hybrid_model import HYBRID, HybridModel, measure_instead, output_measurement
from smid.hybrid.neural import NeuralTerm
from smid.hybrid.topology import Topology
from smid.models import Model, signal, t

__all__ = ["Parallel", "parallel"]


class Parallel(Topology):
    """The network beside the first principles."""

    name = "parallel"

    @staticmethod
    def learned(plant: sympy.Expr, white: sympy.Expr) -> sympy.Expr:
        """Return the difference."""
        return plant - white

    @staticmethod
    def white_output(amplitude: float) -> float:  # noqa: ARG004
        """Return zero: the first principles add nothing."""
        return 0.0


def parallel(
    white: Model,
    couplings: BackCouplings,
    hidden: tuple[int, ...] = (2,),
    *,
    output: str | None = None,
    name: str = "N",
) -> HybridModel:
    """Put a network beside a first-principles model.

    Parameters
    ----------
    white
        First principles; parameters whose box is a point stay as they are, others are estimated with the weights.
    couplings
        Of the network.
    hidden
        Neurons of each hidden layer; none makes the network affine.
    output
        Channel to complete, where there are several.
    name
        Prefix of the weights' names.

    Raises
    ------
    ModelError
        If the output is not known, or a name is taken.

    Examples
    --------
    >>> from smid.hybrid.back_couplings import SIMPLE
    >>> from smid.models import Reactor
    >>> parallel(Reactor(2.0), SIMPLE, ()).model.lines[-1].expression
    N_b1_1 + N_w1_1_1*u[t] + N_w1_1_2*(hybrid[t - 1] - w[t - 1]) + w[t]
    """
    shown = output_measurement(white, output)
    w, hybrid = signal(shown.signal)[t], signal(HYBRID)[t]
    term = NeuralTerm(name, couplings.samples([signal(item) for item in white.inputs], hybrid - w), hidden)
    model = measure_instead(white.with_line(HYBRID, w + term.expression, term.parameters), shown, HYBRID)
    return HybridModel(model, term, white, Parallel.name, couplings)
