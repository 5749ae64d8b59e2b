"""Read a run certificate: the statement, then the boxes one after the other."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from fractions import Fraction
from math import inf
from typing import Any

from relaxations.check.arithmetic import Interval, Unreadable, Work
from relaxations.check.forms import Reader, excerpt, read_name, shown_name
from relaxations.check.runs.affine import LARGEST, Range, between
from relaxations.check.runs.fixed import ONE, above, below
from relaxations.check.runs.modulated import Modulation
from relaxations.check.runs.narrowing import Bounded, Compared, Shaved, Step
from relaxations.check.runs.proof import Node, Pass, Side
from relaxations.check.runs.run import BALANCES, CONSTRAINT, FACTORS, LINKS, PRODUCT, STEPWISE, Source
from relaxations.check.runs.statement import Measured, Piece, Samples, Stated
from relaxations.check.runs.tape import Tape
from relaxations.check.runs.terms import Terms

FORMAT = "relaxations run certificate"
VERSION = 1

MOST_SAMPLES = 1 << 24
MOST_KEPT = 1 << 10
MOST_UNKNOWNS = 10_000
MOST_STEPS = 1 << 10
LONGEST_TEXT = 200_000
LARGEST_SHIFT = 1 << 11
WORK = 200_000_000
"""Slopes of forms that may be computed for every file; a minute or so."""
WORK_OF_RATES = 10 * WORK
"""The same for a file whose rates are integrated."""
WORK_FOR_A_NUMBER = 30_000
"""And for each number of a proof."""

_LONGEST_INTERVAL = 1 << 40  # seconds

Claim = Mapping[str, Interval]


@dataclass(frozen=True)
class Document:
    """A run certificate.

    Parameters
    ----------
    content
        Of the file.
    priors
        Ends of each parameter.
    claim
        Proven ends of each parameter; None: the set is empty.
    narrowing, nodes
        Each is read when it is checked.
    """

    stated: Stated
    content: Mapping[str, Any]
    priors: Claim
    claim: Claim | None
    narrowing: Iterator[Step]
    nodes: Iterator[Node]


def is_run(content: Any) -> bool:
    """Return whether a file's content says that it is a run certificate."""
    return isinstance(content, dict) and content.get("format") == FORMAT


def document(content: Any) -> Document:
    """Return the statement and the boxes of a file's content."""
    # Format, version and keys.
    if not is_run(content):
        raise Unreadable(f"the file is not a certificate: its 'format' is not {FORMAT!r}")
    if content.get("version") != VERSION or isinstance(content["version"], bool):
        raise Unreadable(f"the version is {excerpt(content.get('version'))}, this program checks version {VERSION}")
    reader = Reader(0, Work(0))
    keys = (
        "format",
        "version",
        "model",
        "noise_bounds",
        "first",
        "initial",
        "experiments",
        "symbols",
        "claim",
        "boxes",
    )
    file = reader.fields(content, "the file", keys, ("origin", "pieces", "steps", "narrowing", "products"))
    model = reader.fields(
        file["model"],
        "model",
        ("name", "parameters", "lines", "measurements", "constraints"),
        ("bounds", "rates", "interval"),
    )
    try:
        stated = _stated(reader, file, model)
    except RecursionError:
        raise Unreadable("an expression of the model is nested too deeply") from None
    reader.count = len(stated.unknowns)
    priors = _claim(reader, model["parameters"], stated, "the box of")
    claim = None if file["claim"] is None else _claim(reader, file["claim"], stated, "the claim on")
    narrowing = _narrowing(reader, reader.items(file.get("narrowing", []), "narrowing"), stated)
    nodes = _nodes(reader, reader.items(file["boxes"], "boxes"), stated)
    return Document(stated, file, priors, claim, narrowing, nodes)


def _stated(reader: Reader, file: dict[str, Any], model: dict[str, Any]) -> Stated:
    parameters = {
        name: _ends(reader, pair, f"the box of {shown_name(name)}")
        for name, pair in _named(model["parameters"], "parameters").items()
    }
    if not parameters:
        raise Unreadable("the model has no parameters: nothing is claimed")
    confused = sorted({"pi", "E", "value"} & parameters.keys())
    if confused:
        raise Unreadable(f"a parameter is called {confused[0]}, which stands for something else")
    rates, lines = _named(model.get("rates", {}), "rates"), _named(model["lines"], "lines")
    both = sorted(rates.keys() & lines.keys())
    if both:
        raise Unreadable(f"{excerpt(both[0])} has a rate, and a line defines it")
    interval, steps = _interval(reader, file, model) if rates else (Fraction(0), 1)
    bounds = {
        name: reader.number(value, f"the noise bound of {shown_name(name)}")
        for name, value in _named(file["noise_bounds"], "noise_bounds").items()
    }
    measurements = [
        _Measurement.of(reader, value, bounds, f"measurement {k}")
        for k, value in enumerate(reader.items(model["measurements"], "measurements"))
    ]
    work = Work(WORK_OF_RATES if rates else WORK)
    records = [_Run.of(reader, value) for value in reader.items(file["experiments"], "experiments")]
    if not records:
        raise Unreadable("there are no experiments")
    # Operations: signals that a measurement defines, then the lines in their order, then the rows.
    defined = (*rates, *lines)
    taken = {*defined, *(m.signal for m in measurements)}
    exact = frozenset.intersection(*(frozenset(run.channels) for run in records)) - taken
    tape = Tape({name: k for k, name in enumerate(parameters)}, exact)
    conditions = reader.items(model["constraints"], "constraints")
    constraints = tuple(tape.constraint(_text(text, f"constraint {k}")) for k, text in enumerate(conditions))
    first = {}
    for k, m in enumerate(measurements):
        if m.signal not in defined and m.signal not in first:
            tape.define(m.signal, tape.shown(k, m.inverse))
            first[m.signal] = 0
    starts = reader.fields(file["first"], "first", defined)
    texts = {name: _text(text, f"the line of {shown_name(name)}") for name, text in (*rates.items(), *lines.items())}
    longest = tape.integrated({name: texts[name] for name in rates})
    for name in defined:
        lag = longest if name in rates else tape.line(name, texts[name])
        first[name] = reader.index(starts[name], f"the first sample of {shown_name(name)}", MOST_SAMPLES)
        if first[name] < lag:
            raise Unreadable(f"the line of {shown_name(name)} reads {lag} samples back, before its first sample")
    undefined = sorted(tape.lags.keys() - tape.now.keys())
    if undefined:
        raise Unreadable(f"a line reads the signal {excerpt(undefined[0])}, which neither a line nor a channel defines")
    measured = [
        Measured(
            m.signal,
            tape.less(tape.now[m.signal], tape.shown(k, m.inverse)) if m.signal in defined else None,
            tape.now[m.signal] if m.signal in defined and m.inverse is None else None,
            within=False,
        )
        for k, m in enumerate(measurements)
    ]
    # A signal between two ends is measured as that at every sample.
    between_ends = {
        name: between(*_ends(reader, pair, f"the bounds of {shown_name(name)}"))
        for name, pair in _named(model.get("bounds", {}), "bounds").items()
    }
    for name in between_ends:
        if name not in defined:
            raise Unreadable(f"{excerpt(name)} has bounds, and no line defines it")
        own = tape.now[name]
        measured.append(Measured(name, tape.less(own, tape.shown(len(measured), None)), own, within=True))
    noises = [above(m.bound) for m in measurements]
    noises += [form.radius if isinstance(form.radius, int) else LARGEST for form in between_ends.values()]
    # The samples of each experiment.
    shown, exactly = list[tuple[Samples, ...]](), list[dict[str, Samples]]()
    for run in records:
        missing = [m.channel for m in measurements if m.channel not in run.channels]
        if missing:
            raise Unreadable(f"experiment {shown_name(run.name)} has no samples of {shown_name(missing[0])}")
        work.spend(10 * run.count * (len(measured) + len(exact)))
        within: list[Samples] = [[form] * run.count for form in between_ends.values()]
        shown.append((*(_samples(run.channels[m.channel], m.bound) for m in measurements), *within))
        exactly.append({name: _samples(run.channels[name], Fraction(0)) for name in exact})
    # The unknowns: parameters, and of each piece the samples of remembered signals before the first that a line gives.
    initial = _initial(reader, file["initial"], first, records)
    names, box = list(parameters), list(parameters.values())
    begins: dict[tuple[int, str, int], int] = {}
    pieces = []
    for e, start, stop in _pieces(reader, file, records):
        work.spend(10 * (stop - start) * (len(measured) + len(exact)))
        part = slice(start, stop)
        places = {}
        for name in (name for name in defined if name in tape.lags):
            unknown = min(first[name], stop - start)
            if len(names) + unknown > MOST_UNKNOWNS:
                raise Unreadable(f"there are more than {MOST_UNKNOWNS} unknowns, the limit of this program")
            for now in range(start, start + unknown):
                seen = [
                    own[now]
                    for m, own in zip(measured, shown[e], strict=True)
                    if m.signal == name and m.defined is not None
                ]
                known = [*((form.low, form.high) for form in seen if form), *initial.get((e, name, now), [])]
                places[name, now - start] = begins[e, name, now] = len(names)
                names.append(f"{name}[{now}]" if len(records) == 1 else f"{name}[{now}] of {records[e].name}")
                box.append((max([-inf, *(low for low, _ in known)]), min([inf, *(high for _, high in known)])))
        exact_part = {name: samples[part] for name, samples in exactly[e].items()}
        pieces.append(Piece(e, start, stop - start, exact_part, tuple(own[part] for own in shown[e]), places))
    kept = reader.index(file["symbols"], "symbols", MOST_KEPT + 1)
    products = _products(reader, reader.items(file.get("products", []), "products"), len(names))
    return Stated(
        tuple(parameters),
        tuple(names),
        tuple(box),
        tape,
        first,
        tuple(measured),
        tuple(noises),
        constraints,
        tuple(rates),
        interval,
        steps,
        defined,
        {run.name: run.count for run in records},
        tuple(pieces),
        tuple(Piece(e, 0, run.count, exactly[e], shown[e], {}) for e, run in enumerate(records)),
        Terms.of({name: texts[name] for name in rates}, tape.parameters, list(parameters.values()), exact),
        begins,
        kept,
        products,
        work,
    )


def _interval(reader: Reader, file: Mapping[str, Any], model: Mapping[str, Any]) -> tuple[Fraction, int]:
    """Return the seconds between two samples, and the number of steps in them."""
    interval = reader.number(model.get("interval"), "the interval")
    steps = reader.index(file.get("steps"), "the number of steps", MOST_STEPS + 1)
    if interval <= 0 or not steps:
        raise Unreadable("rates need an interval between samples, and steps in it")
    return interval, steps


@dataclass(frozen=True)
class _Measurement:
    """A channel, the signal that it measures with what noise, and the text of its inverse."""

    channel: str
    signal: str
    bound: Fraction
    inverse: str | None

    @staticmethod
    def of(reader: Reader, value: Any, bounds: Mapping[str, Fraction], where: str) -> _Measurement:
        fields = reader.fields(value, where, ("channel", "signal", "noise", "inverse"))
        channel, signal = read_name(fields["channel"], where), read_name(fields["signal"], where)
        if fields["noise"] is not None and channel not in bounds:
            raise Unreadable(f"{where} has a noise without a bound")
        bound = Fraction(0) if fields["noise"] is None else bounds[channel]
        if bound < 0:
            raise Unreadable(f"{where}: the noise bound is negative")
        inverse = fields["inverse"]
        return _Measurement(channel, signal, bound, None if inverse is None else _text(inverse, where))


@dataclass(frozen=True)
class _Run:
    """The samples of one experiment."""

    name: str
    count: int
    channels: dict[str, list[Fraction | None]]

    @staticmethod
    def of(reader: Reader, value: Any) -> _Run:
        fields = reader.fields(value, "an experiment", ("name", "samples", "channels"))
        count = reader.index(fields["samples"], "the number of samples", MOST_SAMPLES)
        channels = {
            name: [None if y is None else reader.number(y, f"a sample of {shown_name(name)}") for y in own]
            for name, samples in _named(fields["channels"], "channels").items()
            for own in [reader.items(samples, f"the samples of {shown_name(name)}", count)]
        }
        return _Run(read_name(fields["name"], "the name of an experiment"), count, channels)


def _initial(
    reader: Reader, value: Any, first: Mapping[str, int], records: list[_Run]
) -> dict[tuple[int, str, int], list[Range]]:
    """Return the initial samples that are stated, by experiment, signal and sample."""
    found: dict[tuple[int, str, int], list[Range]] = {}
    for entry in reader.items(value, "initial"):
        experiment, name, sample, *ends = reader.items(entry, "an initial sample", 5)
        e = reader.index(experiment, "the experiment of an initial sample", len(records))
        if not isinstance(name, str) or name not in first:
            raise Unreadable(f"an initial sample of {excerpt(name)}, which is no signal of the model")
        now = reader.index(sample, f"the initial sample of {shown_name(name)}", max(first[name], 1))
        found.setdefault((e, name, now), []).append(_ends(reader, ends, f"the initial sample of {shown_name(name)}"))
    return found


def _products(reader: Reader, pairs: list[Any], unknowns: int) -> dict[tuple[int, int], int]:
    """Return the symbol of each product of two unknowns."""
    if len(pairs) > MOST_UNKNOWNS:
        raise Unreadable(f"there are more than {MOST_UNKNOWNS} products, the limit of this program")
    found: dict[tuple[int, int], int] = {}
    for number, value in enumerate(pairs):
        j, k = (reader.index(own, f"product {number}", unknowns) for own in reader.items(value, "a product", 2))
        if j > k or (j, k) in found:
            raise Unreadable(f"product {number} is stated twice, or its first unknown is not the smaller one")
        found[j, k] = unknowns + number
    return found


def _pieces(reader: Reader, file: Mapping[str, Any], records: list[_Run]) -> Iterator[tuple[int, int, int]]:
    """Yield the experiment of each piece, its first sample, and the one after its last."""
    if "pieces" not in file:
        yield from ((e, 0, run.count) for e, run in enumerate(records))
        return
    for value in reader.items(file["pieces"], "pieces"):
        experiment, first, stop = reader.items(value, "a piece", 3)
        e = reader.index(experiment, "the experiment of a piece", len(records))
        end = reader.index(stop, "the end of a piece", records[e].count + 1)
        yield e, reader.index(first, "the first sample of a piece", end + 1), end


def _samples(values: list[Fraction | None], bound: Fraction) -> Samples:
    return [None if y is None else between(below(y - bound), above(y + bound)) for y in values]


def _named(value: Any, where: str) -> dict[str, Any]:
    """Return an object whose keys are names."""
    if not isinstance(value, dict):
        raise Unreadable(f"{where} is not an object")
    return {read_name(name, where): entry for name, entry in value.items()}


def _text(value: Any, where: str) -> str:
    if not isinstance(value, str) or len(value) > LONGEST_TEXT:
        raise Unreadable(f"{where} is not a text of at most {LONGEST_TEXT} characters")
    return value


def _exact_ends(reader: Reader, value: Any, where: str) -> Interval:
    low, high = reader.ends(value, where)
    if low > high:
        raise Unreadable(f"{where}: the lower end is above the upper one")
    return low, high


def _ends(reader: Reader, value: Any, where: str) -> Range:
    """Return ends in units, rounded outwards."""
    low, high = _exact_ends(reader, value, where)
    return below(low) if isinstance(low, Fraction) else -inf, above(high) if isinstance(high, Fraction) else inf


# ---------------------------------------------------------------- what is claimed, and the boxes


def _claim(reader: Reader, value: Any, stated: Stated, what: str) -> Claim:
    """Return ends of each parameter."""
    pairs = reader.fields(value, "the claim", stated.parameters)
    return {name: _exact_ends(reader, pairs[name], f"{what} {shown_name(name)}") for name in stated.parameters}


def _narrowing(reader: Reader, steps: list[Any], stated: Stated) -> Iterator[Step]:
    for number, value in enumerate(steps):
        where = f"step {number} of the narrowing"
        if stated.interval > _LONGEST_INTERVAL or (stated.interval * ONE).denominator > 1:
            raise Unreadable(f"{where}: the time between samples is too long, or no whole number of units")
        if any(stated.first[name] != 1 for name in stated.rates):
            raise Unreadable(f"{where}: a rate reads more than one sample back")
        yield _step(reader, value, stated, where)


def _step(reader: Reader, value: Any, stated: Stated, where: str) -> Step:
    if isinstance(value, dict) and "cut" in value:
        fields = reader.fields(value, where, ("cut", "steps"))
        parameter, end, sign = reader.items(fields["cut"], where, 3)
        k = reader.index(parameter, where, len(stated.parameters))
        steps = [_plain_step(reader, own, stated, where) for own in reader.items(fields["steps"], where)]
        return Shaved(k, _limited(reader.number(end, where), where), reader.side(sign, where), steps)
    return _plain_step(reader, value, stated, where)


def _plain_step(reader: Reader, value: Any, stated: Stated, where: str) -> Compared | Bounded:
    if isinstance(value, dict) and "compare" in value:
        fields = reader.fields(value, where, ("compare", "edges", "upper", "lower"))
        e, i = _state(reader, reader.items(fields["compare"], where, 2), stated, where)
        edges = [_limited(reader.number(edge, where), where) for edge in reader.items(fields["edges"], where)]
        upper, lower = (_values(reader, fields[name], stated.runs[e].count, where) for name in ("upper", "lower"))
        return Compared(e, i, edges, upper, lower)
    fields = reader.fields(value, where, ("bound",))
    sides = [reader.items(side, where, 2) for side in reader.items(fields["bound"], where)]
    count = len(stated.terms.coefficients)
    return Bounded([(reader.index(k, where, count), _modulation(reader, m, stated, where)) for k, m in sides])


def _state(reader: Reader, value: list[Any], stated: Stated, where: str) -> tuple[int, int]:
    """Return an experiment and a state whose rate is a sum of products."""
    e, i = reader.index(value[0], where, len(stated.runs)), reader.index(value[1], where, len(stated.rates))
    if stated.terms.rate[i] is not None:
        raise Unreadable(f"{where}: the rate of {shown_name(stated.rates[i])} is another state")
    return e, i


def _values(reader: Reader, value: Any, count: int, where: str) -> list[tuple[int, int]]:
    """Return samples with a value each."""
    pairs = reader.items(value, where)
    if len(pairs) % 2:
        raise Unreadable(f"{where}: a sample has no value")
    stated = zip(pairs[::2], pairs[1::2], strict=True)
    return [(reader.index(k, where, count), _limited(reader.number(own, where), where)) for k, own in stated]


def _modulation(reader: Reader, value: Any, stated: Stated, where: str) -> list[Modulation]:
    """Return a modulating function: experiment, state, sample and both ends of each interval."""
    flat, found = reader.items(value, where), list[Modulation]()
    if len(flat) % 5:
        raise Unreadable(f"{where}: an interval of a modulating function is not five numbers")
    stated.work.left += WORK_FOR_A_NUMBER * len(flat)
    for k in range(0, len(flat), 5):
        e, i = _state(reader, flat[k : k + 2], stated, where)
        now = reader.index(flat[k + 2], where, stated.runs[e].count)
        if not now:
            raise Unreadable(f"{where}: no interval ends at sample 0")
        found.append((e, i, now, _whole(flat[k + 3], where), _whole(flat[k + 4], where)))
    return found


def _limited(value: Fraction, where: str) -> int:
    units = below(value)
    if abs(units) > LARGEST:
        raise Unreadable(f"{where}: a value is too large")
    return units


def _nodes(reader: Reader, boxes: list[Any], stated: Stated) -> Iterator[Node]:
    for number, value in enumerate(boxes):
        where = f"box {number}"
        fields = reader.fields(value, where, (), ("passes", "cut"))
        passes = [_pass(reader, own, stated, where) for own in reader.items(fields.get("passes", []), where)]
        cut = None
        if "cut" in fields:
            unknown, end = reader.items(fields["cut"], where, 2)
            cut = reader.index(unknown, where), below(reader.number(end, where))
        yield Node(passes, cut)


def _pass(reader: Reader, value: Any, stated: Stated, where: str) -> Pass:
    fields = reader.fields(value, where, ("rows", "sides"))
    sources = [_source(reader, row, stated, where) for row in reader.items(fields["rows"], where)]
    if not sources:
        raise Unreadable(f"{where}: a contraction has no rows")
    return Pass(
        sources, [_side(reader, side, len(sources), stated, where) for side in reader.items(fields["sides"], where)]
    )


def _source(reader: Reader, value: Any, stated: Stated, where: str) -> Source:
    run, *places = reader.items(value, where, 4)
    if run == CONSTRAINT and not isinstance(run, bool):
        counts = (1, len(stated.constraints), 1)
    elif run == PRODUCT and not isinstance(run, bool):
        counts = (1, len(stated.products), len(FACTORS))
    else:
        reader.index(run, where, STEPWISE + 1)
        piece = reader.index(places[0], where, len(stated.pieces))
        named = stated.measured if run < LINKS or run == STEPWISE else stated.lines if run < BALANCES else stated.rates
        counts = (piece + 1, len(named), stated.pieces[piece].count)
    e, n, now = (reader.index(place, where, count) for place, count in zip(places, counts, strict=True))
    return run, e, n, now


def _side(reader: Reader, value: Any, rows: int, stated: Stated, where: str) -> Side:
    unknown, sign, shift, terms = reader.items(value, where, 4)
    pairs = reader.items(terms, where)
    if len(pairs) % 2:
        raise Unreadable(f"{where}: a row has no multiplier")
    stated.work.left += WORK_FOR_A_NUMBER * len(pairs)
    return Side(
        None if unknown is None else reader.index(unknown, where),
        reader.side(sign, where),
        reader.index(shift, where, LARGEST_SHIFT),
        [(reader.index(k, where, rows), _whole(m, where)) for k, m in zip(pairs[::2], pairs[1::2], strict=True)],
    )


def _whole(value: Any, where: str) -> int:
    if not isinstance(value, int) or isinstance(value, bool) or value.bit_length() > LARGEST_SHIFT:
        raise Unreadable(f"{where}: the multiplier {excerpt(value)} is not a whole number, or too long")
    return value
