"""Measured data: experiments on a uniform time grid, their loading, checking and preparation."""

from smid.data.channel import Channel
from smid.data.dataset import Dataset
from smid.data.errors import DataError
from smid.data.excitation import Excitation, excitation, require_excitation
from smid.data.experiment import Experiment
from smid.data.given import as_dataset
from smid.data.normalise import Normalisation
from smid.data.record_specs import RECORDS
from smid.data.records import load_record
from smid.data.resample import Resampling
from smid.data.show import show

__all__ = [
    "RECORDS",
    "Channel",
    "DataError",
    "Dataset",
    "Excitation",
    "Experiment",
    "Normalisation",
    "Resampling",
    "as_dataset",
    "excitation",
    "load_record",
    "require_excitation",
    "show",
]
