"""Feasible points: local searches that suggest them, and proofs that they satisfy every constraint."""
