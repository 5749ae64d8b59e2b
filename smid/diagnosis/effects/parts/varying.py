"""What varies in a plant: a parameter, ``p -> p + dp s``, or the time constant or gain of a state, with s of order one.

The *time constant* is divided by ``exp(c s)``: this factor, the pace, multiplies all that its line adds, ``w[t] =
w[t-1] + exp(c s) (f - w[t-1])``; the gain at rest stays.  Of a sampled lag with the pole p, whose steps need not be
short, it is ``(1 - p^m) / (1 - p)``, m the mean of ``exp(c s)`` while the sample passes: its pole is ``exp(-T / tau)``.
Where s depends on the state, the time q that the lag has gone on for obeys ``q' = exp(c s(q))`` and m = q(1), by one
step of the classical Runge-Kutta method (Hairer, Noersett and Wanner, Solving Ordinary Differential Equations I, II.1).
For a line of order two see `smid.diagnosis.effects.parts.stretched`.
The *gain* multiplies what drives the state and not its own past.  Both are positive factors, hence the exponential; dp
and c have the null value 0.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache, partial

import sympy

from smid.diagnosis.effects.effect import Extension, Site
from smid.diagnosis.effects.parts.extremes import larger
from smid.diagnosis.effects.parts.naming import fresh
from smid.diagnosis.effects.parts.plant import (
    StateLine,
    base_parameters,
    let_vary,
    magnitude,
    multiplied_out,
    state_lines,
    with_increment,
)
from smid.diagnosis.effects.parts.stretched import stretched
from smid.models import Model, Parameter
from smid.models.symbols import plain_symbols, references, swapped

__all__ = ["Varied", "extensions"]

_REACH, _START = 2.0, 0.03
_MOST = math.log(100.0)  # the factor on a pace or a gain, either way: cold oil or an empty line may slow by tens
_LEAST_POLE = 1e-3  # a lag has a positive one; what a fit tries on its way may not


# How far a lag has gone after a time, in samples, and the mean of four factors, by Runge and Kutta. Sympy would take
# seconds to multiply the expressions of a plant: they are put into these as they are.
_LEVEL, _POLE, _TIME, _INCREMENT = sympy.symbols("level pole time increment", real=True)
_WENT = (1 - _POLE**_TIME) / (1 - _POLE) * _INCREMENT
_FACTORS = sympy.symbols("factor:4", real=True)
_MEAN = (_FACTORS[0] + 2 * _FACTORS[1] + 2 * _FACTORS[2] + _FACTORS[3]) / 6

_SPOKEN = {"pace": "time constant", "gain": "gain"}


@dataclass(frozen=True)
class Varied:
    """What varies: a parameter, or the pace or gain of a state, and the parameter that is the amount."""

    name: str
    kind: str
    amount: str

    @property
    def what(self) -> str:
        """The beginning of a sentence; the name of a parameter is left as it is."""
        return self.name if self.kind == "parameter" else f"The {_SPOKEN[self.kind]} of {self.name}"

    def much(self, values: Mapping[str, float], times: float = 1.0) -> str:
        """Return by how much it varies.

        Examples
        --------
        >>> Varied("a1", "parameter", "a1_drift").much({"a1_drift": 0.25})
        'by +0.25'
        >>> Varied("w", "pace", "w_pace_drift").much({"w_pace_drift": 0.0})
        'by the factor 1'
        """
        amount = times * values[self.amount]
        if self.kind == "parameter":
            return f"by {amount:+.3g}"
        return f"by the factor {math.exp(-amount if self.kind == 'pace' else amount):.3g}"


def extensions(
    model: Model,
    suffix: str,
    vary: Callable[[int], sympy.Expr],
    describe: Callable[[Varied, Mapping[str, float], Site], str],
    label: str = "",
    *,
    shape: tuple[Parameter, ...] = (),
    places: tuple[Mapping[str, float], ...] = ({},),
    states_only: bool = False,
    parameters: bool = True,
    kinds: tuple[str, ...] = ("pace", "gain"),
) -> tuple[Extension, ...]:
    """Let each parameter of the plant vary in turn.

    Parameters
    ----------
    shape
        Further parameters, those of `vary`.
    """
    found = []
    for parameter in base_parameters(model) if parameters else ():
        size = magnitude(model, parameter)
        reach = _REACH * _largest_beside(model, parameter)
        amount = fresh(model, f"{parameter.name}_{suffix}", (-reach, reach), parameter.unit, 0.0)
        extended = let_vary(
            model,
            parameter,
            _moved(amount, vary),
            [amount, *shape],
            states_only=states_only,
        )
        if extended is None:
            continue
        # The smaller parameter first: a smaller pole is the stabler one.
        starts = tuple({amount.name: sign * _START * size, **place} for place in places for sign in (-1, 1))
        varied = Varied(parameter.name, "parameter", amount.name)
        named = f"{parameter.name} {label}".rstrip()
        found.append(Extension(extended, starts, named, describe=partial(describe, varied)))
    for state in state_lines(model):
        for kind in kinds:
            amount = fresh(model, f"{state.own}_{kind}_{suffix}", (-_MOST, _MOST), "", 0.0)
            factor: sympy.Expr = sympy.exp(amount.symbol * vary(state.lag))
            drive = state.drive
            if kind == "gain" and drive == 0:
                continue
            extended = stretched(model, state, partial(_whatever, factor), [amount, *shape]) if kind == "pace" else None
            if extended is None:
                grown = _quickened(state, factor) if kind == "pace" else state.increment + (factor - 1) * drive
                extended = with_increment(model, state, grown, [amount, *shape])
            starts = tuple({amount.name: sign * 0.1, **place} for place in places for sign in (-1, 1))
            varied, named = Varied(state.own, kind, amount.name), f"{kind} of {state.own} {label}".rstrip()
            found.append(Extension(extended, starts, named, describe=partial(describe, varied)))
        if parameters and state.order > 1 and not shape:
            found += _together(model, state, suffix, vary, describe, label)
    return tuple(found)


def _whatever(factor: sympy.Expr, _increment: sympy.Expr) -> sympy.Expr:
    return factor


def _quickened(state: StateLine, factor: sympy.Expr) -> sympy.Expr:
    """Return the increment, or rate, of a state whose pace is multiplied by a factor."""
    pole = 1 - state.leak
    rest = state.line.expression - pole * state.level
    is_lag = (
        not state.line.rate and pole != 0 and state.own not in {name for name, _ in references(multiplied_out(rest))}
    )
    if is_lag and plain_symbols(pole):
        known = {_LEVEL: state.level, _POLE: larger(_LEAST_POLE, pole), _INCREMENT: state.increment}

        def after(passed: sympy.Expr) -> sympy.Expr:
            """Return the factor after a lag of pace one has gone on for a time, in samples."""
            return swapped(factor, {state.level: swapped(_LEVEL + _WENT, {**known, _TIME: passed})})

        early = after(swapped(_TIME / 2, {_TIME: factor}))
        late = after(swapped(_TIME / 2, {_TIME: early}))
        mean = swapped(_MEAN, dict(zip(_FACTORS, (factor, early, late, after(late)), strict=True)))
        return swapped(_WENT, {**known, _TIME: mean})
    return factor * state.increment


def _together(
    model: Model,
    state: StateLine,
    suffix: str,
    vary: Callable[[int], sympy.Expr],
    describe: Callable[[Varied, Mapping[str, float], Site], str],
    label: str,
) -> list[Extension]:
    """Let all parameters of a line vary, each by its own amount: poles of order two move together when time does."""
    held = [p for p in base_parameters(model) if p.name in plain_symbols(state.line.expression)]
    extended, starts = model, dict[str, float]()
    for parameter in held:
        size = magnitude(model, parameter)
        reach = _largest_beside(model, parameter)
        amount = fresh(extended, f"{parameter.name}_{suffix}", (-reach, reach), parameter.unit, 0.0)
        moved = let_vary(extended, parameter, _moved(amount, vary), [amount], states_only=True)
        if moved is None:
            return []
        extended, starts = moved, {**starts, amount.name: 1e-3 * size}
    if len(held) < 2:
        return []
    first = Varied(held[0].name, "parameter", next(iter(starts)))
    named = f"all of {state.own} {label}".rstrip()
    return [Extension(extended, (starts,), named, describe=partial(describe, first))]


def _largest_beside(model: Model, parameter: Parameter) -> float:
    """Return the largest magnitude of the parameters with the same factor: it limits one that is near zero."""
    same = [q for q in base_parameters(model) if _factors(model, q) == _factors(model, parameter)]
    return max(abs(magnitude(model, q)) for q in same)


def _factors(model: Model, parameter: Parameter) -> frozenset[str]:
    """Name the signals that a parameter is multiplied by."""
    return frozenset().union(*(_beside(parameter.symbol, line.expression) for line in model.lines))


@cache
def _beside(symbol: sympy.Symbol, node: sympy.Expr) -> frozenset[str]:
    """Name the signals in the slope of an expression: sympy takes minutes to write the slope of a nested one out."""
    if node == symbol or symbol not in node.free_symbols:
        return frozenset()
    holding = [argument for argument in node.args if symbol in argument.free_symbols]
    if node.is_Add:
        return frozenset().union(*(_beside(symbol, argument) for argument in holding))
    if node.is_Mul and len(holding) == 1:
        others = (name for argument in node.args if argument is not holding[0] for name, _ in references(argument))
        return _beside(symbol, holding[0]).union(others)
    return frozenset(name for name, _ in references(node))


def _moved(amount: Parameter, vary: Callable[[int], sympy.Expr]) -> Callable[[sympy.Symbol, int], sympy.Expr]:
    return lambda symbol, lag: symbol + amount.symbol * vary(lag)
