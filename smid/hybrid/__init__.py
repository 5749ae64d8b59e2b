"""The hybrid thesis: first principles and networks in one model, and the plants to try them on."""

from smid.hybrid.analysis import Requirement, learned_response, network_alone, pulse_transfer, required, transfer
from smid.hybrid.back_couplings import EXTRA, SIMPLE, STATIC, BackCouplings, BackCouplingWarning
from smid.hybrid.embedded import embedded
from smid.hybrid.estimate import HybridEstimate, estimate
from smid.hybrid.full_reactor import FULL_REACTOR, full_reactor, simulate_full_reactor
from smid.hybrid.hybrid_model import HYBRID, HybridModel
from smid.hybrid.neural import NeuralTerm, network_of, with_network
from smid.hybrid.parallel import parallel
from smid.hybrid.plants import (
    MISMATCHES,
    Mismatch,
    arm_base,
    reactor_base,
    reactor_plant,
    simulate_arm,
    simulate_reactor,
)
from smid.hybrid.series import series
from smid.hybrid.simultaneous import simultaneous

__all__ = [
    "EXTRA",
    "FULL_REACTOR",
    "HYBRID",
    "MISMATCHES",
    "SIMPLE",
    "STATIC",
    "BackCouplingWarning",
    "BackCouplings",
    "HybridEstimate",
    "HybridModel",
    "Mismatch",
    "NeuralTerm",
    "Requirement",
    "arm_base",
    "embedded",
    "estimate",
    "full_reactor",
    "learned_response",
    "network_alone",
    "network_of",
    "parallel",
    "pulse_transfer",
    "reactor_base",
    "reactor_plant",
    "required",
    "series",
    "simulate_arm",
    "simulate_full_reactor",
    "simulate_reactor",
    "simultaneous",
    "transfer",
    "with_network",
]
