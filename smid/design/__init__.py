"""Experiment design: the most informative input, by Fisher information or by certified intervals."""

from smid.design.d_optimal import Design, d_optimal
from smid.design.family import InputFamily
from smid.design.fisher import FisherInformation, fisher_information, model_information
from smid.design.shrinking import Shrinking, shrinking_input

__all__ = [
    "Design",
    "FisherInformation",
    "InputFamily",
    "Shrinking",
    "d_optimal",
    "fisher_information",
    "model_information",
    "shrinking_input",
]
