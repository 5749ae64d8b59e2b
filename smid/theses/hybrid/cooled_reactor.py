"""An exothermic reactor with a cooling jacket, whose reaction rate may be unknown.

    d/dt C = D (Ci - C) - r C
    d/dt T = D (Ti - T) + h r C + kc q (1 - exp(-ac / q)) (Tj - T)

q is the flow of the coolant, D the flow through the tank divided by its volume. The rate r is Arrhenius's law
``k0 exp(-E / T)``, or an unknown constant. The other constants are those of Morningred and others, divided by 60
because time is in seconds here. DaISy's record 98-002 was simulated with this model.

Reference: Morningred, Paden, Seborg, Mellichamp, "An adaptive nonlinear predictive controller", Chem. Eng. Science 47
(1992); hybrid thesis, section 5.2.
"""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

import sympy

from smid.models import Line, Measurement, Model, Parameter, signal, t

__all__ = ["CONSTANTS", "arrhenius", "cooled_reactor"]

CONSTANTS: Mapping[str, tuple[float, str]] = MappingProxyType(
    {
        "D": (1.0 / 60.0, "1/s"),
        "Ci": (1.0, "mol/l"),
        "Ti": (350.0, "K"),
        "h": (200.0, "K l/mol"),
        "kc": (0.01 / 60.0, "min/(l s)"),
        "ac": (700.0, "l/min"),
        "Tj": (350.0, "K"),
    }
)
"""Value and unit of each known constant."""

K0, E = 7.2e10 / 60.0, 1e4
RATE_BOX = (0.01, 2.0)  # 1/s


def arrhenius(temperature: sympy.Expr) -> sympy.Expr:
    """Return the reaction rate in 1/s for a temperature in K.

    Examples
    --------
    >>> round(float(arrhenius(440.0)), 4)
    0.1618
    """
    return K0 * sympy.exp(-E / temperature)


def cooled_reactor(*, known_rate: bool, input: str = "q", concentration: str = "Ca", temperature: str = "T") -> Model:
    """Return the reactor's balances with fixed constants, and the signals ``c`` and ``theta``.

    Parameters
    ----------
    known_rate
        The rate follows Arrhenius's law; else it is a free constant parameter ``r``.
    input, concentration, temperature
        Channels: coolant flow in l/min, concentration in mol/l, temperature in K.

    Examples
    --------
    >>> [p.name for p in cooled_reactor(known_rate=False).parameters if p.lower < p.upper]
    ['r']
    """
    parameters = [Parameter(name, value, value, unit) for name, (value, unit) in CONSTANTS.items()]
    d, ci, ti, h, kc, ac, tj = (item.symbol for item in parameters)
    c, theta, q = signal("c")[t], signal("theta")[t], signal(input)[t]
    rate = arrhenius(theta)
    if not known_rate:
        parameters.append(Parameter("r", *RATE_BOX, "1/s"))
        rate = parameters[-1].symbol
    cooling = kc * q * (1 - sympy.exp(-ac / q)) * (tj - theta)
    return Model(
        "cooled reactor",
        tuple(parameters),
        (
            Line(c, d * (ci - c) - rate * c, rate=True),
            Line(theta, d * (ti - theta) + h * rate * c + cooling, rate=True),
        ),
        (Measurement(concentration, "c", "eta"), Measurement(temperature, "theta", "xi")),
    )
