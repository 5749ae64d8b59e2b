"""The studies of the two theses, on simulated plants. Nothing else in the package imports them."""
