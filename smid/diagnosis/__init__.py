"""Diagnosis of a model: misfit, cause, extended model, and gain on a test part that nothing has seen."""

from smid.diagnosis.cause import Cause, CauseParameter, Rival
from smid.diagnosis.diagnose import diagnose
from smid.diagnosis.diagnosis import Diagnosis, Verdict
from smid.diagnosis.effects import EFFECTS
from smid.diagnosis.effects.check import check_effect
from smid.diagnosis.effects.effect import Detection, Effect, Extension, Site
from smid.diagnosis.evidence.faults import Fault, data_faults
from smid.diagnosis.evidence.misfit import Misfit, misfit
from smid.diagnosis.gain import Gain
from smid.diagnosis.proof.exclusion import certify_name
from smid.diagnosis.proof.name import prove_name
from smid.diagnosis.proof.name_proof import NameProof
from smid.diagnosis.proven import prove_parameters

__all__ = [
    "EFFECTS",
    "Cause",
    "CauseParameter",
    "Detection",
    "Diagnosis",
    "Effect",
    "Extension",
    "Fault",
    "Gain",
    "Misfit",
    "NameProof",
    "Rival",
    "Site",
    "Verdict",
    "certify_name",
    "check_effect",
    "data_faults",
    "diagnose",
    "misfit",
    "prove_name",
    "prove_parameters",
]
