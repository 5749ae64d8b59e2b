"""Models whose outputs share nothing: each part is identified on its own, with fewer parameters that complicate it.

Outputs share what occurs in the equations of both: a parameter, a noise, or a constraint on parameters of both. The
feasible set is the product of the parts' sets, so the intervals are those of the parts, and it is empty where one of
them is.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from relaxations.algebra.arrays import Array
from relaxations.search.enclosure import Enclosure, Interval, Reason
from smid.data.window import Window, windows_before
from smid.feasible.template import Templates
from smid.identification.encloser import Certified, Enclosed, Encloser, with_inner_ends
from smid.identification.estimate import CentreStatus
from smid.models import Model

_NONE = (np.nan, np.nan, (True, True), ("", ""))  # no inner ends, and ends that are not tightened


def separate(model: Model) -> tuple[Model, ...]:
    """Return models of the outputs that share nothing, or the model alone.

    Examples
    --------
    >>> from smid import OwnModel
    >>> box = {name: [-1, 1] for name in "abc"}
    >>> lines = ["x[t] = a*x[t-1] + u[t]", "y[t] = b*y[t-1] + c*u[t]"]
    >>> [[p.name for p in part.parameters] for part in separate(OwnModel(lines, ["x", "y"], ["u"], box))]
    [['a'], ['b', 'c']]
    """
    templates = Templates.of(model)
    shared = [
        {line.signal, *(name for term in line.terms for name in (*term.parameters, *dict(term.latents)))}
        for line in (*templates.lines, *(hinge.argument for hinge in templates.hinges.values()))
    ]
    shared += [{symbol.name for symbol in constraint.free_symbols} for constraint in model.constraints]
    groups: list[set[str]] = []
    for names in shared:
        meeting = [group for group in groups if group & names]
        groups = [group for group in groups if not group & names] + [names.union(*meeting)]
    parts = [_part(model, names) for names in groups]
    found = [p.name for part in parts for p in part.parameters]
    outputs = [m.channel for part in parts for m in part.measurements]
    once = sorted(found) == sorted(p.name for p in model.parameters) and len(outputs) == len(set(outputs))
    if len(parts) < 2 or not once or not all(part.parameters and part.output_channels for part in parts):
        return (model,)
    return tuple(sorted(parts, key=lambda part: model.parameters.index(part.parameters[0])))


def _part(model: Model, names: set[str]) -> Model:
    """Return the lines that the measured signals of some names need, with what they read."""
    lines = {line.signal: line for line in model.lines}
    reached, ahead = set(), [m.signal for m in model.measurements if m.signal in names & lines.keys()]
    while ahead:
        reached.add(new := ahead.pop())
        if new in lines:
            ahead += {name for name, _ in lines[new].reads} - reached
    kept = {p.name for p in model.parameters} & names
    return replace(
        model,
        parameters=tuple(p for p in model.parameters if p.name in kept),
        lines=tuple(line for line in model.lines if line.signal in reached),
        measurements=tuple(m for m in model.measurements if m.signal in reached),
        constraints=tuple(c for c in model.constraints if {s.name for s in c.free_symbols} <= kept),
        values={name: value for name, value in model.values.items() if name in kept},
    )


class Separated:
    """Encloses the parameters of parts that share nothing.

    Parameters
    ----------
    encloser
        Makes what encloses the parameters of a model: of a part, or of all where some part has no finite box.
    """

    def __init__(self, model: Model, parts: Sequence[Model], encloser: Callable[[Model], Encloser]) -> None:
        self.model, self._models, self._encloser = model, parts, encloser
        self._parts = [encloser(part) for part in parts]
        self._found: list[Enclosed] = []
        self._empty: Enclosed | None = None  # of the part that is
        self._together: Encloser | None = None

    def enclose(self) -> Enclosed:
        """Return the intervals of all parts; their inner ends are at points of all of them."""
        for part in self._parts:
            found = part.enclose()
            if found.enclosure is not None and found.enclosure.empty is not None:
                self._empty = found
                return found
            if found.reason is Reason.UNBOUNDED:
                self._together = self._encloser(self.model)
                return self._together.enclose()
            self._found.append(found)
        reason = next((f.reason for f in self._found if f.reason is not Reason.TIGHT), Reason.TIGHT)
        enclosures = [f.enclosure for f in self._found if f.enclosure is not None]
        # A part that was stopped before any bound has the intervals of its priors.
        priors = {p.name: Interval(p.name, p.lower, p.upper, *_NONE) for p in self.model.parameters}
        proven = priors | {i.name: i for enclosure in enclosures for i in enclosure.intervals}
        if not enclosures or not all(np.isfinite(i.width) for i in proven.values()):
            return Enclosed(None, reason)
        points = self._joined([e.witnesses for e in enclosures]) if len(enclosures) == len(self._parts) else ()
        joined = replace(
            enclosures[0],
            intervals=with_inner_ends((proven[p.name] for p in self.model.parameters), points),
            witnesses=points,
            reason=reason,
            order=max(e.order for e in enclosures),
            rounds=max(e.rounds for e in enclosures),
            solves=sum(e.solves for e in enclosures),
            seconds=sum(e.seconds for e in enclosures),
            complicating=tuple(name for e in enclosures for name in e.complicating),
            largest_block=max(e.largest_block for e in enclosures),
            n_moments=max(e.n_moments for e in enclosures),
            after_cuts=any(e.after_cuts for e in enclosures),
        )
        boxed = [f.boxed for f in self._found if f.boxed is not None]
        derived = tuple(name for box in boxed for name in box.derived)
        return Enclosed(replace(boxed[0], derived=derived) if boxed else None, reason, joined, self._windows())

    def certified(self, found: Enclosed) -> Certified:
        """Return the certificates of the parts; that of one part where it is proven empty."""
        if self._together is not None:
            return self._together.certified(found)
        own = [part.certified(one) for part, one in zip(self._parts, self._found, strict=False)]
        if self._empty is not None:
            own = [self._parts[len(own)].certified(self._empty)]
        return Certified(found, tuple(content for one in own for content in one.certificates))

    def centre(self, enclosure: Enclosure) -> tuple[CentreStatus, Array | None]:
        """Decide whether the centres of all parts are feasible."""
        if self._together is not None:
            return self._together.centre(enclosure)
        if any(found.enclosure is None for found in self._found):
            return CentreStatus.UNDECIDED, None
        told = [part.centre(f.enclosure) for part, f in zip(self._parts, self._found, strict=True) if f.enclosure]
        statuses = {status for status, _ in told}
        worst = next(
            s for s in (CentreStatus.INFEASIBLE, CentreStatus.UNDECIDED, CentreStatus.FEASIBLE) if s in statuses
        )
        centre = {i.name: i.centre for i in enclosure.intervals}
        nearest = [
            np.array([centre[p.name] for p in model.parameters]) if status is CentreStatus.FEASIBLE else near
            for model, (status, near) in zip(self._models, told, strict=True)
        ]
        if worst is CentreStatus.FEASIBLE or any(near is None for near in nearest):
            return worst, None
        return worst, self._joined([(near,) for near in nearest if near is not None])[0]

    def _joined(self, points: Sequence[Sequence[Array]]) -> tuple[Array, ...]:
        """Return points of all parameters: those of the parts in turn; none where a part has none."""
        if not all(points):
            return ()
        names = [p.name for model in self._models for p in model.parameters]
        order = [names.index(p.name) for p in self.model.parameters]
        counts = [len(model.parameters) for model in self._models]
        return tuple(
            np.concatenate([own[k % len(own)][:n] for own, n in zip(points, counts, strict=True)])[order]
            for k in range(max(map(len, points)))
        )

    def _windows(self) -> tuple[Window, ...]:
        """Return what any part's proof reads; nothing where one reads all samples."""
        if not all(found.windows for found in self._found):
            return ()
        places = [(w.experiment, k) for f in self._found for w in f.windows for k in range(w.first, w.last + 1)]
        return windows_before(np.array(places), 0)
