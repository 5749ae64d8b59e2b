"""Simultaneous estimation: a parallel network, with free parameters of the first-principles model.

With a dynamic network the data do not determine a time constant, because the network can replace it. The first
attempts of the thesis failed for this reason. With a static network the time constant is determined.

The thesis draws the network beside the model (figure 4.9). Its listing K.11 puts the network into the balance instead,
``tau y' + y + N(y) = K(tau) u``, which is `embedded`. Only `embedded` has the solution tau = 2 for the plant of (5.12).
A static network of u beside the model acts without delay, and the estimate of tau compensates for this error.

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
    """Return a hybrid model with a parallel network and some free first-principles parameters.

    The other parameters are those of `series`.

    Parameters
    ----------
    released
        Parameters to estimate together with the weights, each with its box.

    Raises
    ------
    ModelError
        If a parameter is unknown, a box is empty, or a name is already used.

    Examples
    --------
    >>> from smid.models import Reactor
    >>> joined = simultaneous(Reactor(4.0), {"tau": (0.5, 8.0)})
    >>> [p.name for p in joined.model.parameters if p.lower < p.upper]
    ['tau', 'N_w1_1_1', 'N_b1_1', 'N_w2_1_1', 'N_b2_1']
    """
    joined = parallel(white.bound(**released), couplings, hidden, output=output, name=name)
    return replace(joined, networks=(replace(joined.only, topology="simultaneous"),))
