"""A free run enclosed over a box: what the model says of every sample, as affine forms.

The symbols of the forms are the unknowns: parameters, and the initial samples of the states. What an operation leaves
over goes into a radius. Where a state is remembered, its radius becomes a symbol of its own, so that what is left over
at one sample is known to be the same at the next: without this, errors of states that turn around each other grow
without limit (the wrapping effect). So many symbols are kept; the oldest one is folded back into the radii.

A measured state that is known less well than it is measured may be replaced by its measurement within the noise bound.
A run that is *anchored* does so, so that it is useful over wide boxes; one that is not keeps the dependence on the
unknowns, so that it is narrow over small boxes. A *stepwise* run replaces every measured state at every sample, and the
error of each measurement has a symbol of its own, which is the same in all rows: then linear programs see that what a
sample says of an error, the next ones cannot deny. Over a wide box of a pole this costs a share of the noise bound,
where a run costs a share of the signal.

References
----------
R. J. Lohner, "Enclosing the solutions of ordinary initial and boundary value problems" (1987), for the wrapping effect.
W. Kuehn, "Rigorously computed orbits of dynamical systems without the wrapping effect", Computing 61 (1998).
"""

from __future__ import annotations

import math

import numpy as np

from relaxations.algebra.affine_arithmetic import (
    CENTRE,
    HIGH,
    LOW,
    RADIUS,
    SLOPES,
    between,
    copy,
    interval,
    nothing_known,
    spread,
)
from relaxations.algebra.arrays import Array, Index, Mask
from relaxations.algebra.ball_arithmetic import EPSILON
from relaxations.algebra.compiled import compiling
from smid.identification.inversion import both_ends, integration, operations, phi, stages, step_box
from smid.identification.inversion.both_ends import mean_rates
from smid.identification.inversion.integration import integrate
from smid.identification.inversion.operations import Operation, operate
from smid.identification.inversion.stages import further_symbols
from smid.identification.inversion.step_box import BEGIN

NO_SAMPLE, ZERO = -2, -1
"""In place of an initial sample: there is none, or it is zero."""

_BEYOND = 10.0  # noise bounds
_SOLUTION = int(Operation.SOLUTION)

compiled = compiling(
    operations.__file__,
    phi.__file__,
    stages.__file__,
    step_box.__file__,
    integration.__file__,
    both_ends.__file__,
)


@compiled
def _fold(forms: Array, symbol: int) -> None:
    """Move the share of a symbol into the radius of every form."""
    for k in range(forms.shape[0]):
        if forms[k, symbol] != 0.0:
            forms[k, RADIUS] = (forms[k, RADIUS] + abs(forms[k, symbol])) * (1.0 + 2.0 * EPSILON)
            forms[k, symbol] = 0.0


@compiled
def _named(forms: Array, a: int, symbol: int) -> None:
    """Move the radius of a form to a symbol of its own."""
    radius = forms[a, RADIUS]
    if math.isfinite(radius):
        forms[a, symbol], forms[a, RADIUS] = radius, 0.0


@compiled
def _keep(target: Array, to: int, forms: Array, a: int) -> None:
    """Write a form into another array, with what it has of further symbols in its radius."""
    left, width = forms[a, RADIUS], forms.shape[1]
    for symbol in range(target.shape[1], width):
        left += abs(forms[a, symbol])
    copy(target, to, forms, a)
    target[to, RADIUS] = left * (1.0 + (width - target.shape[1] + 4) * EPSILON)


@compiled
def _measured_less(target: Array, to: int, forms: Array, a: int, value: float, reach: float) -> None:
    """Write a form less a measurement, whose error has the last symbol."""
    own = target.shape[1] - 1
    _keep(target[:, :own], to, forms, a)
    target[to, own] = -reach
    centre = target[to, CENTRE] - value
    target[to, RADIUS] = (target[to, RADIUS] + EPSILON * abs(centre)) * (1.0 + 4.0 * EPSILON)
    target[to, CENTRE] = centre
    target[to, LOW] = math.nextafter(math.nextafter(forms[a, LOW] - value, -math.inf) - reach, -math.inf)
    target[to, HIGH] = math.nextafter(math.nextafter(forms[a, HIGH] - value, math.inf) + reach, math.inf)


@compiled
def _error(forms: Array, to: int, value: float, reach: float, symbol: int) -> None:
    """Write the form of a measured signal: its measurement, with a symbol for the error."""
    low, high = forms[to, LOW], forms[to, HIGH]
    interval(forms, to, value, reach)
    forms[to, LOW], forms[to, HIGH] = max(forms[to, LOW], low), min(forms[to, HIGH], high)
    forms[to, symbol], forms[to, RADIUS] = reach, 0.0


@compiled
def _is_lost(forms: Array, a: int, kept_from: int, reach: float) -> bool:
    """Return whether a form beyond some noise bounds is known little from its slopes."""
    slopes = 0.0
    for k in range(SLOPES, kept_from):
        slopes += abs(forms[a, k])
    total = spread(forms, a)
    return bool(total > _BEYOND * reach and not slopes > 0.5 * total)


@compiled
def _measured(
    ends: Array, signals: Index, row_channels: Index, row_signals: Index, data: Array, noise: Array, now: int
) -> None:
    """Write the least and the largest value of some signals at a sample, from measurements that show them."""
    for i in range(ends.shape[0]):
        ends[i, 0], ends[i, 1] = -math.inf, math.inf
        for k in range(row_signals.shape[0]):
            value = data[row_channels[k], now]
            if row_signals[k] == signals[i] and math.isfinite(value):
                reach = noise[row_channels[k]] * (1.0 + 4.0 * EPSILON) + EPSILON * abs(value)
                ends[i, 0], ends[i, 1] = max(ends[i, 0], value - reach), min(ends[i, 1], value + reach)


@compiled
def enclose_run(
    tape: tuple[Index, Index, Array, Index, Mask, Index, Index, Index],
    rates: tuple[Index, Index, Index, float, int],
    places: tuple[Index, Index, Index, Index, Index],
    start: Array,
    data: Array,
    noise: Array,
    depth: int,
    kept: int,
    anchor: float,
    defined_only: bool,
    may_end: bool,
    stepwise: bool,
    outputs: Array,
    bounded: Array,
    linked: Array,
    balances: Array,
    products: Index,
) -> None:
    """Write the forms of all measured outputs over a box.

    Parameters
    ----------
    tape
        What :class:`.tape.Tape` calls once, each, numbers, defined, remembered, first, rows and shared.
    rates
        What it calls inner, sections and integrated; the sampling time, and steps between two samples.
    places
        For each signal and sample which unknown the initial sample is, `ZERO` or `NO_SAMPLE`; for each measured
        output the place of its channel, and of its state (-1: not shown as it is); the form of each constraint; the
        signals and samples whose forms are linked.
    start
        The forms of the unknowns, shape (unknowns, 4 + unknowns + products + shared + kept).
    data, noise
        Shapes (channels, n) and (channels,).
    kept
        Symbols for what is left over.
    anchor
        A measured state whose reach is beyond so many noise bounds is replaced by its measurement.
    defined_only
        Forms hold the runs that are real numbers throughout. If set, nothing is known of what may not be.
    may_end
        Whether to integrate no further, as that is costly, where what is left over outweighs what the unknowns say.
    stepwise
        Whether every state begins anew from its measurement. The kept symbols are those of the errors: of each
        measured output at each of ``depth + 1`` samples, which take their places in turn.
    outputs
        Shape (measured outputs, n, 4 + unknowns + products + shared). Each form is zero where the model fits the
        sample. Where stepwise, with the kept symbols and that of the sample's own error besides.
    bounded
        Shape (constraints, 4 + unknowns + products + shared).
    linked
        Shape (links, 4 + unknowns + products + shared).
    balances
        See :func:`.both_ends.mean_rates`, shape (integrated, n, 4 + unknowns + products + shared). Then states are
        taken from measurements where both ends are known; with the shape (0, ...) they are integrated.
    products
        Columns of the products of unknowns, see :func:`multiply`. The operations of an integration keep none.
    """
    once, each, numbers, defined, remembered, first, rows, shared = tape
    initial, row_channels, row_signals, constraints, links = places
    unknowns, signals, n = start.shape[0], defined.shape[0], data.shape[1]
    inner, sections, integrated, interval_length, substeps = rates
    kept_from = start.shape[1] - kept
    shared_from = kept_from - shared.shape[0]
    # Integration has further symbols within one interval.
    width = start.shape[1] + further_symbols(inner, integrated.shape[0])
    unknown = np.zeros((unknowns, width))
    unknown[:, : start.shape[1]] = start
    stage, mean = np.zeros((integrated.shape[0], width)), np.zeros((integrated.shape[0], width))
    ends, own_signals = np.zeros((integrated.shape[0], 2)), each[integrated[:, BEGIN] - once.shape[0], 1]
    forms = np.zeros((numbers.shape[0], width))
    past = np.zeros((signals, depth + 1, width))
    flat = past.reshape(signals * (depth + 1), width)
    # What parameters alone decide.
    for k in range(once.shape[0]):
        operate(once[k], numbers[k], k, forms, unknown, past, stage, data, noise, 0, defined_only, products)
        for place in range(shared.shape[0]):
            if shared[place] == k:
                _named(forms, k, shared_from + place)
    for k in range(constraints.shape[0]):
        copy(bounded, k, forms, constraints[k])
    lean = balances.shape[0] > 0
    oldest, lost = 0, False
    own_symbol = outputs.shape[2] - 1
    for now in range(n):
        if stepwise:
            # The errors of the oldest sample that no line reads any more leave their symbols to those of this one.
            for k in range(rows.shape[0]):
                symbol = kept_from + (now % (depth + 1)) * rows.shape[0] + k
                _fold(flat, symbol)
                _fold(forms[once.shape[0] :], symbol)
        if lost:
            for k in range(rows.shape[0]):
                nothing_known(outputs[k], now)
            for k in range(links.shape[0]):
                if links[k, 1] == now:
                    nothing_known(linked, k)
            continue
        # Compute what the tape gives; states begin with their initial samples.
        signal = 0
        for k in range(each.shape[0]):
            to = once.shape[0] + k
            if each[k, 0] == _SOLUTION and each[k, 1] == 0:
                balanced = False
                if lean and now > 0:
                    _measured(ends, own_signals, row_channels, row_signals, data, noise, now)
                    balanced = mean_rates(
                        inner,
                        numbers,
                        once.shape[0] + each.shape[0],
                        sections,
                        integrated,
                        forms,
                        unknown,
                        past,
                        stage,
                        data,
                        noise,
                        now,
                        ends,
                        interval_length,
                        mean,
                    )
                    for i in range(integrated.shape[0]):
                        _keep(balances[i], now, mean, i)
                if balanced:
                    for i in range(integrated.shape[0]):
                        between(stage, i, ends[i, 0], ends[i, 1])
                else:
                    integrate(
                        inner,
                        numbers,
                        once.shape[0] + each.shape[0],
                        sections,
                        integrated,
                        forms,
                        unknown,
                        past,
                        stage,
                        data,
                        noise,
                        now,
                        defined_only,
                        interval_length,
                        substeps,
                    )
            operate(each[k], numbers[to], to, forms, unknown, past, stage, data, noise, now, defined_only, products)
            while signal < signals and defined[signal] <= to:
                own = defined[signal]
                if now < first[signal]:
                    place = initial[signal, now] if now < initial.shape[1] else NO_SAMPLE
                    if place >= 0:
                        copy(forms, own, unknown, place)
                    elif place == ZERO:
                        interval(forms, own, 0.0, 0.0)
                    else:
                        nothing_known(forms, own)
                signal += 1
        # Keep the rows.
        for k in range(rows.shape[0]):
            own, value = row_signals[k], data[row_channels[k], now]
            is_shown = own >= 0 and math.isfinite(value) and now >= first[own]
            if stepwise:
                _keep(outputs[k, :, :own_symbol], now, forms, rows[k])
                if is_shown:
                    reach = noise[row_channels[k]] * (1.0 + 4.0 * EPSILON) + EPSILON * abs(value)
                    _measured_less(outputs[k], now, forms, defined[own], value, reach)
                    _error(forms, defined[own], value, reach, kept_from + (now % (depth + 1)) * rows.shape[0] + k)
                continue
            _keep(outputs[k], now, forms, rows[k])
            # The state lies within the noise bound of its measurement.
            if is_shown:
                state, reach = defined[own], noise[row_channels[k]]
                lost = lost or (may_end and _is_lost(forms, state, kept_from, reach))
                if spread(forms, state) > anchor * reach:
                    interval(forms, state, value, reach)
                forms[state, LOW] = max(forms[state, LOW], value - reach * (1.0 + 4.0 * EPSILON) - EPSILON * abs(value))
                forms[state, HIGH] = min(
                    forms[state, HIGH], value + reach * (1.0 + 4.0 * EPSILON) + EPSILON * abs(value)
                )
        for k in range(links.shape[0]):
            if links[k, 1] == now:
                _keep(linked, k, forms, defined[links[k, 0]])
        # Remember: each radius becomes a symbol.
        for signal in range(signals):
            if remembered[signal]:
                own, place = defined[signal], now % (depth + 1)
                copy(past[signal], place, forms, own)
                if kept > 0 and not stepwise and past[signal, place, RADIUS] > 0.0:
                    symbol = kept_from + oldest
                    _fold(flat, symbol)
                    _fold(forms[once.shape[0] :], symbol)
                    _named(past[signal], place, symbol)
                    oldest = (oldest + 1) % kept
