"""The hybrid thesis: a stirred tank reactor and a rotating arm, their records and studies."""

from smid.theses.hybrid.full_reactor import FULL_REACTOR, full_reactor, simulate_full_reactor
from smid.theses.hybrid.plants import (
    MISMATCHES,
    Mismatch,
    arm_base,
    reactor_base,
    reactor_plant,
    simulate_arm,
    simulate_reactor,
)

__all__ = [
    "FULL_REACTOR",
    "MISMATCHES",
    "Mismatch",
    "arm_base",
    "full_reactor",
    "reactor_base",
    "reactor_plant",
    "simulate_arm",
    "simulate_full_reactor",
    "simulate_reactor",
]
