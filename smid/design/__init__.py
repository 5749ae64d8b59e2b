"""Design of experiments: which input tells the most, by Fisher's information and by certified intervals."""

from smid.design.arm_experiments import arm_information, arm_sines, arm_tailored, arm_widths
from smid.design.d_optimal import Design, d_optimal
from smid.design.family import InputFamily
from smid.design.fisher import FisherInformation, fisher_information, model_information
from smid.design.input_study import InputStudy, arm_inputs, input_study
from smid.design.shrinking import Shrinking, shrinking_input

__all__ = [
    "Design",
    "FisherInformation",
    "InputFamily",
    "InputStudy",
    "Shrinking",
    "arm_information",
    "arm_inputs",
    "arm_sines",
    "arm_tailored",
    "arm_widths",
    "d_optimal",
    "fisher_information",
    "input_study",
    "model_information",
    "shrinking_input",
]
