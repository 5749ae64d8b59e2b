"""The studies of the first-order reactor: the mismatches that a network corrects, and its learned responses."""

from smid.theses.hybrid.reactor.conditions import OtherConditions, other_conditions
from smid.theses.hybrid.reactor.output_errors import OutputErrors, output_errors
from smid.theses.hybrid.reactor.reactor_study import ReactorStudy, reactor_study
from smid.theses.hybrid.reactor.records import PLANTS, reactor_record, white_reactor
from smid.theses.hybrid.reactor.requirements import RequirementStudy, requirement_study
from smid.theses.hybrid.reactor.time_constant import TimeConstants, time_constant_study

__all__ = [
    "PLANTS",
    "OtherConditions",
    "OutputErrors",
    "ReactorStudy",
    "RequirementStudy",
    "TimeConstants",
    "other_conditions",
    "output_errors",
    "reactor_record",
    "reactor_study",
    "requirement_study",
    "time_constant_study",
    "white_reactor",
]
