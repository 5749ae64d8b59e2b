"""Recursive estimation: parameters and certified parameter sets, updated at each sample (clutch thesis, 3.3, 6.2)."""

from smid.recursive.arx import Arx
from smid.recursive.comparison import Comparison, compare
from smid.recursive.estimator import History, RecursiveEstimator
from smid.recursive.forgetting_factor import ForgettingFactor
from smid.recursive.free_run import FreeRun, free_run
from smid.recursive.gain_study import GainStudy, gain_study
from smid.recursive.kalman_filter import KalmanFilter
from smid.recursive.locate_change import locate_change
from smid.recursive.method import DivergenceError, Method
from smid.recursive.normalised_gradient import NormalisedGradient
from smid.recursive.set_history import Change, SetHistory
from smid.recursive.set_membership import RecursiveSet
from smid.recursive.sliding_window import SlidingWindow
from smid.recursive.tracked_set import Sample, TrackedSet, follow, samples_of
from smid.recursive.tracking import Residual, Tracking, track
from smid.recursive.unnormalised_gradient import UnnormalisedGradient

__all__ = [
    "Arx",
    "Change",
    "Comparison",
    "DivergenceError",
    "ForgettingFactor",
    "FreeRun",
    "GainStudy",
    "History",
    "KalmanFilter",
    "Method",
    "NormalisedGradient",
    "RecursiveEstimator",
    "RecursiveSet",
    "Residual",
    "Sample",
    "SetHistory",
    "SlidingWindow",
    "TrackedSet",
    "Tracking",
    "UnnormalisedGradient",
    "compare",
    "follow",
    "free_run",
    "gain_study",
    "locate_change",
    "samples_of",
    "track",
]
