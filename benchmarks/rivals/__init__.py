"""Solvers of polynomial problems that smid is measured beside: in floating point, without a proof."""
