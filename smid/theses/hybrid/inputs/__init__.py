"""Inputs for the rotating arm, compared by excitation, Fisher's information and certified intervals."""

from smid.theses.hybrid.inputs.arm_experiments import arm_information, arm_sines, arm_tailored, arm_widths
from smid.theses.hybrid.inputs.input_study import InputStudy, arm_inputs, input_study

__all__ = [
    "InputStudy",
    "arm_information",
    "arm_inputs",
    "arm_sines",
    "arm_tailored",
    "arm_widths",
    "input_study",
]
