"""Certificates: bounds that follow from multipliers in ball arithmetic, and the files that hold them."""
