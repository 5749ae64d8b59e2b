"""Hybrid models: a first-principles model and a network in one model, for any process.

A topology is a function that returns a `HybridModel`. To add one from another package, write such a function and a
subclass of `Topology`. The subclass gives the analysis the transfer function that the network must learn::

    class Subtracting(Topology):
        name = "subtracting"                    # HybridModel.topology

        @staticmethod
        def learned(plant, white):              # transfer functions
            return white - plant

To make the name known before the class is imported, declare an entry point::

    [project.entry-points."smid.topologies"]
    subtracting = "my_package:Subtracting"
"""

from smid.hybrid.analysis import Requirement, learned_response, network_alone, pulse_transfer, required, transfer
from smid.hybrid.back_couplings import EXTRA, SIMPLE, STATIC, BackCouplings, BackCouplingWarning
from smid.hybrid.cost_surface import CostSurface, cost_surface
from smid.hybrid.embedded import embedded
from smid.hybrid.ensemble import Ensemble, ensemble
from smid.hybrid.estimate import StalledFitWarning, estimate
from smid.hybrid.free_run_error import FreeRunError, FreeRuns
from smid.hybrid.hybrid_estimate import HybridEstimate
from smid.hybrid.hybrid_model import HYBRID, HybridModel, Placed
from smid.hybrid.laws import LAWS, Argument, Law, Shape
from smid.hybrid.learned_curve import LearnedCurve, learned_curve
from smid.hybrid.learned_law import LearnedLaw, learned_law
from smid.hybrid.network_only import network_only
from smid.hybrid.neural import NeuralTerm, network_of, network_output, with_network
from smid.hybrid.parallel import parallel
from smid.hybrid.prune import prune
from smid.hybrid.read_law import ReadLaw
from smid.hybrid.recurrent import recurrent
from smid.hybrid.series import series
from smid.hybrid.simultaneous import simultaneous
from smid.hybrid.topology import Topology
from smid.hybrid.trained_range import Extrapolation, TrainedRange, extrapolation
from smid.hybrid.upstream import upstream

__all__ = [
    "EXTRA",
    "HYBRID",
    "LAWS",
    "SIMPLE",
    "STATIC",
    "Argument",
    "BackCouplingWarning",
    "BackCouplings",
    "CostSurface",
    "Ensemble",
    "Extrapolation",
    "FreeRunError",
    "FreeRuns",
    "HybridEstimate",
    "HybridModel",
    "Law",
    "LearnedCurve",
    "LearnedLaw",
    "NeuralTerm",
    "Placed",
    "ReadLaw",
    "Requirement",
    "Shape",
    "StalledFitWarning",
    "Topology",
    "TrainedRange",
    "cost_surface",
    "embedded",
    "ensemble",
    "estimate",
    "extrapolation",
    "learned_curve",
    "learned_law",
    "learned_response",
    "network_alone",
    "network_of",
    "network_only",
    "network_output",
    "parallel",
    "prune",
    "pulse_transfer",
    "recurrent",
    "required",
    "series",
    "simultaneous",
    "transfer",
    "upstream",
    "with_network",
]
