"""Feasible points: local searches, and proofs that a point satisfies every constraint."""

from relaxations.points.witness import Witness, find_witness, verify

__all__ = ["Witness", "find_witness", "verify"]
