"""The decision whether a model can explain a window of a record within the noise bound: both answers are proven.

*Feasible*: the model is fitted to the window, by least squares and then for the smallest largest error, and the run of
the fit is verified to keep the noise bound.

*Excluded*: where it does not, parts of the window are taken on which this fit errs most, or another model's, whichever
is harder to fit. What no parameters explain on a part, none explain on the window. On each part the free run is
inverted (:mod:`smid.identification.inversion`): of the model, and of one with free coefficients (:mod:`.coefficients`),
of which the model is a special case. Either may be decided long before the other. A polynomial model that is still
undecided is enclosed as :func:`smid.identify` does. The proof holds for all parameters within their boxes
(:mod:`.posed`).

Several models are decided side by side, in short steps. Of each cover the time to its end is estimated, from the share
that was proven empty lately. The cover whose end seems nearest is next, so that much is decided when the time is up. As
such estimates may be wrong, every fourth step is of the one that has used least time.

Reference: Kilby, Slaney, Thiebaux and Walsh, Estimating search tree size, AAAI (2006) 1014-1019.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import closing, suppress
from dataclasses import dataclass, replace
from enum import StrEnum
from functools import partial
from itertools import cycle
from operator import attrgetter
from types import MappingProxyType

import numpy as np

from relaxations.algebra.arrays import Array
from relaxations.deadline import TimeIsUp, remaining, time_limit
from relaxations.errors import ProblemError
from relaxations.search.enclosure import Reason
from relaxations.search.plan import Plan
from smid.data import DataError, Dataset
from smid.data.window import Window
from smid.diagnosis.proof.coefficients import with_free_coefficients
from smid.diagnosis.proof.posed import Posed, posed, with_known_clocks
from smid.diagnosis.proof.reached import spans
from smid.diagnosis.proof.window import windows
from smid.feasible.feasible_set import FeasibleSet
from smid.feasible.template import is_polynomial
from smid.identification.encloser import Settings
from smid.identification.inversion.cover import HEAVIEST, Cover, heaviest
from smid.identification.piecewise import Piecewise
from smid.identification.polynomial import Polynomial
from smid.models import Model, ModelError
from smid.processes import can_copy, side_by_side

MOST = 20_000
"""Contractions of a proof."""

_SIZES = (100, 250)  # samples of the parts that are excluded
_PATIENCE = 100  # contractions before relaxations
_SHARE = 0.1  # of the time that is left, for relaxations
_ROUNDS = 4
_NEAREST = 3  # steps of what seems nearest to its end, for one of what has used least time

_Shares = tuple[tuple[int, float], ...]


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
    race = Race([model], data, window, bounds)
    race.run(seconds)
    return race.decisions[0]


def fitted(model: Model, data: Dataset, window: Window, bounds: Mapping[str, float], seconds: float) -> Decision | None:
    """Return the decision that a model is feasible, where a fit of it is verified; otherwise None."""
    began = time.monotonic()
    try:
        model, data = with_known_clocks(model, data)
        with time_limit(max(seconds, 1e-3)):
            found = posed(model, window.cut(data), bounds, spans(data))
            if not found.fits:
                return None
    except Exception:  # nothing is decided, and what follows says why
        return None
    return Decision(Status.FEASIBLE, window.first, window.last, (), "", time.monotonic() - began)


class Race:
    """Models that are decided on a window side by side.

    Parameters
    ----------
    models
        With values, the first start of their fits.
    also
        Parts of the window on which another model errs most, each within the next.
    known
        What is decided beforehand, by the place of the model.
    weights
        By what times are divided; by default one for each model.

    Attributes
    ----------
    decisions
        Of each model, undecided at first.
    parts
        By the place of an undecided model, a part of the window on which it is feasible.
    """

    def __init__(
        self,
        models: Sequence[Model | None],
        data: Dataset,
        window: Window,
        bounds: Mapping[str, float],
        also: Sequence[Window] = (),
        known: Mapping[int, Decision] = MappingProxyType({}),
        weights: Mapping[int, float] = MappingProxyType({}),
    ) -> None:
        undecided = Decision(Status.UNDECIDED, window.first, window.last, (), str(TimeIsUp()), 0.0)
        self.decisions = [known.get(k, undecided) for k in range(len(models))]
        self.parts = dict[int, Window]()
        self._weights = weights
        self._open = {
            k: _deciding(model, data, window, bounds, also)
            for k, model in enumerate(models)
            if model is not None and k not in known
        }

    def run(self, seconds: float, workers: int = 1) -> None:
        """Decide until the time is used up; where this process can be copied, copies share the models."""
        count = min(workers, len(self._open)) if can_copy() else 1
        # The heaviest come first, so that they are in different copies.
        order = sorted(self._open, key=lambda k: -self._weights.get(k, 1.0))
        shares = [order[first::count] for first in range(count)]
        with (
            time_limit(max(seconds, 1e-3)),
            closing(side_by_side([partial(self._decided, share) for share in shares])) as told,
        ):
            for k, found in told:
                if isinstance(found, Window):
                    self.parts[k] = found
                else:
                    self.decisions[k] = found

    def _decided(self, share: Sequence[int]) -> Iterator[tuple[int, Decision | Window]]:
        """Yield what is found of some of the models, with their places; undecided are those that the time ends."""
        left, spent = dict.fromkeys(share, 0.0), dict.fromkeys(share, 0.0)
        unfinished = list(share)

        def weighted(times: Mapping[int, float]) -> Callable[[int], float]:
            return lambda k: times[k] / self._weights.get(k, 1.0)

        with suppress(TimeIsUp):
            for key in cycle((*[weighted(left)] * _NEAREST, weighted(spent))):
                if not (unfinished and remaining()):
                    break
                k, began = min(unfinished, key=key), time.monotonic()
                found = next(self._open[k])
                spent[k] += time.monotonic() - began
                if isinstance(found, float):
                    left[k] = found
                elif isinstance(found, Window):
                    yield k, found
                else:
                    unfinished.remove(k)
                    yield k, replace(found, seconds=spent[k])
        for k in unfinished:
            yield k, replace(self.decisions[k], seconds=spent[k])

    def on(self, part: Window) -> tuple[Decision, ...]:
        """Return what is decided on a part of the window: what fits more samples, or is excluded by some of them."""
        return tuple(_on(part, found, self.parts.get(k)) for k, found in enumerate(self.decisions))


@dataclass(eq=False)
class _Trial:
    """A cover of a part of the window: of the model, or of one with free coefficients.

    Parameters
    ----------
    seconds
        What it took so far.
    since
        Seconds and proven share about half that time ago, and at the last doubling of the time.
    """

    part: Window
    cover: Cover
    freed: bool
    seconds: float = 0.0
    since: tuple[tuple[float, float], tuple[float, float]] = ((0.0, 0.0), (0.0, 0.0))

    def step(self) -> None:
        began = time.monotonic()
        self.cover.step()
        self.seconds += time.monotonic() - began
        if self.seconds >= 2.0 * self.since[1][0]:
            self.since = self.since[1], (self.seconds, self.cover.proven)

    @property
    def left(self) -> float:
        """Estimate of the seconds until nothing is left, from what was proven lately."""
        (seconds, proven), now = self.since[0], self.cover.proven
        return (self.seconds - seconds) * (1.0 - now) / max(now - proven, 1e-12)

    @property
    def carrying(self) -> _Shares:
        """The most influential samples of an empty cover."""
        return tuple((self.part.first + k, share) for _, k, share in heaviest(self.cover))


def _deciding(
    model: Model, data: Dataset, window: Window, bounds: Mapping[str, float], also: Sequence[Window]
) -> Iterator[Decision | Window | float]:
    """Yield after each step the estimated seconds left, or a part on which the model fits; at last what is proven."""

    def decision(status: Status, reason: str = "", part: Window = window, samples: _Shares = ()) -> Decision:
        return Decision(status, part.first, part.last, samples, reason, 0.0)

    try:
        model, data = with_known_clocks(model, data)
        inputs = spans(data)
        whole = posed(model, window.cut(data), bounds, inputs)
        if whole.fits:
            yield decision(Status.FEASIBLE)
            return
        yield 0.0
        parts = {window: whole}
        chains = [_parts(window, whole.error), [part for part in also if len(part) <= _SIZES[-1]]]
        for part in [chain[-1] for chain in chains if chain]:
            parts[part] = parts.get(part) or posed(model, part.cut(data), bounds, inputs)
            yield part if part in also and parts[part].fits else 0.0
        chain = max(filter(None, chains), key=lambda chain: parts[chain[-1]].least)
        for part in chain[:-1]:
            parts[part] = posed(model, part.cut(data), bounds, inputs)
            yield 0.0
        trials = list[_Trial]()
        for part in _hopeful({part: parts[part] for part in chain}):
            own = parts[part].record
            for freed in with_free_coefficients(own, bounds):
                trial = _Trial(part, Cover(freed.record, 0.0, deepest_first=True), freed=True)
                trial.step()
                if not trial.cover.boxes:
                    yield decision(Status.EXCLUDED, part=part, samples=trial.carrying)
                    return
                trials += [] if trial.cover.done else [trial]
                own = freed.told(own, bounds, *trial.cover.outer)
                yield 0.0
            trials.append(_Trial(part, Cover(own.with_products(), 0.0, deepest_first=True), freed=False))
            yield 0.0
        relaxed, left = not (_measures_all_states(model) and is_polynomial(model)), ""
        turns = cycle((*[attrgetter("left")] * _NEAREST, attrgetter("seconds")))
        while trials:
            trial = min(trials, key=next(turns))
            cover = trial.cover
            trial.step()
            if cover.done and not cover.boxes:
                yield decision(Status.EXCLUDED, part=trial.part, samples=trial.carrying)
                return
            if cover.points and not trial.freed:
                if trial.part == window:
                    yield decision(Status.FEASIBLE)
                    return
                left = "a point fits the samples where the fit errs most"
                trials = [other for other in trials if other.part != trial.part]
            elif cover.done or cover.points or cover.contracted >= MOST:
                left = left or f"{cover.contracted} contractions leave {len(cover.boxes)} boxes"
                trials.remove(trial)
            yield min((one.left for one in trials), default=0.0)
            if not relaxed and (cover.contracted >= _PATIENCE or not trials):
                relaxed = True
                with time_limit(max(_SHARE * remaining(), 1e-3)):
                    status, samples = _relaxed(model, trial.part.cut(data), bounds)
                if status is Status.EXCLUDED or (status is Status.FEASIBLE and trial.part == window):
                    samples = tuple((trial.part.first + k, share) for k, share in samples)
                    yield decision(status, part=trial.part, samples=samples)
                    return
        yield decision(Status.UNDECIDED, left)
    except (ModelError, DataError) as error:
        yield decision(Status.NOT_POSABLE, " ".join(str(error).split()))
    except TimeIsUp:
        raise
    except Exception as error:  # a proof that fails costs only the proof
        yield decision(Status.UNDECIDED, " ".join(f"failed with {type(error).__name__}: {error}".split()))


def _on(part: Window, found: Decision, fitting: Window | None) -> Decision:
    """Return what a decision on a window says of a part of it, where the model fits a part."""
    if found.excluded and part.first <= found.first <= found.last <= part.last:
        return found
    if fitting is not None and fitting.first <= part.first <= part.last <= fitting.last:
        return replace(found, status=Status.FEASIBLE, first=part.first, last=part.last, samples=(), reason="")
    if found.excluded:
        elsewhere = f"it is excluded by samples {found.first} to {found.last}"
        return replace(found, status=Status.UNDECIDED, first=part.first, last=part.last, samples=(), reason=elsewhere)
    return replace(found, first=part.first, last=part.last)


def _parts(window: Window, error: Array) -> list[Window]:
    """Return the parts of a window on which a fit errs most, each within the next."""
    found = windows([error], _SIZES)
    return [Window(window.experiment, window.first + part.first, window.first + part.last) for part in found]


def _hopeful(parts: Mapping[Window, Posed]) -> list[Window]:
    """Return the parts on which no run was found within the noise bounds; where there is none, all.

    Errors are the larger the longer a part is, but so is the time of a contraction.
    """
    return [part for part, found in parts.items() if found.least > 1.0] or list(parts)


def _measures_all_states(model: Model) -> bool:
    # To eliminate hidden states from a long line can take minutes, and cannot be interrupted.
    return set(model.states) <= {m.signal for m in model.measurements}


def _relaxed(model: Model, part: Dataset, bounds: Mapping[str, float]) -> tuple[Status, _Shares]:
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
