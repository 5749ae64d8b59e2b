"""The proof of a run certificate: boxes that cover the stated one, contracted by multipliers.

The boxes are listed depth first. Each is contracted by some passes, and a box that is not empty may be cut: its two
parts, below and above a value of one unknown, are the next in the list. Whatever the value is, they cover the box. So
every point of the set lies in a box at the end of a branch, and in the hull of these, which is what is proven.

A pass encloses the run over the box. For rows ``low <= G e <= high`` and any multipliers m,

    s e_k  =  m (G e)  +  (s 1_k - m G) e  >=  sum of min(m low, m high)  -  sum |s 1_k - m G|,

so any multipliers give a true bound, which is computed here in whole numbers, and no end need be stated. Without
``s e_k`` a positive bound proves that the box holds no point of the set; so does a row that no point of it can fulfil.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from relaxations.check.arithmetic import Refused
from relaxations.check.runs.affine import Range
from relaxations.check.runs.fixed import BITS
from relaxations.check.runs.run import Row, Source, rows
from relaxations.check.runs.statement import Stated

Box = list[Range]


@dataclass(frozen=True)
class Side:
    """Multipliers for a lower end (sign 1) or an upper one (sign -1); without an unknown they prove emptiness.

    Parameters
    ----------
    shift
        The multipliers are whole numbers of ``2**-shift``.
    terms
        Place of a row among those of the pass, and multiplier.
    """

    unknown: int | None
    sign: int
    shift: int
    terms: list[tuple[int, int]]


@dataclass(frozen=True)
class Pass:
    """A contraction: the rows that are read, and the ends that they give."""

    sources: list[Source]
    sides: list[Side]


@dataclass(frozen=True)
class Node:
    """A box of the list; ``cut`` is the unknown and the value, in units, that divide what is left."""

    passes: list[Pass]
    cut: tuple[int, int] | None


def hull(nodes: Iterable[Node], stated: Stated, box: Box | None) -> Box | None:
    """Return a box that contains the part of the set that lies in a box; None where that is empty.

    Raises
    ------
    Refused
        When the list of boxes does not fit their cuts.
    """
    waiting, left = [list(box)] if box else [], list[Box]()
    for number, node in enumerate(nodes):
        if not waiting:
            raise Refused(f"box {number}: the boxes before cover the stated one, so it belongs to none")
        box = waiting.pop()
        empty = any(low > high for low, high in box)
        for step in node.passes:
            empty = empty or not contract(box, step, rows(stated, box, step.sources), f"box {number}")
        if node.cut is not None:
            k, value = node.cut
            low, high = box[k]
            waiting += [[*box[:k], ends, *box[k + 1 :]] for ends in ((max(low, value), high), (low, min(high, value)))]
        elif not empty:
            left.append(box)
    if waiting:
        raise Refused(f"the list of boxes ends, and {len(waiting)} parts of boxes that were cut are not in it")
    return [_union(ends) for ends in zip(*left, strict=True)] if left else None


def contract(box: Box, step: Pass, known: Mapping[Source, Row | None], where: str) -> bool:
    """Narrow a box by a pass, from the rows of this box, and return whether a point may be left."""
    used = [known.get(source) for source in step.sources]
    if any(row is not None and row.impossible for row in used):
        return False
    ends = list(box)
    for side in step.sides:
        bound = bound_of(side, used, where)
        if side.unknown is None:
            if bound > 0:
                return False
            raise Refused(f"{where}: the multipliers do not prove that it is empty")
        k = side.unknown
        low, high = ends[k]
        middle, half = _halves(box[k], where)
        reach = half * bound >> (BITS + side.shift)
        ends[k] = (max(low, middle + reach), high) if side.sign > 0 else (low, min(high, middle - reach))
    box[:] = ends
    return all(low <= high for low, high in box)


def bound_of(side: Side, used: list[Row | None], where: str) -> int:
    """Return what the multipliers prove, in units of ``2**-(BITS + shift)``."""
    total, left = 0, {} if side.unknown is None else {side.unknown: side.sign << (BITS + side.shift)}
    for place, multiplier in side.terms:
        row = used[place]
        if row is None:
            raise Refused(f"{where}: nothing is known of row {place} of a contraction")
        total += multiplier * (row.low if multiplier > 0 else row.high)
        for k, slope in row.slopes.items():
            left[k] = left.get(k, 0) - multiplier * slope
    return total - sum(map(abs, left.values()))


def _halves(ends: Range, where: str) -> tuple[int, int]:
    """Return the middle and the half width that a symbol stands for."""
    low, high = ends
    if not (isinstance(low, int) and isinstance(high, int)):
        raise Refused(f"{where}: an unknown without ends is contracted")
    middle = (low + high) >> 1
    return middle, max(high - middle, middle - low)


def _union(ends: Iterable[Range]) -> Range:
    lows, highs = zip(*ends, strict=True)
    return min(lows), max(highs)
