"""Tanh networks, and least-squares training of networks and of models that contain them."""

from relaxations.algebra.arrays import Array
from relaxations.deadline import Progress
from smid.networks.delays import delayed
from smid.networks.descend import Descent, ProgressCallback, Stop, descend
from smid.networks.gauss_newton import gauss_newton
from smid.networks.gradient_descent import gradient_descent
from smid.networks.least_squares import Bounded, Iterate, LeastSquares, Method, NormalEquations, sum_normal_equations
from smid.networks.levenberg_marquardt import levenberg_marquardt
from smid.networks.lockstep import Points, lockstep, stacked_normal_equations
from smid.networks.multistart import MultiStart, multistart
from smid.networks.network import Linearisation, TanhNetwork, weight_count
from smid.networks.scaling import Scaling, fold, scaling_of
from smid.networks.split import Split, random_split
from smid.networks.start import nguyen_widrow
from smid.networks.train import NetworkError, Training, train

__all__ = [
    "Array",
    "Bounded",
    "Descent",
    "Iterate",
    "LeastSquares",
    "Linearisation",
    "Method",
    "MultiStart",
    "NetworkError",
    "NormalEquations",
    "Points",
    "Progress",
    "ProgressCallback",
    "Scaling",
    "Split",
    "Stop",
    "TanhNetwork",
    "Training",
    "delayed",
    "descend",
    "fold",
    "gauss_newton",
    "gradient_descent",
    "levenberg_marquardt",
    "lockstep",
    "multistart",
    "nguyen_widrow",
    "random_split",
    "scaling_of",
    "stacked_normal_equations",
    "sum_normal_equations",
    "train",
    "weight_count",
]
