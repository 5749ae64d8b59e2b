"""One dynamic equation of a model as a template, expanded once by sympy and stamped over all samples by NumPy.

Each line that defines a state or a measured signal becomes an equality. A measured signal is replaced by "measurement
minus noise" (or the sensor's inverse curve of it), static lines are substituted, and other signals stay latent. The
result is a polynomial in parameters and latents, with coefficients that are polynomials in the data. Each coefficient
is evaluated over all samples at once, in ball arithmetic.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass
from fractions import Fraction
from functools import lru_cache, reduce

import numpy as np
import sympy
from sympy.core.function import Application

from relaxations.algebra.arrays import Array, Index
from relaxations.algebra.ball_arithmetic import Balls
from smid.feasible.piecewise_functions import KINKS, Kink, unfold
from smid.models import Line, Measurement, Model, ModelError
from smid.models.hidden_states import first_instants, without_hidden_states
from smid.models.symbols import VALUE, inlined, references, signal, t

Reference = tuple[str, int]  # (signal or channel, lag)
_NO_POLYNOMIAL = (
    "the line of {name!r} is not a polynomial in its parameters, noises and samples: intervals need one; write it with "
    "polynomials, Max, Min, Abs and sign, or give method='inversion'"
)
_MOST_TERMS = 20_000
_TOO_LONG = (
    f"a line of the model has more than {_MOST_TERMS} terms when it is multiplied out: give method='inversion', or "
    "choose a simpler scheme"
)
MOST_SUMMANDS = 24  # floats: over a thousand bits


class NotPolynomialError(ModelError):
    """A line is no polynomial with fractions as coefficients."""


@dataclass(frozen=True)
class Term:
    """One monomial of a template, in parameters and latents with repetition.

    ``data`` is its coefficient: a sum of rational multiples of products of samples.
    """

    parameters: tuple[str, ...]
    latents: tuple[Reference, ...]
    data: tuple[tuple[Fraction, tuple[tuple[str, int, int], ...]], ...]

    def coefficients(self, channels: Mapping[str, Array], times: Index) -> Balls:
        """Return the coefficient at each of ``times``, shape (len(times),)."""
        parts = []
        for factor, powers in self.data:
            product = Balls.exact(np.ones(len(times)))
            for channel, lag, power in powers:
                product = product * Balls.exact(channels[channel][times - lag]) ** power
            constant = Balls.enclose(factor)
            parts.append(product * Balls(np.full(len(times), constant.mid), np.full(len(times), constant.rad)))
        return reduce(Balls.__add__, parts)

    def expansions(self, channels: Mapping[str, Array], times: Index) -> tuple[Index, Balls]:
        """Return each coefficient as a sum of floats, in two arrays: the place in ``times``, and the summand.

        The summands are exact floats. Where the sum does not end (a third, for example), a last ball encloses the rest.
        """
        samples = [
            (factor, [(channels[c][times - lag].tolist(), power) for c, lag, power in powers])
            for factor, powers in self.data
        ]
        which, mids, rads = [], [], []
        for k in range(len(times)):
            rest = sum(
                (math.prod((Fraction(v[k]) ** power for v, power in powers), start=f) for f, powers in samples),
                start=Fraction(0),
            )
            for _ in range(MOST_SUMMANDS):
                which.append(k)
                mids.append(float(rest))
                rest -= Fraction(mids[-1])
                rads.append(0.0)
                if not rest:
                    break
            else:
                rads[-1] = math.nextafter(abs(float(rest)), math.inf)
        return np.array(which, dtype=np.int64), Balls(np.array(mids), np.array(rads))


@dataclass(frozen=True)
class Template:
    """The equality of one signal's line.

    ``defines`` tells whether it gives the latent ``signal`` explicitly, in terms of parameters, noises and data only.
    """

    signal: str
    terms: tuple[Term, ...]
    max_lag: int
    defines: bool = False

    @property
    def latents(self) -> frozenset[Reference]:
        """Return the latents that occur, each with its lag."""
        return frozenset(reference for term in self.terms for reference in term.latents)

    @property
    def samples(self) -> frozenset[Reference]:
        """Return the channels that are read, each with its lag."""
        return frozenset((channel, lag) for term in self.terms for _, powers in term.data for channel, lag, _ in powers)


@dataclass(frozen=True)
class Hinge:
    """A kink whose argument has been expanded; the argument is not an equality."""

    kink: Kink
    argument: Template


@dataclass(frozen=True)
class Templates:
    """A model's templates and its expanded kinks: the symbolic part of the problem, made once."""

    model: Model
    lines: tuple[Template, ...]
    hinges: Mapping[str, Hinge]

    @staticmethod
    @lru_cache(maxsize=64)  # long records ask for many windows
    def of(model: Model) -> Templates:
        """Return the templates of a model; ModelError as from :func:`templates` and :func:`hinges`."""
        found = {hinge.kink.name: hinge for hinge in hinges(model)}
        return Templates(model, templates(model), found)


def is_polynomial(model: Model) -> bool:
    """Return whether the lines are polynomials with fractions as coefficients, but for kinks.

    >>> from smid import OwnModel
    >>> is_polynomial(OwnModel(["h[t] = h[t-1] - c*sqrt(h[t-1])"], ["h"], [], {"c": (0, 1)}))
    False
    """
    if model.enclosed:
        return False
    lines = model.discretised().lines
    if any(_is_curved(line.expression) for line in lines):  # sympy would take minutes of a long line to find this
        return False
    try:
        Templates.of(model)
    except NotPolynomialError:
        return False
    return True


def _is_curved(expression: sympy.Expr) -> bool:
    """Return whether an expression holds a function that is no kink, or a power that is not whole."""
    functions, powers = expression.atoms(Application), expression.atoms(sympy.Pow)
    return not all(isinstance(f, KINKS) for f in functions) or not all(power.exp.is_Integer for power in powers)


def templates(model: Model) -> tuple[Template, ...]:
    """Return a model's lines as templates; they read the signals of :func:`hinges` where the lines have kinks.

    ModelError if a line is not a polynomial in parameters, noises, latent signals and kinks.
    """
    if model.enclosed:
        raise NotPolynomialError(
            f"the scheme {model.scheme!r} of model {model.name!r} is about its differential equation, which has no "
            "polynomials: give method='inversion', or choose another scheme"
        )
    first, model = first_instants(model), without_hidden_states(model)
    kept, static = _split(model)
    curved = _curved_sensors(model)
    dynamic = {*model.states, *(m.signal for m in model.measurements)}
    depths = {hinge.kink.name: hinge.argument.max_lag for hinge in hinges(model)}
    lines = [
        _template(
            model,
            line.signal,
            inlined(line.target - line.expression, static),
            curved,
            depths,
            line.signal not in dynamic,
            first.get(line.signal, 0),
        )
        for line in kept
    ]
    sensors = [
        _template(
            model,
            m.signal,
            signal(m.signal)[t] - _seen(m, signal(m.channel)[t], signal(m.noise)[t]),
            curved,
            depths,
            True,
        )
        for m in model.measurements
        if m.noise is not None and m.signal in curved
    ]
    return (*lines, *sensors)


def hinges(model: Model) -> tuple[Hinge, ...]:
    """Return the expanded arguments of a model's kinks, each after those that it reads.

    ModelError if an argument is not a polynomial in parameters, noises, latent signals and earlier kinks.
    """
    model = without_hidden_states(model)
    _, static = _split(model)
    curved = _curved_sensors(model)
    depths: dict[str, int] = {}
    found = []
    for kink in unfold(model).kinks:
        argument = _template(model, kink.name, inlined(kink.argument, static), curved, depths, False)
        depths[kink.name] = argument.max_lag
        found.append(Hinge(kink, argument))
    return tuple(found)


def flat_lines(model: Model) -> tuple[sympy.Expr, ...]:
    """Return ``target - expression`` of each dynamic line, with the static lines put in and kinks by name."""
    kept, static = _split(without_hidden_states(model))
    return tuple(inlined(line.target - line.expression, static) for line in kept)


def _split(model: Model) -> tuple[list[Line], dict[str, sympy.Expr]]:
    """Return the lines that become equalities, and the static lines by signal.

    A static line that bends a noisy input becomes an equality of a latent signal. Substituted into the dynamics, it
    would raise their degree, and with it the order of every relaxation.
    """
    defined = {line.signal for line in model.lines}
    dynamic = {*model.states, *(m.signal for m in model.measurements)}
    noisy = {m.signal for m in model.measurements if m.noise is not None and m.signal not in defined}
    kept: list[Line] = []
    static: dict[str, sympy.Expr] = {}
    for line in unfold(model).lines:
        if line.signal in dynamic or _bends(inlined(line.expression, static), noisy):
            kept.append(line)
        else:
            static[line.signal] = line.expression
    return kept, static


def _bends(expression: sympy.Expr, noisy: set[str]) -> bool:
    """Tell whether an expression has degree two or more in noisy inputs."""
    atoms = [signal(name)[t - lag] for name, lag in references(expression) if name in noisy]
    return bool(atoms) and expression.is_polynomial(*atoms) and sympy.Poly(expression, *atoms).total_degree() > 1


def _curved_sensors(model: Model) -> frozenset[str]:
    """Return the measured signals whose sensor curve is nonlinear in the noise: each stays latent, with an equality."""
    return frozenset(
        m.signal
        for m in model.measurements
        if m.inverse is not None and m.noise is not None and sympy.degree(m.inverse, VALUE) > 1
    )


def _seen(measurement: Measurement, value: sympy.Expr, noise: sympy.Expr | None) -> sympy.Expr:
    """Return the signal behind a measured value and its noise."""
    plain = value if noise is None else value - noise
    return plain if measurement.inverse is None else measurement.inverse.xreplace({VALUE: plain})


def _template(
    model: Model,
    target: str,
    expression: sympy.Expr,
    curved: frozenset[str],
    depths: Mapping[str, int],
    defines: bool,
    first: int = 0,
) -> Template:
    """Return one expression as a template; ``curved`` signals stay latent although they are measured.

    ``depths`` is the largest lag of each kink's argument; the line holds from sample ``first`` on.
    """
    measured = {m.signal: m for m in model.measurements if m.signal not in curved}
    hidden = {line.signal for line in model.lines} | {m.noise for m in model.measurements} | curved | {*depths}
    replacements: dict[sympy.Expr, sympy.Expr] = {}
    data: dict[sympy.Symbol, Reference] = {}
    latent: dict[sympy.Symbol, Reference] = {}

    def symbol(table: dict[sympy.Symbol, Reference], name: str, lag: int) -> sympy.Symbol:
        made = sympy.Symbol(f"{name}__{lag}", real=True)
        table[made] = (name, lag)
        return made

    # Replace each signal by what was measured, by a latent or by data.
    for name, lag in sorted(references(expression)):
        atom = signal(name)[t - lag]
        measurement = measured.get(name)
        if measurement is not None:
            noise = None if measurement.noise is None else symbol(latent, measurement.noise, lag)
            replacements[atom] = _seen(measurement, symbol(data, measurement.channel, lag), noise)
        elif name in hidden:
            replacements[atom] = symbol(latent, name, lag)
        else:
            replacements[atom] = symbol(data, name, lag)
    flat = expression.xreplace(replacements)
    # A parameter may stand for a quotient that cancels. With exponentials no quotient does, and the search for common
    # factors can exhaust the integers of the computer, which ends Python.
    if any(power.exp.is_negative for power in flat.atoms(sympy.Pow)) and not flat.has(sympy.Function):
        if _keeps_denominator(flat):
            raise NotPolynomialError(_NO_POLYNOMIAL.format(name=target))
        flat = sympy.cancel(flat)
    # The unknowns are the parameters that occur, and the latents.
    names = [*(p.name for p in model.parameters), *depths]
    symbols = {sympy.Symbol(name, real=True): name for name in names}
    parameters = {s: name for s, name in symbols.items() if s in flat.free_symbols}
    unknowns = [*parameters, *sorted(latent, key=str)]
    lags = [lag + depths.get(name, 0) for name, lag in (*data.values(), *latent.values())]
    terms = _terms(target, flat, unknowns, parameters, latent, data)
    return Template(target, terms, max([first, *lags]), defines)


def _keeps_denominator(flat: sympy.Expr) -> bool:
    """Return whether some quotients of an expression surely do not cancel, in a short time.

    A polynomial stays one in each symbol if numbers are put in for the others.
    """
    powers = (power for power in flat.atoms(sympy.Pow) if power.exp.is_negative)
    divisors = sorted({symbol for power in powers for symbol in power.base.free_symbols}, key=str)
    for own in divisors:
        numbers = {
            other: sympy.Rational(2 * k + 101, k + 97)
            for k, other in enumerate(sorted(flat.free_symbols - {own}, key=str))
        }
        with suppress(sympy.CoercionFailed, ZeroDivisionError, NotImplementedError):
            if not sympy.QQ.frac_field(own).from_sympy(flat.xreplace(numbers)).denom.is_ground:
                return True
    return False


def _written_out(expression: sympy.Expr, known: dict[sympy.Expr, int]) -> int:
    """Return the number of terms of an expression that is multiplied out, before equal ones are put together."""
    if expression not in known:
        own = [_written_out(part, known) for part in expression.args]
        if expression.is_Add:
            known[expression] = sum(own)
        elif expression.is_Pow and expression.exp.is_Integer and expression.exp > 0:
            power = int(expression.exp)
            known[expression] = math.comb(own[0] + power - 1, power)
        else:
            known[expression] = math.prod(own)
    return known[expression]


def _terms(
    name: str,
    flat: sympy.Expr,
    unknowns: list[sympy.Symbol],
    parameters: Mapping[sympy.Symbol, str],
    latent: Mapping[sympy.Symbol, Reference],
    data: Mapping[sympy.Symbol, Reference],
) -> tuple[Term, ...]:
    if _written_out(flat, {}) > _MOST_TERMS:  # sympy would take minutes
        raise NotPolynomialError(_TOO_LONG)
    # Expand into one polynomial with rational coefficients, or name the cause.
    known = sorted(data, key=str)
    try:
        poly = sympy.Poly(flat, *unknowns, *known, domain="QQ")
    except (sympy.PolynomialError, sympy.CoercionFailed):
        constants = (
            part for part in sympy.preorder_traversal(flat) if part.is_real and part.is_number and not part.is_rational
        )
        constant = next(constants, None)
        if constant is not None:
            near = float(constant)
            raise NotPolynomialError(
                f"the line of {name!r} holds {constant}, which is not a fraction: proofs need exact numbers; "
                f"put a parameter in its place, with the box ({np.nextafter(near, -np.inf)!s}, "
                f"{np.nextafter(near, np.inf)!s})"
            ) from None
        raise NotPolynomialError(_NO_POLYNOMIAL.format(name=name)) from None
    # Group the monomials by their unknowns; the rest of each is a product of samples.
    split = len(unknowns)
    grouped: dict[tuple[int, ...], list[tuple[Fraction, tuple[tuple[str, int, int], ...]]]] = {}
    for exponents, value in poly.terms():
        samples = tuple((*data[s], e) for s, e in zip(known, exponents[split:], strict=True) if e)
        grouped.setdefault(exponents[:split], []).append((Fraction(int(value.p), int(value.q)), samples))
    terms = []
    for exponents, parts in grouped.items():
        repeated = [s for s, e in zip(unknowns, exponents, strict=True) for _ in range(e)]
        terms.append(
            Term(
                tuple(parameters[s] for s in repeated if s in parameters),
                tuple(latent[s] for s in repeated if s in latent),
                tuple(parts),
            )
        )
    return tuple(terms)
