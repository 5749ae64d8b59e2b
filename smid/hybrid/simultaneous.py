"""Simultaneous: first principles and network side by side, and parameters of both estimated at once.

The topology is `parallel`'s; what is new is that some of the first principles' parameters are free.  With a dynamic
network the data cannot tell whose dynamics are the plant's, and the estimate of a time constant means nothing: the
thesis's first attempts failed so.  With a static one it can.

The thesis draws the network beside the model (figure 4.9), but its listing K.11 puts it into the balance, reading the
concentration: ``tau y' + y + N(y) = K(tau) u``.  That is `embedded`, and only that has tau = 2 as its solution for the
plant of (5.12).  Beside the model a static network of u acts at once, as the plant does not, and tau has to make up
for it.

Reference: hybrid thesis, section 4.3.3, figure 4.9, (5.12)-(5.13), section 6.2.4, listings K.9 to K.11.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from smid.hybrid.back_couplings import STATIC, BackCouplings
from smid.hybrid.hybrid_model import HybridModel
from smid.hybrid.parallel import parallel
from smid.models import Model

__all__ = ["simultaneous"]


def simultaneous(
    white: Model,
    released: Mapping[str, tuple[float, float]],
    couplings: BackCouplings = STATIC,
    hidden: tuple[int, ...] = (1,),
    *,
    output: str | None = None,
    name: str = "N",
) -> HybridModel:
    """Put a network beside a first-principles model and release some of the model's parameters.

    Parameters
    ----------
    white
        First principles.
    released
        Parameters to estimate with the weights, each with its box.
    couplings
        Of the network; static by default.
    hidden
        Neurons of each hidden layer.
    output
        Channel to complete, where there are several.
    name
        Prefix of the weights' names.

    Raises
    ------
    ModelError
        If a parameter is not known, a box is empty, or a name is taken.

    Examples
    --------
    >>> from smid.models import Reactor
    >>> joined = simultaneous(Reactor(4.0), {"tau": (0.5, 8.0)})
    >>> [p.name for p in joined.model.parameters if p.lower < p.upper]
    ['tau', 'N_w1_1_1', 'N_b1_1', 'N_w2_1_1', 'N_b2_1']
    """
    joined = parallel(white.bound(**released), couplings, hidden, output=output, name=name)
    return replace(joined, topology="simultaneous")
