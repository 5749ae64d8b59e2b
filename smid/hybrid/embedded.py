"""Embedded topology: the network replaces a component of the first-principles model that is hard to model.

    d/dt w = f(w, u) + s(...) NN(...)

The network learns a static function inside the balance. The factor s depends on the balance's parameters. The network
needs no back couplings, because the balance contains the dynamics.

Reference: hybrid thesis, section 4.3.4, figure 4.10; (5.13), (5.15), listing K.11.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import sympy

from smid.hybrid.back_couplings import STATIC
from smid.hybrid.hybrid_model import HybridModel, Placed, joined, whole
from smid.hybrid.neural import NeuralTerm
from smid.models import Model

__all__ = ["embedded"]


def embedded(
    white: Model | HybridModel,
    factors: Mapping[str, sympy.Expr],
    inputs: Sequence[sympy.Expr],
    hidden: tuple[int, ...] = (3,),
    *,
    name: str = "N",
    neuron: str = "tanh",
) -> HybridModel:
    """Return a hybrid model with a network inside the balances of a first-principles model.

    Parameters
    ----------
    white
        First-principles model, or a hybrid model that gets one more network. Parameters with a box are estimated
        together with the weights.
    factors
        For each signal, the factor of the network in that signal's line.
    inputs
        Network inputs: signals at time t.
    name
        Prefix of the weights' names.
    neuron
        "tanh", "logistic" or "radial".

    Raises
    ------
    ModelError
        If no line defines one of the signals, or a name is already used.

    Examples
    --------
    The balance (5.13), in which the network is to learn the missing y:

    >>> from smid.models import Reactor, signal, t
    >>> white = Reactor(reaction_rate=0.125)
    >>> joined = embedded(white, {"w": -1 / white.parameter("tau").symbol}, [signal("w")[t]], ())
    >>> joined.model.lines[0].expression.expand().coeff(joined.term.parameters[1].symbol)
    -1/tau
    """
    term = NeuralTerm(name, tuple(inputs), hidden, neuron=neuron)
    model = whole(white).with_parameter(*term.parameters)
    for line, factor in factors.items():
        model = model.add_term(line, factor * term.expression)
    return joined(white, model, Placed(term, "embedded", STATIC))
