"""Feasible points: local searches that suggest them, and proofs that they satisfy every constraint."""

from relaxations.points.witness import Witness, find_witness, verify

__all__ = ["Witness", "find_witness", "verify"]
