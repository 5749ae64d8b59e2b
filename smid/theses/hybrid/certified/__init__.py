"""Certified intervals of the rotating arm, without a start value."""

from smid.theses.hybrid.certified.arm import CertifiedArm, certify_arm
from smid.theses.hybrid.certified.box import PRIOR

__all__ = ["PRIOR", "CertifiedArm", "certify_arm"]
