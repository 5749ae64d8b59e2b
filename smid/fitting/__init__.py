"""Fit a model to data by least squares or minimax, and validate it on other data."""
