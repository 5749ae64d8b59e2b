"""Models as lists of named equations, to be simulated, bounded and rewritten."""

from smid.models.armax import Armax
from smid.models.equations import Equations
from smid.models.errors import ModelError
from smid.models.errors_in_variables import ErrorsInVariables
from smid.models.file import load_model, model_from_mapping, save_model
from smid.models.hammerstein import Hammerstein
from smid.models.model import VALUE, Line, Measurement, Model, Parameter, signal, t
from smid.models.output_error import OutputError
from smid.models.own_model import OwnModel
from smid.models.priors import Priors
from smid.models.reactor import Reactor
from smid.models.rotating_arm import RotatingArm
from smid.models.schur_cohn import schur_cohn
from smid.models.sensor import channel_to_signal, signal_to_channel
from smid.models.simulate import Simulation, predict, simulate
from smid.models.wiener import Wiener

__all__ = [
    "VALUE",
    "Armax",
    "Equations",
    "ErrorsInVariables",
    "Hammerstein",
    "Line",
    "Measurement",
    "Model",
    "ModelError",
    "OutputError",
    "OwnModel",
    "Parameter",
    "Priors",
    "Reactor",
    "RotatingArm",
    "Simulation",
    "Wiener",
    "channel_to_signal",
    "load_model",
    "model_from_mapping",
    "predict",
    "save_model",
    "schur_cohn",
    "signal",
    "signal_to_channel",
    "simulate",
    "t",
]
