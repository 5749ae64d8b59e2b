"""Certificates: bounds that follow from multipliers in ball arithmetic, and the files that hold them."""

from relaxations.proof.bounding import relax
from relaxations.proof.certificate import Certificate, certify
from relaxations.proof.certificate_file import write_certificate
from relaxations.proof.method import Cuts, Lift, Method, Sparse, method_names
from relaxations.proof.proof_steps import Bound

__all__ = [
    "Bound",
    "Certificate",
    "Cuts",
    "Lift",
    "Method",
    "Sparse",
    "certify",
    "method_names",
    "relax",
    "write_certificate",
]
