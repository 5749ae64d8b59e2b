"""A free run enclosed over a box: what each sample states of the unknowns.

Each unknown of the box is ``mid + half e`` with a symbol e in [-1, 1] of its own. So is what operations on parameters
alone leave over, which is the same at every sample. The line of every signal is evaluated
on forms at one sample after the other. What an operation leaves over goes into a radius; where a signal is remembered,
its radius becomes a symbol of its own, so that it is known to be the same at the next sample. A symbol stands for one
number: it is never used again, and where it is older than the kept ones its share goes back into the radius, which is
true of any form at any time.

A signal lies within the noise bound of its measurement at every point of the set. So its form may be narrowed to that,
and a run that is *anchored* may replace it where it is wider than one noise bound. A *stepwise* run replaces it at
every sample, and the error of each measurement has a symbol, which all rows share.

States that have rates are integrated from one sample to the next (:mod:`.motion`). Over a wide box little is known of
where they go. But where they are measured at both ends of an interval, their change is the interval times a value of
the rate on the way: these rows are called balances.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from itertools import accumulate

from relaxations.check.runs.affine import UNKNOWN, Form, Range, add, narrowed, negative, scaled, spread, symbol
from relaxations.check.runs.fixed import ONE, End
from relaxations.check.runs.motion import Motion
from relaxations.check.runs.operations import cost_of, operate
from relaxations.check.runs.statement import Piece, Stated

FREE, ANCHORED, CONSTRAINT, PRODUCT = 0, 1, -1, -2
"""Where a row comes from."""

LINKS = 2
"""Added to a run: the row says that a signal is what another piece begins with at the same sample."""

BALANCES = 2 * LINKS
"""In place of a run: the row compares the measurements of a state at both ends of an interval with its rate."""

STEPWISE = BALANCES + 1
"""In place of a run: the row compares a measurement with what the model says from the samples before."""

Source = tuple[int, int, int, int]
"""Run or `STEPWISE`, piece, measurement, sample; `LINKS` more than a run, piece, line, sample; `BALANCES`, piece,
state, sample; `CONSTRAINT`, 0, constraint, 0; or `PRODUCT`, 0, which pair, which of `FACTORS`."""

FACTORS = ((1, 1, -1, 3), (-1, -1, -1, 3), (1, -1, -3, 1), (-1, 1, -3, 1))
"""For symbols e and f, the least and the largest value of ``a e + b f + e f``: a, b, and both values."""


_BEYOND = 10  # noise bounds


@dataclass(frozen=True)
class Row:
    """``low <= sum slope_k e_k <= high`` for the symbols that all rows share; impossible where no point can.

    These are the symbols of the unknowns, of their products, of what parameters alone leave over, and of the errors of
    all measurements.
    """

    slopes: Mapping[int, int]
    low: int
    high: int
    impossible: bool


def rows(stated: Stated, box: list[Range], sources: Iterable[Source]) -> dict[Source, Row | None]:
    """Return what some samples and constraints state of a box; None for a sample of which nothing is known."""
    found: dict[Source, Row | None] = {}
    wanted: dict[tuple[int, int], list[Source]] = {}
    for source in sources:
        run = source[0] - LINKS if LINKS <= source[0] < BALANCES else source[0]
        wanted.setdefault((run, source[1]), []).append(source)
    starts = [symbol(*ends, k) for k, ends in enumerate(box)]
    fixed = _fixed(stated, starts)
    pairs = list(stated.products)
    errors = len(box) + len(pairs) + len(stated.tape.shared)
    begins = list(accumulate((len(stated.measured) * piece.count for piece in stated.pieces), initial=errors))
    symbols = begins[-1]
    for (run, piece), own in wanted.items():
        if run == CONSTRAINT:
            for source in own:
                form = fixed[stated.constraints[source[2]]]
                found[source] = _row(form, symbols, 0, form.high)
        elif run == PRODUCT:
            found |= {source: _factors(*pairs[source[2]], len(box) + source[2], source[3]) for source in own}
        else:
            _run(stated, stated.pieces[piece], run, starts, fixed, begins[piece], symbols, own, found)
    return found


def _factors(j: int, k: int, product: int, which: int) -> Row:
    """Return what the product of two symbols is between, from both of them."""
    a, b, low, high = FACTORS[which]
    if j == k:  # with 2 e e - 1 in place of the square
        slopes, low, high = {j: 4 * a}, -3, 5
    else:
        slopes = {j: a, k: b}
    return Row({own: slope * ONE for own, slope in {**slopes, product: 1}.items()}, low * ONE, high * ONE, False)


def _row(form: Form, symbols: int, least: int, most: End) -> Row | None:
    """Return what follows if the form's number lies between two ends."""
    impossible = form.low > most or form.high < least
    if not (isinstance(form.radius, int) and isinstance(most, int)):
        return Row({}, 0, 0, True) if impossible else None
    slopes = {k: slope for k, slope in form.slopes.items() if k < symbols}
    rest = form.radius + sum(abs(slope) for k, slope in form.slopes.items() if k >= symbols)
    return Row(slopes, least - form.mid - rest, most - form.mid + rest, impossible)


def _fixed(stated: Stated, starts: list[Form]) -> list[Form]:
    """Return the forms of what parameters alone decide; the others are unknown.

    What an operation leaves over is the same at every sample, so it has a symbol that all rows share.
    """
    forms: list[Form] = []
    for entry, fixed in zip(stated.tape.entries, stated.tape.fixed, strict=True):
        form = operate(entry, forms, starts, stated.products) if fixed else UNKNOWN
        shared = stated.tape.shared.get(len(forms))
        if shared is not None and isinstance(form.radius, int):
            slopes = {**form.slopes, len(starts) + len(stated.products) + shared: form.radius}
            form = Form(form.mid, slopes, 0, form.low, form.high)
        forms.append(form)
        stated.work.spend(cost_of(entry) + len(forms[-1].slopes))
    return forms


def _run(
    stated: Stated,
    piece: Piece,
    run: int,
    starts: list[Form],
    fixed: list[Form],
    errors: int,
    symbols: int,
    wanted: list[Source],
    found: dict[Source, Row | None],
) -> None:
    """Find the rows of one run, as far as the last sample that is wanted.

    Parameters
    ----------
    errors
        Symbol of the error of the first sample of the first measurement.
    symbols
        The further ones belong to this run alone.
    """
    tape = stated.tape
    varying = [(k, entry) for k, entry in enumerate(tape.entries) if not (tape.fixed[k] or tape.moved[k])]
    least = sum(cost_of(entry) for _, entry in varying)
    least += len(stated.products) * sum(entry[0] in ("*", "raise") for _, entry in varying)
    past: dict[str, list[Form]] = {name: [] for name in tape.lags}
    by_sample: dict[int, list[Source]] = {}
    for source in wanted:
        by_sample.setdefault(source[3], []).append(source)
    forms, newest, lost = list(fixed), symbols - 1, False
    # Where measurements show all states, their balances say as much of a wide box as a run does, in less time.
    ends = run == FREE and stated.balanced
    for now in range(max(by_sample) + 1):
        # The lines, or initial samples before their first.
        cost = least
        for k, entry in varying:
            kind = entry[0]
            if kind == "past":
                _, name, lag = entry
                form = past[name][now - lag] if now >= lag else UNKNOWN
            elif kind == "channel":
                _, name, lag = entry
                form = (piece.exact[name][now - lag] if now >= lag else None) or UNKNOWN
            elif kind == "shown":
                form = piece.shown[entry[1]][now] or UNKNOWN
            elif kind == "define":
                _, a, name = entry
                start = piece.initial.get((name, now))
                form = forms[a] if now >= stated.first[name] else UNKNOWN if start is None else starts[start]
            elif kind == "solution":
                if not entry[1]:
                    motion = Motion(tape, forms, symbols, stated.work)
                    begin = [forms[place] for place in tape.begins]
                    solved = _solved(stated, piece, run, motion, begin, now, by_sample.get(now, ()), found)
                form = solved[entry[1]]
            else:
                form = operate(entry, forms, starts, stated.products)
            forms[k] = form
            cost += len(form.slopes)
        stated.work.spend(cost)
        # The rows.
        asked = by_sample.get(now, ())
        for source in asked:
            if LINKS <= source[0] < STEPWISE:
                continue  # below, or above
            row = stated.measured[source[2]].row
            if row is not None and piece.shown[source[2]][now] is not None:
                found[source] = _row(forms[row], symbols, 0, 0)
        # A signal lies within the noise bound of what is measured.
        for n, measured in enumerate(stated.measured):
            shown = piece.shown[n][now]
            if measured.defined is not None and shown is not None:
                own = forms[measured.defined]
                lost = lost or (ends and _is_lost(own, stated.bounds[n], symbols))
                if now >= stated.first[measured.signal]:
                    if run == ANCHORED and spread(own) > stated.bounds[n]:
                        own = shown
                    elif run == STEPWISE:
                        seen = symbol(shown.low, shown.high, errors + n * piece.count + now)
                        compared = _row(add(own, negative(seen)), symbols, 0, 0)
                        found.update({source: compared for source in asked if source[2] == n})
                        own = narrowed(seen, own.low, own.high)
                forms[measured.defined] = narrowed(own, shown.low, shown.high)
        for source in asked:
            if LINKS <= source[0] < BALANCES:
                name = stated.lines[source[2]]
                begins = stated.begins.get((piece.experiment, name, piece.first + now))
                if begins is not None:
                    found[source] = _row(add(forms[tape.now[name]], negative(starts[begins])), symbols, 0, 0)
        # Remember: the radius becomes a symbol.
        for name, earlier in past.items():
            form = forms[tape.now[name]]
            if isinstance(form.radius, int):
                kept = {k: s for k, s in form.slopes.items() if k < symbols or k > newest - stated.kept}
                radius = form.radius + sum(abs(s) for k, s in form.slopes.items() if k not in kept)
                if radius and stated.kept:
                    newest += 1
                    kept[newest], radius = radius, 0
                form = Form(form.mid, kept, radius, form.low, form.high)
            earlier.append(form)
        if lost:
            return


def _is_lost(form: Form, bound: int, symbols: int) -> bool:
    """Return whether a form beyond some noise bounds is known little from its slopes."""
    known = sum(abs(slope) for k, slope in form.slopes.items() if k < symbols)
    return spread(form) > max(_BEYOND * bound, 2 * known)


def _solved(
    stated: Stated,
    piece: Piece,
    run: int,
    motion: Motion,
    begin: list[Form],
    now: int,
    asked: Iterable[Source],
    found: dict[Source, Row | None],
) -> list[Form]:
    """Return the states at the end of an interval; in place of balances, what measurements say, and find the rows."""
    unknown = [UNKNOWN] * len(begin)
    if now < max(stated.first[name] for name in stated.rates):
        return unknown
    if run != BALANCES:
        return motion.after(begin, stated.interval, stated.steps) or unknown
    end = [_as_shown(stated, piece, name, now) for name in stated.rates]
    means = motion.mean_rates(begin, end, stated.interval)
    if means is not None:
        for source in asked:
            k = source[2]
            change = add(end[k], negative(begin[k]))
            found[source] = _row(add(change, negative(scaled(means[k], stated.interval))), motion.symbols, 0, 0)
    return end


def _as_shown(stated: Stated, piece: Piece, name: str, now: int) -> Form:
    """Return a signal as its measurements show it."""
    form = UNKNOWN
    for measured, samples in zip(stated.measured, piece.shown, strict=True):
        shown = samples[now]
        if measured.signal == name and measured.defined is not None and shown is not None:
            form = narrowed(shown, form.low, form.high)
    return form
