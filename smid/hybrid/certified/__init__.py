"""Certified intervals of first-principles models, without a starting value."""

from smid.hybrid.certified.arm import CertifiedArm, certify_arm
from smid.hybrid.certified.box import PRIOR

__all__ = ["PRIOR", "CertifiedArm", "certify_arm"]
