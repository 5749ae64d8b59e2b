"""Set-membership identification through polynomial optimization: parameter intervals that are theorems."""

from smid.binding import bind
from smid.data import DataError, Dataset
from smid.diagnosis import Diagnosis, diagnose
from smid.error_bound import ErrorBound, error_bound
from smid.estimate import CentreStatus, Estimate, ParameterInterval
from smid.feasible import FeasibleSet
from smid.identify import EmptyFeasibleSetError, identify
from smid.lowest_order import LowestOrder, lowest_order
from smid.models import (
    ErrorsInVariables,
    Hammerstein,
    Model,
    ModelError,
    OutputError,
    Parameter,
    Reactor,
    RotatingArm,
    Wiener,
    load_model,
)
from smid.reports import report
from smid.study import order_study
from smid.validate import Validation, validate
from smid.verification import NotProvenError, Verification, verify

__version__ = "0.1.0"

__all__ = [
    "CentreStatus",
    "DataError",
    "Dataset",
    "Diagnosis",
    "EmptyFeasibleSetError",
    "ErrorBound",
    "ErrorsInVariables",
    "Estimate",
    "FeasibleSet",
    "Hammerstein",
    "LowestOrder",
    "Model",
    "ModelError",
    "NotProvenError",
    "OutputError",
    "Parameter",
    "ParameterInterval",
    "Reactor",
    "RotatingArm",
    "Validation",
    "Verification",
    "Wiener",
    "bind",
    "diagnose",
    "error_bound",
    "identify",
    "load_model",
    "lowest_order",
    "order_study",
    "report",
    "validate",
    "verify",
]
