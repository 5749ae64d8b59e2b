"""Certified intervals of first-principles models, without a start value."""

from smid.theses.hybrid.certified.arm import CertifiedArm, certify_arm
from smid.theses.hybrid.certified.box import PRIOR
from smid.theses.hybrid.certified.reactor import CertifiedReactor, certify_reactor

__all__ = ["PRIOR", "CertifiedArm", "CertifiedReactor", "certify_arm", "certify_reactor"]
