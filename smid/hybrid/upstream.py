"""Upstream topology: the network corrects an input before the first-principles model reads it.

    corrected[t] = u[t] + NN(u[t], u[t-1], ..., c[t-1], ...),    c = corrected - u

The first-principles model reads the corrected input. Together they equal the plant where ``(1 + H_NN) H_M = H_P``. With
weights of zero the model is the first-principles model alone, which the figure's network is not.

Reference: hybrid thesis, figure 4.4.b.
"""

from __future__ import annotations

import sympy

from smid.hybrid.back_couplings import STATIC, BackCouplings
from smid.hybrid.hybrid_model import HybridModel, Placed, joined, whole
from smid.hybrid.neural import NeuralTerm
from smid.hybrid.topology import Topology
from smid.models import Model, ModelError, signal, t
from smid.models.edit_lines import free_name

__all__ = ["Upstream", "upstream"]


class Upstream(Topology):
    """Topology with the network before the first-principles model."""

    name = "upstream"

    @staticmethod
    def learned(plant: sympy.Expr, white: sympy.Expr) -> sympy.Expr:
        """Return the quotient of the transfer functions, without the part that passes by the network."""
        return plant / white - 1


def upstream(
    white: Model | HybridModel,
    couplings: BackCouplings = STATIC,
    hidden: tuple[int, ...] = (3,),
    *,
    input: str | None = None,
    name: str = "N",
    neuron: str = "tanh",
) -> HybridModel:
    """Return a hybrid model with a network before a first-principles model.

    The other parameters are those of `series`.

    Parameters
    ----------
    input
        Input to correct; needed if there are several.

    Raises
    ------
    ModelError
        If the input is unknown, or a name is already used.

    Examples
    --------
    >>> from smid.models import Reactor
    >>> upstream(Reactor(2.0), hidden=()).model.lines[0].expression
    N_b1_1 + N_w1_1_1*u[t] + u[t]
    """
    before = whole(white)
    chosen = before.inputs[0] if input is None and len(before.inputs) == 1 else input
    if chosen not in before.inputs:
        raise ModelError(
            f"input = {input!r} is not an input of {before.name!r}: name one of {', '.join(before.inputs)}"
        )
    u, corrected = signal(chosen), free_name(before, f"{chosen}_corrected")
    past = signal(corrected)[t] - u[t]
    term = NeuralTerm(name, couplings.samples([u], past), hidden, neuron=neuron)
    model = before.insert_before(chosen, lambda item: item + term.expression, term.parameters, new_name=corrected)
    return joined(white, model, Placed(term, Upstream.name, couplings))
