"""The hybrid thesis: plants that differ from first principles in one known way."""

from smid.hybrid.plants import MISMATCHES, Mismatch, arm_base, reactor_base, simulate_arm, simulate_reactor

__all__ = ["MISMATCHES", "Mismatch", "arm_base", "reactor_base", "simulate_arm", "simulate_reactor"]
