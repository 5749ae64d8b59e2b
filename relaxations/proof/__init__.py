"""Certificates: bounds that follow from multipliers in ball arithmetic, and the files that hold them."""

from relaxations.proof.bounding import relax
from relaxations.proof.certificate import Certificate, certify
from relaxations.proof.certificate_file import write_certificate
from relaxations.proof.method import (
    Chordal,
    Cuts,
    Dense,
    Lift,
    Method,
    Rlt,
    Sparse,
    Terms,
    Textbook,
    method_names,
    method_of,
)
from relaxations.proof.proof_steps import Bound

__all__ = [
    "Bound",
    "Certificate",
    "Chordal",
    "Cuts",
    "Dense",
    "Lift",
    "Method",
    "Rlt",
    "Sparse",
    "Terms",
    "Textbook",
    "certify",
    "method_names",
    "method_of",
    "relax",
    "write_certificate",
]
