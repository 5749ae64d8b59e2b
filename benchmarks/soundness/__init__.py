"""The truth inside every time, an empty set never called feasible: thousands of random feasible sets."""
