"""Arithmetic that proofs rest on: sparse polynomials, and interval arithmetic that rounds outwards."""
