"""The proof of a cover as a file, which :mod:`relaxations.check.runs` reads.

The file holds no ends but the claim: the checker computes its own from the multipliers. So the boxes are walked once
more with the checker's enclosures, which differ from those of the search in rounding and in the order of operations,
and the multipliers are solved for these. What is claimed is what the checker's arithmetic proved on the way.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from fractions import Fraction
from typing import Any

import numpy as np
from scipy import sparse

from relaxations.check.arithmetic import Unreadable
from relaxations.check.runs import read
from relaxations.check.runs.affine import Range
from relaxations.check.runs.fixed import ONE, below
from relaxations.check.runs.narrowing import Narrowed
from relaxations.check.runs.proof import Box as Ends
from relaxations.check.runs.proof import Pass, Side, bound_of, contract
from relaxations.check.runs.run import (
    ANCHORED,
    BALANCES,
    CONSTRAINT,
    FACTORS,
    FREE,
    LINKS,
    PRODUCT,
    STEPWISE,
    Row,
    Source,
    rows,
)
from relaxations.check.runs.statement import Stated
from relaxations.deadline import Progress
from smid.identification.inversion.contraction import NOTHING, Multipliers, contracted
from smid.identification.inversion.cover import Box, Cover
from smid.identification.inversion.frame import middle_and_half
from smid.identification.inversion.narrowed import Steps, outwards
from smid.identification.inversion.narrowing import Narrowing
from smid.identification.inversion.record import KEPT, Group, Record
from smid.identification.inversion.rows import Rows
from smid.verification.origin import plain_statement, samples_as_text

_DIGITS = 40  # bits of the largest multiplier of an end; the bound is true whatever is left out
_MOST = 64  # contractions of a box
_GAIN = 0.1  # share of an interval that is worth a further contraction
_REMAINDER = 0.01  # share of the noise bounds
_TOLD = 20  # boxes between two lines of progress
_HALVINGS = 1000  # of boxes for which they do not suffice

Claim = dict[str, tuple[float, float]]


def run_certificate(
    cover: Cover, bounds: Mapping[str, float], say: Progress, narrowing: Narrowing | None = None
) -> tuple[Claim | None, dict[str, Any] | None]:
    """Return the proven ends of each parameter, None where the set is proven empty, and the content of the proof.

    Where nothing is proven beyond the priors there is no content.

    Parameters
    ----------
    bounds
        Of each noisy channel, in its unit.
    say
        Called with a line of text now and then.
    narrowing
        How the first box of the cover was narrowed; None where it was not.
    """
    content = {
        "format": read.FORMAT,
        "version": read.VERSION,
        **run_statement(cover.record, bounds),
        "claim": None,
        "boxes": [],
    }
    stated = read.document(content).stated
    # The checker has further unknowns, such as where a clock begins.
    places = [stated.unknowns.index(name) for name in cover.record.names]
    content["products"] = [sorted((places[j], places[k])) for j, k in cover.record.products.pairs.tolist()]
    stated = read.document(content).stated if content["products"] else stated
    work = stated.work.left
    narrowed = Steps(narrowing, stated, say)
    if "steps" in content and not narrowed.known.empty:
        content["steps"] = _steps(content, cover)
        before, stated = stated, read.document(content).stated
        stated.work.spend(work - before.work.left)
    walk = _Walk(stated, cover, narrowed.known)
    walk.all(say)
    claim = walk.claim
    priors = {p.name: (p.lower, p.upper) for p in cover.record.model.parameters}
    if claim == priors:
        return claim, None
    content["claim"] = claim and {name: [_end(low), _end(high)] for name, (low, high) in claim.items()}
    content["boxes"] = walk.boxes
    if narrowed.content:
        content["narrowing"] = narrowed.content
    return claim, content


def run_statement(record: Record, bounds: Mapping[str, float]) -> dict[str, Any]:
    """Return the model, the samples and what is known of the start, as the file states them."""
    tape, model = record.tape, plain_statement(record.model)
    lines = [name for name in tape.signals if name in model["lines"]]
    rates, steps = model.get("rates", {}), {"steps": record.model.substeps} if "rates" in model else {}
    first = dict(zip(tape.signals, tape.first.tolist(), strict=True))
    clocks = [tape.signals[k] for k in np.flatnonzero(tape.clocks)]
    runs = record.data.experiments
    return {
        "model": {**model, "lines": {name: model["lines"][name] for name in lines}},
        "noise_bounds": {channel: float(bound).hex() for channel, bound in sorted(bounds.items())},
        "first": {name: first[name] for name in (*rates, *lines)},
        "initial": [[e, name, now, 0, 0] for e in range(len(runs)) for name in clocks for now in range(first[name])],
        "experiments": [
            {
                "name": run.name,
                "samples": run.n_samples,
                "channels": {name: samples_as_text(run.values[name]) for name in record.model.channels},
            }
            for run in runs
        ],
        "pieces": [[p.experiment, p.first, p.first + p.data.shape[1]] for p in record.cut.parts],
        "symbols": KEPT,
        **steps,
    }


def _steps(content: Mapping[str, Any], cover: Cover) -> int:
    """Return in how few steps the checker may integrate, so that the remainders widen no sample's noise by much."""
    middle = [below(Fraction(x)) for x in middle_and_half(*(cover.boxes or [cover.root])[0].left)[0].tolist()]
    most, steps = int(content["steps"]), 1
    while steps < most:
        stated = read.document({**content, "steps": steps}).stated
        try:
            known = rows(stated, [(x, x) for x in middle], [source for source in _sources(stated) if source[0] == FREE])
        except Unreadable:  # more steps would take the checker even longer
            break
        reaches = ((row, 2 * (1 + _REMAINDER) * stated.bounds[source[2]]) for source, row in known.items())
        if all(row is not None and row.high - row.low <= widest for row, widest in reaches):
            break
        steps *= 2
    return min(steps, most)


def _sources(stated: Stated, other: int = ANCHORED) -> list[Source]:
    """Return the constraints and samples of which the checker states something, in a free run and another one."""
    found: list[Source] = [(CONSTRAINT, 0, k, 0) for k in range(len(stated.constraints))]
    for n, (j, k) in enumerate(stated.products):
        found += [(PRODUCT, 0, n, which) for which in range(2 if j == k else len(FACTORS))]
    # Where measurements show all states of rates, balances say as much of wide boxes as an anchored run, in less time.
    shown = {m.signal: n for n, m in enumerate(stated.measured) if m.defined is not None and not m.within}
    balanced = stated.rates if stated.balanced else ()
    for k, piece in enumerate(stated.pieces):
        found += [
            (run, k, m, now)
            for run in ((FREE,) if balanced else (FREE, other))
            for m, measured in enumerate(stated.measured)
            if measured.row is not None
            for now, sample in enumerate(piece.shown[m])
            if sample is not None
        ]
        found += [
            (BALANCES, k, m, now)
            for m, name in enumerate(balanced)
            for now, sample in enumerate(piece.shown[shown[name]])
            if now and sample is not None
        ]
    return found


class _Walk:
    """Walks through the boxes of a cover with the checker's enclosures."""

    def __init__(self, stated: Stated, cover: Cover, known: Narrowed) -> None:
        self._stated, self._root, self._known = stated, cover.root, known
        self._sources = _sources(stated, STEPWISE if cover.record.stepwise else ANCHORED)
        signals, parts = cover.record.tape.signals, cover.record.cut.parts
        self._sources += [
            (LINKS + run, k, stated.lines.index(signals[own]), now)
            for run in (0, 1)
            for k, piece in enumerate(parts)
            for own, now, _ in piece.links.tolist()
        ]
        self._places = [stated.unknowns.index(name) for name in cover.record.names]
        groups = cover.record.groups(np.ones(len(self._places), dtype=bool))
        self._groups = [Group(tuple(self._places[k] for k in group.unknowns), group.pieces) for group in groups]
        self.boxes: list[dict[str, Any]] = []
        self.left: list[Ends] = []
        self._halvings, self._reserve = _HALVINGS, stated.work.left // 4

    @property
    def claim(self) -> Claim | None:
        """The ends of all boxes that are left, rounded outwards."""
        if not self.left:
            return None
        names = self._stated.parameters
        return {
            name: (
                outwards(min(box[k][0] for box in self.left), -1),
                outwards(max(box[k][1] for box in self.left), 1),
            )
            for k, name in enumerate(names)
        }

    def all(self, say: Progress) -> None:
        """Walk through all boxes, depth first."""
        waiting: list[tuple[Box, Ends]] = [] if self._known.empty else [(self._root, self._known.ends)]
        while waiting:
            box, ends = waiting.pop()
            node: dict[str, Any] = {}
            self.boxes.append(node)
            if len(self.boxes) % _TOLD == 0:
                say(f"certificate: {len(self.boxes)} boxes, {len(waiting)} branches left")
            passes, empty = self._contracted(box, ends)
            if passes:
                node["passes"] = passes
            if empty:
                continue
            # What the search proved empty and this does not is halved, and is empty as before.
            cut = (self._places[box.cut[0]], box.cut[1]) if box.cut else self._halving(ends) if box.empty else None
            if cut is None:
                self.left.append(ends)
                continue
            k, value = cut
            node["cut"] = [k, float(value).hex()]
            at = below(Fraction(value))
            low, high = ends[k]
            parts = ((low, min(high, at)), (max(low, at), high))
            children = zip(box.parts or (box, box), parts, strict=True)
            waiting += [(part, [*ends[:k], own, *ends[k + 1 :]]) for part, own in reversed(list(children))]

    def _halving(self, ends: Ends) -> tuple[int, float] | None:
        """Return where to halve a box, along its widest unknown; None where that was done too often."""
        self._halvings -= 1
        whole = _finite(list(self._stated.box))
        shares = [(high - low) / max(w[1] - w[0], 1) for (low, high), w in zip(_finite(ends), whole, strict=True)]
        k = int(np.argmax(shares))
        return (k, float(Fraction(sum(_finite(ends)[k]), 2 * ONE))) if self._halvings >= 0 and shares[k] > 0 else None

    def _contracted(self, box: Box, ends: Ends) -> tuple[list[dict[str, Any]], bool]:
        """Contract a box until as little is left as in the search; return the passes, and whether it is empty."""
        passes: list[dict[str, Any]] = []
        empty, gains = any(low > high for low, high in ends), True
        while not empty and gains and len(passes) < _MOST and (wide := self._beyond(ends, box)):
            # The checker refuses what takes too long, so what is left stays as wide as it is.
            if self._stated.work.left < self._reserve:
                break
            try:
                known = rows(self._stated, ends, self._sources)
            except Unreadable:
                break
            step = _pass(known, ends, self._groups)
            if not (step.sources or step.sides):
                break
            passes.append(
                {
                    "rows": [list(source) for source in step.sources],
                    "sides": [[s.unknown, s.sign, s.shift, list(sum(s.terms, ()))] for s in step.sides],
                }
            )
            before = list(ends)
            empty = not contract(ends, step, known, "the box")
            gains = any(_narrower(before[k], ends[k]) for k in wide)
        return passes, empty

    def _beyond(self, ends: Ends, box: Box) -> list[int]:
        """Return the unknowns that reach further than the search found; all if it found nothing left."""
        lower, upper = box.left
        found = zip(self._places, lower.tolist(), upper.tolist(), strict=True)
        return [k for k, low, high in found if box.empty or ends[k][0] < low * ONE or ends[k][1] > high * ONE]


def _narrower(before: Range, ends: Range) -> bool:
    """Return whether an unknown lost enough of its interval for a further contraction."""
    ((low, high),), ((at, to),) = _finite([before]), _finite([ends])
    return (high - low) - (to - at) > _GAIN * (high - low)


def _pass(known: Mapping[Source, Row | None], ends: Ends, groups: Sequence[Group]) -> Pass:
    """Return the contraction of a box by its rows; without rows where they say nothing."""
    impossible = [source for source, row in known.items() if row and row.impossible]
    if impossible:
        return Pass(impossible[:1], [])
    lower, upper = (np.array([float(Fraction(end) / ONE) for end in own]) for own in zip(*_finite(ends), strict=True))
    free = [Group(tuple(k for k in group.unknowns if upper[k] > lower[k]), group.pieces) for group in groups]
    found = contracted(_arrays(known, len(ends)), lower, upper, free)
    places: dict[Source, int] = {}
    sides = [side for m in found.proof for side in [_side(m, places)] if side.terms]
    step = Pass(list(places), sides)
    # The solver's emptiness may fail by a rounding.
    used = [known[source] for source in step.sources]
    proven = [side for side in sides if side.unknown is not None or bound_of(side, used, "") > 0]
    return Pass(step.sources if proven else [], proven)


def _finite(ends: Ends) -> list[tuple[int, int]]:
    """Return ends where an unknown without any has none to contract."""
    return [(low, high) if isinstance(low, int) and isinstance(high, int) else (0, 0) for low, high in ends]


def _arrays(known: Mapping[Source, Row | None], unknowns: int) -> Rows:
    """Return the rows that say something of a box, in floats: what is solved for need not be exact."""
    told = [(source, row) for source, row in known.items() if row is not None]
    entries = [(n, k, slope / ONE) for n, (_, row) in enumerate(told) for k, slope in row.slopes.items()]
    places, columns, values = np.array(entries).reshape(-1, 3).T
    shape = len(told), max(unknowns, int(columns.max(initial=0)) + 1)
    slopes = sparse.csr_array((values, (places.astype(np.int64), columns.astype(np.int64))), shape)
    low, high = (np.array([getattr(row, end) / ONE for _, row in told]) for end in ("low", "high"))
    reach = abs(slopes).sum(axis=1)
    useful = (reach > high) | (-reach < low)
    sources = np.array([source for source, _ in told], dtype=np.int64).reshape(-1, 4)
    return Rows(-0.5 * (low + high), 0.5 * (high - low), slopes, sources, -1).where(useful)


def _side(m: Multipliers, places: dict[Source, int]) -> Side:
    """Return multipliers as whole numbers of their rows, whose places are found or added."""
    exponent = math.frexp(float(np.abs(m.values).max(initial=0.0)))[1]
    shift = min(max(_DIGITS - exponent, 0), read.LARGEST_SHIFT - 1)
    terms = []
    for (run, e, n, now), value in zip(m.sources.tolist(), m.values.tolist(), strict=True):
        whole = round(math.ldexp(value, shift))
        if whole:
            terms.append((places.setdefault((run, e, n, now), len(places)), whole))
    return Side(None if m.unknown == NOTHING else m.unknown, m.sign, shift, terms)


def _end(value: float) -> str | None:
    return value.hex() if math.isfinite(value) else None
