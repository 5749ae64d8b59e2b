from . import data, design, diagnosis, hybrid, models, networks, recursive, reports, sensors, signals, study, validation
from .data import DataError, Dataset
from .diagnosis import Diagnosis, diagnose
from .feasible.feasible_set import FeasibleSet
from .fitting.binding import bind
from .identification.dead_zone import DeadZones, dead_zones
from .identification.error_bound import ErrorBound, error_bound
from .identification.estimate import CentreStatus, Estimate, ParameterInterval
from .identification.identify import EmptyFeasibleSetError, identify
from .identification.lowest_order import LowestOrder, lowest_order
from .models import (
    Armax,
    ErrorsInVariables,
    Hammerstein,
    Model,
    ModelError,
    OutputError,
    OwnModel,
    Parameter,
    Reactor,
    RotatingArm,
    Wiener,
    load_model,
    save_model,
)
from .reports import load, report, schemas
from .responses.band import ResponseBand
from .responses.projections import Projections, projections
from .responses.respond import bode, step
from .study import order_study
from .validation import Comparison, ModelFit, Residuals, Validation, compare, fit, residuals, validate
from .verification import NotProvenError, Verification, verify

__version__: str
__all__ = [
    "Armax",
    "CentreStatus",
    "Comparison",
    "DataError",
    "Dataset",
    "DeadZones",
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
    "ModelFit",
    "NotProvenError",
    "OutputError",
    "OwnModel",
    "Parameter",
    "ParameterInterval",
    "Projections",
    "Reactor",
    "Residuals",
    "ResponseBand",
    "RotatingArm",
    "Validation",
    "Verification",
    "Wiener",
    "bind",
    "bode",
    "compare",
    "data",
    "dead_zones",
    "design",
    "diagnose",
    "diagnosis",
    "error_bound",
    "fit",
    "hybrid",
    "identify",
    "load",
    "load_model",
    "lowest_order",
    "models",
    "networks",
    "order_study",
    "projections",
    "recursive",
    "report",
    "reports",
    "residuals",
    "save_model",
    "schemas",
    "sensors",
    "signals",
    "step",
    "study",
    "validate",
    "validation",
    "verify",
]
