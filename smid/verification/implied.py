"""Check that every constraint of a certificate follows from the model, the noise bounds and the samples."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from fractions import Fraction
from math import inf
from typing import Any

from relaxations.check.arithmetic import Interval, Polynomial, Terms, Work, product, value_range
from relaxations.check.forms import shown_name
from relaxations.check.read import Document
from smid.models.expressions import from_text
from smid.models.symbols import plain_symbols
from smid.verification.expressions import NotPolynomialError
from smid.verification.rows import Equations, Row, Samples, contains

_WORK, _ZERO = Work(1 << 62), Fraction(0)
Definitions = dict[int, Terms]  # auxiliary variable: the polynomial in parameters that it is


class NotProvenError(ValueError):
    """The proof does not hold, or its statement does not follow from the model and the data.

    Examples
    --------
    >>> raise NotProvenError("step 3: weight >= 0 fails: -1")
    Traceback (most recent call last):
    smid.verification.implied.NotProvenError: step 3: weight >= 0 fails: -1
    """


def check_implied(document: Document, model: Mapping[str, Any], samples: Samples, bounds: Any) -> int:
    """Return the number of equations in the certificate; all follow from the model and the samples.

    NotProvenError names the variable, equation or constraint that does not follow.
    """
    model = _of_parameters(model, document.stated.names)
    equations = Equations(model, samples, document.stated, document.box)
    auxiliary = _check_boxes(document, equations, bounds)
    try:
        expected = list(equations.rows())
        constraints = equations.constraints()
    except NotPolynomialError as error:
        raise NotProvenError(f"the proof does not fit the model: {error}") from None
    rows = [row or Polynomial() for row in document.stated.equalities]
    definitions = _definitions(rows, auxiliary, len(model["parameters"]))
    last = len(rows) - len(definitions)
    _check_equalities(rows[:last], expected, definitions)
    for k, row in enumerate(document.stated.inequalities):
        if not any(contains(row or Polynomial(), c) for c in _with_products(constraints, definitions)):
            raise NotProvenError(f"inequality {k} of the proof is not a constraint of the model")
    _check_latents(document, equations, expected)
    _check_kinks(document, equations)
    return last


def _of_parameters(model: Mapping[str, Any], names: list[str]) -> Mapping[str, Any]:
    """Return the lines and constraints that read no other parameters than those of a certificate.

    Of outputs that share nothing, a certificate may be about some. Without the other equations the set is larger.
    """
    others = model["parameters"].keys() - set(names)
    if not others:
        return model

    def reads_others(text: str | None) -> bool:
        return text is not None and bool(others & plain_symbols(from_text(text)))

    return {
        **model,
        "parameters": {name: ends for name, ends in model["parameters"].items() if name not in others},
        "lines": {name: text for name, text in model["lines"].items() if not reads_others(text)},
        "measurements": [m for m in model["measurements"] if not reads_others(m["inverse"])],
        "constraints": [text for text in model["constraints"] if not reads_others(text)],
    }


def _check_boxes(document: Document, equations: Equations, bounds: Mapping[str, str]) -> set[int]:
    """Check the boxes of parameters and noises; return the variables that the model does not have."""
    stated, box, parameters = document.stated, document.box, equations.model["parameters"]
    kinks = {kink.variable for kink in stated.kinks}
    noises = {m["noise"]: m["channel"] for m in equations.model["measurements"] if m["noise"] is not None}
    signals = {*equations.model["lines"], *(m["signal"] for m in equations.model["measurements"])}
    auxiliary = set()
    for v, name in enumerate(stated.names):
        base = name.split("[")[0]
        is_instance = "[" in name
        if name in parameters:
            wanted = prior_of(parameters[name])
        elif is_instance and base in noises:
            size = inf if name in equations.missing else Fraction(float.fromhex(bounds[noises[base]]))
            wanted = (-size, size)
        elif v in kinks:
            continue
        else:
            if not (is_instance and base in signals):
                auxiliary.add(v)
            continue
        if v in kinks:
            raise NotProvenError(f"the proof makes {shown_name(name)} a kink, which the model does not")
        if box[v] != wanted:
            raise NotProvenError(
                f"the box of {shown_name(name)} in the proof is not the one of the model or noise bound"
            )
    return auxiliary


def prior_of(ends: Sequence[str | None]) -> Interval:
    """Return the box of a parameter as a model states it."""
    low, high = ends
    return _end(low, -inf), _end(high, inf)


def _end(end: str | None, infinite: float) -> Fraction | float:
    return infinite if end is None else Fraction(float.fromhex(end))


def _definitions(rows: list[Polynomial], auxiliary: set[int], n_parameters: int) -> Definitions:
    """Read the definitions ``delta = D(p)`` of auxiliary variables from the last rows."""
    found: Definitions = {}
    for row in reversed(rows):
        own = [v for v in row.variables if v in auxiliary]
        if len(found) == len(auxiliary) or row.rad or len(own) != 1 or row.mid.get((own[0],)) != 1:
            break
        known = {m: -c for m, c in row.mid.items() if m != (own[0],) and c}
        if own[0] in found or any(v >= n_parameters for m in known for v in m):
            break
        found[own[0]] = known
    if len(found) < len(auxiliary):
        raise NotProvenError("the proof has a variable that the model does not have, and no equality defines it")
    return found


def _check_equalities(rows: list[Polynomial], expected: list[Row], definitions: Definitions) -> None:
    """Match the rows with the equations of the model, in order; a missing equation only enlarges the set.

    With auxiliary variables, the same equations follow once more, with delta in place of D(p).
    """
    exact: list[Terms] = [row.polynomial for row in expected]
    again = [_in_products(terms, definitions) for terms in exact] if definitions else []
    place = 0
    for k, row in enumerate(rows):
        found = _first_held(row, exact, place)
        if found is None and again:
            exact, again, place = again, [], 0
            found = _first_held(row, exact, place)
        if found is None:
            what = str(expected[place]) if place < len(expected) else "any equation of the model"
            raise NotProvenError(f"equality {k} of the proof is not {what}")
        place = found + 1


def _first_held(row: Polynomial, exact: list[Terms], start: int) -> int | None:
    """Return the place of the first polynomial, from start on, that a row of the proof holds."""
    return next((k for k in range(start, len(exact)) if contains(row, exact[k])), None)


def _in_products(exact: Terms, definitions: Definitions) -> Terms:
    """Return a polynomial with the same value wherever ``delta = D(p)``: without the first monomial of each D.

    Those that no other D has are taken. Whatever is put in place, the value stays the same.
    """
    parameters = {v for own in definitions.values() for m in own for v in m}
    for delta, own in definitions.items():
        others = {m for other, terms in definitions.items() if other != delta for m in terms}
        pivot = max((m for m in own if m not in others), key=lambda m: (len(m), m), default=None)
        if pivot is None:
            continue
        for m, c in list(exact.items()):
            if tuple(v for v in m if v in parameters) != pivot:
                continue
            rest = {tuple(v for v in m if v not in parameters): c / own[pivot]}
            put = product(rest, {(delta,): Fraction(1)} | {k: -size for k, size in own.items()}, _WORK)
            exact = {k: size for k in {*exact, *put} if (size := exact.get(k, _ZERO) + put.get(k, _ZERO))}
    return exact


def _with_products(constraints: list[Terms], definitions: Definitions) -> Iterator[Terms]:
    for exact in constraints:
        yield exact
        yield _in_products(exact, definitions)


def _check_latents(document: Document, equations: Equations, expected: list[Row]) -> None:
    """Check that a finite box of a latent signal follows from its bounds or the equation that gives it explicitly."""
    by_name: dict[str, list[Row]] = {}
    for row in expected:
        by_name.setdefault(equations.instance(row.signal, row.time, row.experiment), []).append(row)
    parameters, noises = equations.model["parameters"], {m["noise"] for m in equations.model["measurements"]}
    kinks = {kink.variable for kink in document.stated.kinks}

    def bounded(v: int) -> bool:
        name = document.stated.names[v]
        return name in parameters or name.split("[")[0] in noises or v in kinks

    for v, name in enumerate(document.stated.names):
        if bounded(v) or document.box[v] == (-inf, inf):
            continue
        stated = equations.model.get("bounds", {}).get(name.split("[")[0])
        ranges = [] if stated is None else [(_end(stated[0], -inf), _end(stated[1], inf))]
        for row in by_name.get(name, []):
            rest = {m: -c for m, c in row.polynomial.items() if m != (v,)}
            if row.polynomial.get((v,)) == 1 and all(bounded(w) for m in rest for w in m):
                ranges.append(value_range(Polynomial(rest), document.box, _WORK))
        low, high = document.box[v]
        if not (ranges and low <= max(a for a, _ in ranges) and min(b for _, b in ranges) <= high):
            raise NotProvenError(f"the box of {shown_name(name)} in the proof does not follow from the model")


def _check_kinks(document: Document, equations: Equations) -> None:
    """Check that every kink is one of the model, and that its box holds all of its values."""
    for n, kink in enumerate(document.stated.kinks):
        name = shown_name(document.stated.names[kink.variable])
        if n not in equations.used_kinks:
            raise NotProvenError(f"the proof has a kink {name} that the model does not have")
        low, high = document.box[kink.variable]
        if not (low <= -1 and high >= 1 if kink.sign else low <= 0 and high == inf):
            raise NotProvenError(f"the box of the kink {name} in the proof does not hold all of its values")
