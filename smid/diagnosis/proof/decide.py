"""The decision whether a model can explain a window of a record within the noise bound: both answers are proven.

*Feasible*: the model is fitted to the window, by least squares and then for the smallest largest error. The free run of
the fit gives every noise and hidden signal. The parameters are fixed at the fitted floats, and the point is verified in
interval arithmetic (:mod:`relaxations.points.witness`).

*Excluded*: where no such point is found, the intervals of the parameters are enclosed as :func:`smid.identify` does,
until the set is certified empty or a feasible point is verified.
"""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import dataclass, replace
from enum import StrEnum

import numpy as np

from relaxations.algebra.arrays import Array
from relaxations.deadline import TimeIsUp, time_limit
from relaxations.errors import ProblemError
from relaxations.points.witness import verify
from relaxations.problem.problem import PolynomialProblem
from relaxations.search.enclosure import Reason
from relaxations.search.plan import Plan
from smid.data import Channel, DataError, Dataset
from smid.data.window import Window
from smid.feasible.assemble import stamp_all
from smid.feasible.feasible_set import FeasibleSet
from smid.feasible.template import Templates
from smid.fitting.fit import Fitting
from smid.fitting.minimax import minimax
from smid.identification.encloser import NOTHING, Settings
from smid.identification.piecewise import Piecewise
from smid.identification.polynomial import Polynomial
from smid.identification.sub_box import sides_at
from smid.models import Model, ModelError, signal, t

_HEAVIEST = 5
_ROUNDS = 4


class Status(StrEnum):
    """What is proven of a model on a window.

    Examples
    --------
    >>> Status("not posable").name
    'NOT_POSABLE'
    """

    EXCLUDED = "excluded"
    FEASIBLE = "feasible"
    UNDECIDED = "undecided"
    NOT_POSABLE = "not posable"


@dataclass(frozen=True)
class Decision:
    """What is proven of a model on the samples ``first`` to ``last`` of an experiment.

    Parameters
    ----------
    samples
        Where excluded, the most influential samples, each with its share of the proof.
    reason
        Where undecided or not posable, why.
    """

    status: Status
    first: int
    last: int
    samples: tuple[tuple[int, float], ...]
    reason: str
    seconds: float

    @property
    def excluded(self) -> bool:
        """Whether it is proven that the model cannot explain the samples."""
        return self.status is Status.EXCLUDED

    @property
    def ground(self) -> str:
        """The most influential samples, or the reason."""
        return ", ".join(str(sample) for sample, _ in self.samples) or self.reason


def decide(model: Model, data: Dataset, window: Window, bounds: Mapping[str, float], seconds: float) -> Decision:
    """Decide whether a model can explain a window within the noise bounds.

    Parameters
    ----------
    model
        With values, the first start of its fit.
    """
    began = time.monotonic()

    def decision(status: Status, reason: str = "", samples: tuple[tuple[int, float], ...] = ()) -> Decision:
        return Decision(status, window.first, window.last, samples, reason, time.monotonic() - began)

    try:
        model, data = _with_known_clocks(model, data)
        with time_limit(max(seconds, 1e-3)):
            if _explains(model, data, window, bounds):
                return decision(Status.FEASIBLE)
            feasible = FeasibleSet(model, window.cut(data), bounds)
            # The least order is the fastest one; at this tolerance the first verified point ends the rounds.
            settings = Settings(order=Plan.of(feasible.problem).least, tolerance=1.0, rounds=_ROUNDS)
            kind: type[Piecewise] | type[Polynomial] = Piecewise if feasible.openings else Polynomial
            found = kind(feasible, settings, kept=False).enclose()
    except (ModelError, DataError, ProblemError) as error:
        return decision(Status.NOT_POSABLE, " ".join(str(error).split()))
    except TimeIsUp as stop:
        return decision(Status.UNDECIDED, str(stop))
    except Exception as error:  # a proof that fails costs only the proof
        return decision(Status.UNDECIDED, " ".join(f"failed with {type(error).__name__}: {error}".split()))
    if found.reason is Reason.INTERRUPTED:
        raise KeyboardInterrupt
    if found.enclosure is None or found.boxed is None:
        return decision(Status.UNDECIDED, found.reason.value)
    if found.enclosure.empty is not None:
        weights = found.enclosure.empty.weights
        heaviest = [k for k in np.argsort(weights)[::-1][:_HEAVIEST] if weights[k] > 0]
        samples = tuple((window.first + int(found.boxed.feasible.samples[k][1]), float(weights[k])) for k in heaviest)
        return decision(Status.EXCLUDED, samples=samples)
    if found.enclosure.witnesses:
        return decision(Status.FEASIBLE)
    return decision(Status.UNDECIDED, found.reason.value)


def _with_known_clocks(model: Model, data: Dataset) -> tuple[Model, Dataset]:
    """Return the model with its clocks as channels of the data: a window does not begin at time zero."""
    for line in model.lines:
        step = line.expression - signal(line.signal)[t - 1]
        if line.rate or not step.is_number:
            continue
        runs = tuple(
            replace(run, values={**run.values, line.signal: float(step) * np.arange(run.n_samples, dtype=np.float64)})
            for run in data.experiments
        )
        data = replace(data, experiments=runs, channels=(*data.channels, Channel(line.signal)), resampling=())
        model = replace(model, lines=tuple(other for other in model.lines if other is not line))
    return model, data


def _explains(model: Model, data: Dataset, window: Window, bounds: Mapping[str, float]) -> bool:
    """Return whether a fit to the window is verified to explain it."""
    # The samples before the window fill the memories of delays.
    part = window.cut(data, model.max_lag)
    before = part.experiments[0].n_samples - (window.last - window.first + 1)
    problem = Fitting(model, part, [np.arange(part.experiments[0].n_samples) >= before])
    with np.errstate(all="ignore"):
        start = problem.start(model.values)
        starts = [problem.solve(start)[0], start]
        return any(_verified(problem, minimax(problem, vector)[0], part, before, bounds) for vector in starts)


def _verified(problem: Fitting, vector: Array, part: Dataset, before: int, bounds: Mapping[str, float]) -> bool:
    """Return whether the free run at a vector is verified to be a point of the feasible set."""
    fit = problem.result(vector, 0.0)
    for channel, bound in bounds.items():
        if not np.nanmax(np.abs(fit.residual(part, channel)[0][before:])) <= bound:
            return False
    model = fit.model
    signals, _ = problem.run.run(problem.inputs[0], model.values, fit.initial[0], jacobian=False)
    # A missing sample is zero, with a noise of its own (smid.feasible.assemble).
    noises = {
        m.noise: np.nan_to_num(part.values(m.channel)) - fit.simulated[0][m.channel]
        for m in model.measurements
        if m.noise is not None
    }
    known = {name: samples[before:] for name, samples in {**signals, **noises}.items()}
    # As numbers: of a variable, an equality could be solved for it.
    fixed = model.fix(**{p.name: model.values.get(p.name, p.lower) for p in model.parameters})
    templates, window = Templates.of(fixed), part.crop(before)
    # Every kink on its side at the point.
    unfolded = stamp_all(templates, window, bounds, decide=False)
    sides = sides_at(unfolded.openings, window, _point(unfolded.problem, known))
    exact = stamp_all(templates, window, bounds, choose=sides).problem
    return verify(exact, NOTHING, _point(exact, known)) is not None


def _point(problem: PolynomialProblem, known: Mapping[str, Array]) -> Array:
    """Return the values of all variables: the signals are known, sample by sample."""
    point = np.nan_to_num(problem.lower, neginf=0.0)
    for k, name in enumerate(problem.names):
        latent, _, rest = name.partition("[")
        if rest and latent in known:
            point[k] = known[latent][int(rest[:-1])]
    return point
