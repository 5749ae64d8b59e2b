"""The hybrid thesis: first principles and networks in one model, and the plants to try them on."""

from smid.hybrid.back_couplings import EXTRA, SIMPLE, STATIC, BackCouplings, BackCouplingWarning
from smid.hybrid.embedded import embedded
from smid.hybrid.estimate import HybridEstimate, estimate
from smid.hybrid.hybrid_model import HYBRID, HybridModel
from smid.hybrid.neural import NeuralTerm, network_of, with_network
from smid.hybrid.parallel import parallel
from smid.hybrid.plants import MISMATCHES, Mismatch, arm_base, reactor_base, simulate_arm, simulate_reactor
from smid.hybrid.series import series
from smid.hybrid.simultaneous import simultaneous

__all__ = [
    "EXTRA",
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
    "arm_base",
    "embedded",
    "estimate",
    "network_of",
    "parallel",
    "reactor_base",
    "series",
    "simulate_arm",
    "simulate_reactor",
    "simultaneous",
    "with_network",
]
