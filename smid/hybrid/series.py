"""Series: the network reads what first principles give, and gives the output.

    hybrid[t] = NN(w[t], w[t-1], ..., hybrid[t-1], ...)

w is the white model's measured signal; it runs freely, whatever is measured.  In terms of transfer functions the
network has to learn ``H_P / H_M``: to undo the model, and to imitate the plant.

Reference: hybrid thesis, section 4.3.1, figure 4.6, listings K.4 and K.6, appendix B.
"""

from __future__ import annotations

import sympy

from smid.hybrid.back_couplings import BackCouplings
from smid.hybrid.hybrid_model import HYBRID, HybridModel, measure_instead, output_measurement
from smid.hybrid.neural import NeuralTerm
from smid.hybrid.topology import Topology
from smid.models import Model, signal, t

__all__ = ["Series", "series"]


class Series(Topology):
    """The network after the first principles."""

    name = "series"

    @staticmethod
    def learned(plant: sympy.Expr, white: sympy.Expr) -> sympy.Expr:
        """Return the quotient: the network inverts the model and imitates the plant."""
        return plant / white


def series(
    white: Model,
    couplings: BackCouplings,
    hidden: tuple[int, ...] = (3,),
    *,
    output: str | None = None,
    name: str = "N",
) -> HybridModel:
    """Put a network after a first-principles model.

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
    >>> series(Reactor(2.0), SIMPLE, ()).model.lines[-1].expression
    N_b1_1 + N_w1_1_1*w[t] + N_w1_1_2*hybrid[t - 1]
    """
    shown = output_measurement(white, output)
    term = NeuralTerm(name, couplings.samples([signal(shown.signal)], signal(HYBRID)[t]), hidden)
    model = measure_instead(white.with_line(HYBRID, term.expression, term.parameters), shown, HYBRID)
    return HybridModel(model, term, white, Series.name, couplings)
