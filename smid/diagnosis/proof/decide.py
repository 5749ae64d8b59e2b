"""The decision whether a model can explain a window of a record within the noise bound: both answers are proven.

*Feasible*: the model is fitted to the window, by least squares and then for the smallest largest error, and the run of
the fit is verified to keep the noise bound.

*Excluded*: where it does not, a model with free coefficients is tried (:mod:`.coefficients`), of which the model is a
special case. Where that decides nothing, the intervals of a polynomial model are enclosed as :func:`smid.identify`
does, until the set is certified empty or a feasible point is verified. Where the model is no polynomial, the free run
is inverted (:mod:`smid.identification.inversion`). The proof holds for all parameters within their boxes
(:mod:`.posed`).
"""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from relaxations.deadline import TimeIsUp, check_time, remaining, time_limit
from relaxations.errors import ProblemError
from relaxations.search.enclosure import Reason
from relaxations.search.plan import Plan
from smid.data import DataError, Dataset
from smid.data.window import Window
from smid.diagnosis.proof.coefficients import with_free_coefficients
from smid.diagnosis.proof.posed import posed, with_known_clocks
from smid.feasible.feasible_set import FeasibleSet
from smid.feasible.template import is_polynomial
from smid.identification.encloser import Settings
from smid.identification.inversion.cover import HEAVIEST, Cover, heaviest
from smid.identification.inversion.record import Record
from smid.identification.piecewise import Piecewise
from smid.identification.polynomial import Polynomial
from smid.models import Model, ModelError

MOST = 20_000
"""Contractions of a proof."""

_SHARE = 0.5  # of the time that is left, for a model with free coefficients, and for relaxations
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
    certificate
        The file that proves it, where one was written.
    """

    status: Status
    first: int
    last: int
    samples: tuple[tuple[int, float], ...]
    reason: str
    seconds: float
    certificate: str = ""

    @property
    def excluded(self) -> bool:
        """Whether it is proven that the model cannot explain the samples."""
        return self.status is Status.EXCLUDED

    @property
    def ground(self) -> str:
        """The most influential samples and the file of the certificate, or the reason."""
        file = f" ({self.certificate})" if self.certificate else ""
        return (", ".join(str(sample) for sample, _ in self.samples) or self.reason) + file


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
        model, data = with_known_clocks(model, data)
        with time_limit(max(seconds, 1e-3)):
            part = window.cut(data)
            record, points = posed(model, part, bounds)
            if any(map(record.fits, points)):
                return decision(Status.FEASIBLE)
            found = _freed(record, bounds)
            if found is not None:
                return decision(Status.EXCLUDED, samples=_carrying(found, window))
            # To eliminate hidden states from a long line can take minutes, and cannot be interrupted.
            if _measures_all_states(model) and is_polynomial(model):
                with time_limit(max(_SHARE * remaining(), 1e-3)):
                    status, samples = _relaxed(model, part, bounds)
                if status is not Status.UNDECIDED:
                    return decision(status, samples=tuple((window.first + k, share) for k, share in samples))
            cover = _covered(record)
    except (ModelError, DataError) as error:
        return decision(Status.NOT_POSABLE, " ".join(str(error).split()))
    except TimeIsUp as stop:
        return decision(Status.UNDECIDED, str(stop))
    except Exception as error:  # a proof that fails costs only the proof
        return decision(Status.UNDECIDED, " ".join(f"failed with {type(error).__name__}: {error}".split()))
    if cover.points:
        return decision(Status.FEASIBLE)
    if cover.boxes:
        return decision(Status.UNDECIDED, f"{cover.contracted} contractions leave {len(cover.boxes)} boxes")
    return decision(Status.EXCLUDED, samples=_carrying(cover, window))


def _freed(record: Record, bounds: Mapping[str, float]) -> Cover | None:
    """Return the cover that excludes the model with free coefficients; None where it is not excluded."""
    free = with_free_coefficients(record, bounds)
    if free is None:
        return None
    try:
        with time_limit(max(_SHARE * remaining(), 1e-3)):
            cover = _covered(free)
    except TimeIsUp:
        return None
    return None if cover.boxes else cover


def _covered(record: Record) -> Cover:
    """Return boxes that cover a record, cut until none is left or a point is verified."""
    cover = Cover(record, 0.0)
    while not (cover.done or cover.points) and cover.contracted < MOST:
        check_time()
        cover.step()
    return cover


def _carrying(cover: Cover, window: Window) -> tuple[tuple[int, float], ...]:
    return tuple((window.first + k, share) for _, k, share in heaviest(cover))


def _measures_all_states(model: Model) -> bool:
    return set(model.states) <= {m.signal for m in model.measurements}


def _relaxed(model: Model, part: Dataset, bounds: Mapping[str, float]) -> tuple[Status, tuple[tuple[int, float], ...]]:
    """Return what the relaxations of a polynomial model prove, and the most influential samples of an empty set."""
    try:
        feasible = FeasibleSet(model, part, bounds)
        # The least order is the fastest one; at this tolerance the first verified point ends the rounds.
        settings = Settings(order=Plan.of(feasible.problem).least, tolerance=1.0, rounds=_ROUNDS)
        kind: type[Piecewise] | type[Polynomial] = Piecewise if feasible.openings else Polynomial
        found = kind(feasible, settings, kept=False).enclose()
    except (ModelError, DataError, ProblemError, TimeIsUp):  # the inversion may do
        return Status.UNDECIDED, ()
    if found.reason is Reason.INTERRUPTED:
        raise KeyboardInterrupt
    if found.enclosure is None or found.boxed is None or not (found.enclosure.empty or found.enclosure.witnesses):
        return Status.UNDECIDED, ()
    if found.enclosure.empty is None:
        return Status.FEASIBLE, ()
    weights = found.enclosure.empty.weights
    carrying = [k for k in np.argsort(weights)[::-1][:HEAVIEST] if weights[k] > 0]
    return Status.EXCLUDED, tuple((int(found.boxed.feasible.samples[k][1]), float(weights[k])) for k in carrying)
