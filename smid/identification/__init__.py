"""Certified parameter intervals of a model, and the least noise bound of a record."""
