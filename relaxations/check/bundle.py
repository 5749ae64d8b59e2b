"""Check a bundle: certificates about parts of a record, of which some samples are outliers.

The file states variables in a box, and at most how many outliers there are. A *place* is a sample of an experiment. A
part consists of windows of places, and of certificates of the other kinds that share variables with the file by name.

What is proven. Let O be any set of at most so many places. The theorem is about each point of the stated box that
fulfils, with some values of the further variables, the statement of every certificate of each part that has no place
in O. With no outliers, and one part that is the record, the point fulfils all statements.

Invariant: each such point lies in ``box``, and each of the *spoilt* stretches, which are disjoint, has a place in O.

- The parts of a round are disjoint, and the places of spoilt stretches are none of theirs. There are more parts than
  outliers outside of the spoilt stretches. So one part has no outlier (pigeonhole principle), the point fulfils its
  statements, and lies in the hull of what the certificates of the parts prove. A certificate may use the stated box of
  its variables: it must contain ``box``.
- A stretch whose certificates prove that no point of ``box`` fulfils them has a place in O, or there is no such point.
  It must be disjoint from the stretches before it.
- If there are more spoilt stretches than outliers, or the hull is empty, there is no such point.

That the polynomials of a part follow from the samples of its places is not checked here: ``smid verify`` does.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from fractions import Fraction
from itertools import pairwise
from typing import Any

from relaxations.check import runs
from relaxations.check.arithmetic import Interval, Refused, Unreadable, Work
from relaxations.check.forms import MANY, Reader, excerpt, read_name, shown_name
from relaxations.check.proof import conclusion
from relaxations.check.read import document as document_of_polynomials
from relaxations.check.report import above, counted, entries, interval
from relaxations.check.runs.read import document as document_of_run
from relaxations.check.runs.read import is_run
from relaxations.check.statement import Context, shown

FORMAT = "relaxations bundle"
VERSION = 1

MOST_CERTIFICATES = 1000
MOST_LINES = 20  # of stretches in the report

Box = dict[str, Interval]


@dataclass(frozen=True)
class Window:
    """The places ``first`` to ``last`` of one experiment."""

    experiment: int
    first: int
    last: int

    def meets(self, other: Window) -> bool:
        """Return whether a place is in both."""
        return self.experiment == other.experiment and self.first <= other.last and other.first <= self.last


@dataclass(frozen=True)
class Part:
    """Windows of the record, and the contents of certificates about their places."""

    windows: tuple[Window, ...]
    certificates: tuple[Any, ...]


@dataclass(frozen=True)
class Round:
    """Parts of which one has no outlier, and stretches of which each has one."""

    parts: tuple[Part, ...]
    spoilt: tuple[Part, ...]


@dataclass(frozen=True)
class Document:
    """A bundle; `origin` is the file's statement about model and data, or None."""

    box: Box
    outliers: int
    rounds: tuple[Round, ...]
    origin: Any


@dataclass(frozen=True)
class Claim:
    """What a bundle proves: the range of each variable, None where there is no point; and the spoilt stretches."""

    box: Box | None
    spoilt: tuple[Window, ...]


def is_bundle(content: Any) -> bool:
    """Return whether a file's content says that it is a bundle."""
    return isinstance(content, dict) and content.get("format") == FORMAT


def document(content: Any) -> Document:
    """Return the statement of a bundle and its parts; each certificate is read when it is checked."""
    if not is_bundle(content):
        raise Unreadable(f"the file is not a certificate: its 'format' is not {FORMAT!r}")
    if content.get("version") != VERSION or isinstance(content["version"], bool):
        raise Unreadable(f"the version is {excerpt(content.get('version'))}, this program checks version {VERSION}")
    reader = Reader(0, Work(0))
    file = reader.fields(
        content, "the file", ("format", "version", "variables", "box", "outliers", "rounds"), ("origin",)
    )
    names = [read_name(name, f"variable {k}") for k, name in enumerate(reader.items(file["variables"], "variables"))]
    if len(set(names)) < len(names):
        raise Unreadable(f"two variables have the name {shown_name(max(names, key=names.count))}")
    pairs = reader.items(file["box"], "box", len(names))
    box = {name: reader.ends(pair, f"box of {shown_name(name)}") for name, pair in zip(names, pairs, strict=True)}
    rounds = []
    for k, entry in enumerate(reader.items(file["rounds"], "rounds"), start=1):
        fields = reader.fields(entry, f"round {k}", ("parts", "spoilt"))
        rounds.append(Round(*(_parts(reader, fields[key], f"round {k}, {key}") for key in ("parts", "spoilt"))))
    held = sum(len(part.certificates) for one in rounds for part in (*one.parts, *one.spoilt))
    if not 1 <= held <= MOST_CERTIFICATES:
        raise Unreadable(f"there are {held} certificates: from 1 to {MOST_CERTIFICATES} are read")
    return Document(box, reader.index(file["outliers"], "outliers", MANY), tuple(rounds), file.get("origin"))


def certificates(content: Mapping[str, Any]) -> Iterator[Any]:
    """Yield the contents of all certificates of a bundle, of which the form was not checked."""
    for one in content["rounds"]:
        for part in (*one["parts"], *one["spoilt"]):
            yield from part["certificates"]


def _parts(reader: Reader, value: Any, where: str) -> tuple[Part, ...]:
    parts = []
    for k, entry in enumerate(reader.items(value, where), start=1):
        fields = reader.fields(entry, f"{where} {k}", ("windows", "certificates"))
        windows = []
        for given in reader.items(fields["windows"], f"{where} {k}, windows"):
            ends = reader.items(given, f"{where} {k}, a window", 3)
            window = Window(*(reader.index(end, f"{where} {k}, a window", MANY) for end in ends))
            if window.first > window.last:
                raise Unreadable(f"{where} {k}: the window {ends} ends before it begins")
            windows.append(window)
        parts.append(Part(tuple(windows), tuple(reader.items(fields["certificates"], f"{where} {k}, certificates"))))
    return tuple(parts)


def proven(found: Document) -> Claim:
    """Return what a bundle proves, as `claim_of`; refuse one that proves nothing beyond the stated box."""
    claim = claim_of(found)
    if claim.box == found.box and not claim.spoilt:
        raise Refused("the file proves nothing beyond the stated box")
    return claim


def claim_of(found: Document) -> Claim:
    """Return what a bundle proves; refuse one whose certificates or parts do not prove it."""
    box, spoilt = dict(found.box), list[Window]()
    for number, one in enumerate(found.rounds, start=1):
        if one.parts:
            here = f"round {number}"
            _require_disjoint([w for part in one.parts for w in part.windows], here)
            left = found.outliers - len(spoilt)
            if len(one.parts) <= left:
                raise Refused(f"{here}: parts > outliers left fails: {len(one.parts)} > {left}")
            ranges = [_of_part(part, box, f"{here}, part {k}") for k, part in enumerate(one.parts, start=1)]
            kept = [own for own in ranges if own is not None]
            if not kept:
                return Claim(None, tuple(spoilt))
            box = {name: (min(own[name][0] for own in kept), max(own[name][1] for own in kept)) for name in box}
        for k, stretch in enumerate(one.spoilt, start=1):
            here = f"round {number}, stretch {k}"
            spoilt += stretch.windows
            if len(stretch.windows) != 1:
                raise Refused(f"{here}: windows = 1 fails: {len(stretch.windows)}")
            _require_disjoint(spoilt, here)
            if _of_part(stretch, box, here) is not None:
                raise Refused(f"{here}: its certificates do not prove that no point fulfils them")
            if len(spoilt) > found.outliers:
                return Claim(None, tuple(spoilt))
    return Claim(box, tuple(spoilt))


def _require_disjoint(windows: list[Window], where: str) -> None:
    ordered = sorted(windows, key=lambda w: (w.experiment, w.first))
    for one, other in pairwise(ordered):
        if one.meets(other):
            raise Refused(f"{where}: sample {other.first} of experiment {other.experiment} is in two windows")


def _of_part(part: Part, box: Box, where: str) -> Box | None:
    """Return the part of a box in which a point may fulfil all certificates of a part; None if there is none."""
    left = dict(box)
    for k, content in enumerate(part.certificates, start=1):
        here = f"{where}, certificate {k}"
        try:
            stated, ranges = _of_run(content) if is_run(content) else _of_polynomials(content)
        except Refused as refusal:
            raise type(refusal)(f"{here}: {refusal}") from None
        for name in box.keys() & stated.keys():
            (low, high), (from_, to) = stated[name], box[name]
            if not low <= from_ <= to <= high:
                raise Refused(f"{here}: its box of {shown_name(name)} does not hold all that was proven before")
        if ranges is None:
            return None
        for name in box.keys() & ranges.keys():
            (low, high), (from_, to) = left[name], ranges[name]
            left[name] = max(low, from_), min(high, to)
    return None if any(low > high for low, high in left.values()) else left


def _of_run(content: Any) -> tuple[Mapping[str, Interval], Mapping[str, Interval] | None]:
    """Return the stated boxes of a run certificate, and the ranges that it proves; None where it proves emptiness."""
    found = document_of_run(content)
    return found.priors, runs.proven(found)


def _of_polynomials(content: Any) -> tuple[Mapping[str, Interval], Mapping[str, Interval] | None]:
    """Return the stated boxes of a certificate of polynomials, and the ranges that it proves; None for emptiness."""
    found = document_of_polynomials(content)
    context = Context("", found.stated, list(found.box), [], found.work)
    empty = any(theorem.empty for theorem in conclusion(found.steps, context))
    names = found.stated.names
    return dict(zip(names, found.box, strict=True)), None if empty else dict(zip(names, context.box, strict=True))


def report(found: Document, claim: Claim) -> Iterator[str]:
    """Yield the printed lines for an accepted file."""
    held = sum(len(part.certificates) for one in found.rounds for part in (*one.parts, *one.spoilt))
    yield f"accepted: {counted(len(found.box), 'variable')}, {counted(held, 'certificate')}"
    if found.origin is None:
        yield "origin: not stated, so the proof is about the polynomials in this file"
    else:
        yield "origin, as this file states it (smid verify compares it with a model and with data):"
        yield from (f"  {line}" for line in entries(found.origin, ""))
    yield "stated:"
    yield f"  at most {counted(found.outliers, 'outlier')}"
    for name, ends in list(found.box.items())[:MOST_LINES]:
        yield f"  {shown_name(name)} in {interval(ends)}"
    yield "proven:"
    for w in claim.spoilt[:MOST_LINES]:
        yield f"  samples {w.first} to {w.last} of experiment {w.experiment} hold an outlier"
    if claim.box is None:
        yield "  no point satisfies the constraints, whichever samples are outliers"
        return
    for name, (low, high) in list(claim.box.items())[:MOST_LINES]:
        yield f"  {shown_name(name)}: {shown(low)} to {above(high) if isinstance(high, Fraction) else 'no bound'}"
    if len(claim.box) > MOST_LINES:
        yield f"  ... and {counted(len(claim.box) - MOST_LINES, 'further variable')}"
