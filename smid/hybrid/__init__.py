"""The hybrid thesis: plants that differ from first principles in one known way."""

from smid.hybrid.neural import NeuralTerm, network_of, with_network
from smid.hybrid.plants import MISMATCHES, Mismatch, arm_base, reactor_base, simulate_arm, simulate_reactor

__all__ = [
    "MISMATCHES",
    "Mismatch",
    "NeuralTerm",
    "arm_base",
    "network_of",
    "reactor_base",
    "simulate_arm",
    "simulate_reactor",
    "with_network",
]
