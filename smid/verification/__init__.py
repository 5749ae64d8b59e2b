"""Certificates with the model and the data that they were made for.

A certificate file proves a statement about its polynomials. Its ``origin`` states the model, the noise bounds and the
data. :func:`smid.verify` checks the proof, compares the origin with the user's model and data, and checks that the
polynomials follow from them: it evaluates the text of the model's lines with exact polynomials at every sample. This
evaluation shares no code with :mod:`smid.feasible.template` and :mod:`smid.feasible.assemble`, which made the
polynomials.
"""

from smid.verification.verify import NotProvenError, Verification, verify

__all__ = ["NotProvenError", "Verification", "verify"]
