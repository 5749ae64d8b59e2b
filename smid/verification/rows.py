"""The equations of a model at every sample, as exact polynomials in the variables of a certificate.

Every variable of the certificate has a meaning: a parameter, a noise ``eta[3]``, a latent signal ``w[3]``, a kink, or
an auxiliary quantity that an equality defines. A measured signal is "measurement minus noise". A signal that is neither
measured nor latent is replaced by its own line.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from fractions import Fraction
from typing import Any

from relaxations.check.arithmetic import Polynomial, Terms, Work, value_range
from relaxations.check.statement import Box, Stated
from smid.verification.expressions import NotPolynomialError, OutsideError, Value, evaluated, number, variable

_WORK = Work(1 << 62)
Samples = Mapping[str, Mapping[str, list[Fraction | None]]]  # experiment -> channel -> samples; None is a missing one


@dataclass(frozen=True)
class Row:
    """One equation of the model, ``polynomial = 0``."""

    experiment: str
    signal: str
    time: int
    polynomial: Terms

    def __str__(self) -> str:
        return f"the equation of {self.signal!r} at sample {self.time} of experiment {self.experiment!r}"


@dataclass
class Equations:
    """The lines of a model, evaluated on a record; ``stated`` and ``box`` are those of the certificate."""

    model: Mapping[str, Any]
    samples: Samples
    stated: Stated
    box: Box
    place: dict[str, int] = field(init=False)
    used_kinks: set[int] = field(init=False, default_factory=set)
    missing: frozenset[str] = field(init=False)  # noises of missing samples
    _experiment: str = field(init=False, default="")
    _memory: dict[tuple[str, int], Value] = field(init=False, default_factory=dict)

    def __post_init__(self) -> None:
        self.place = {name: k for k, name in enumerate(self.stated.names)}
        self.missing = frozenset(
            self.instance(m["noise"], time, experiment)
            for m in self.model["measurements"]
            if m["noise"] is not None
            for experiment, channels in self.samples.items()
            for time, sample in enumerate(channels[m["channel"]])
            if sample is None
        )
        self._latent = {name.split("[")[0] for name in self.stated.names if "[" in name}
        self._measured = {m["signal"]: m for m in self.model["measurements"]}
        self._kinks: dict[str, list[int]] = {}
        for n, kink in enumerate(self.stated.kinks):
            name = self.stated.names[kink.variable]
            self._kinks.setdefault(name[name.index("[") :] if "[" in name else "", []).append(n)

    def instance(self, name: str, time: int, experiment: str = "") -> str:
        """Return the name of the variable of a signal, or a noise, at a time."""
        suffix = "" if len(self.samples) == 1 else f",{experiment or self._experiment}"
        return f"{name}[{time}{suffix}]"

    def rows(self) -> Iterator[Row]:
        """Return the model's equations, experiment by experiment, line by line, from the first possible sample."""
        lines: Mapping[str, str] = self.model["lines"]
        for experiment, channels in self.samples.items():
            self._experiment, self._memory = experiment, {}
            count = len(next(iter(channels.values())))
            for name, text in lines.items():
                if name in self._measured or name in self._latent:
                    yield from self._line(name, text, count)
            for name, measurement in self._measured.items():
                if name in self._latent and measurement["noise"] is not None:
                    for time in range(count):
                        if self.instance(name, time) in self.place:
                            with suppress(OutsideError):  # of a missing sample
                                seen = self._seen(measurement, time)
                                yield Row(experiment, name, time, (self.signal(name, time) - seen).polynomial())

    def _line(self, name: str, text: str, count: int) -> Iterator[Row]:
        for time in range(count):
            try:
                value = self.signal(name, time) - self._expression(text, time)
            except OutsideError:
                continue
            yield Row(self._experiment, name, time, value.polynomial())

    def constraints(self) -> list[Terms]:
        """Return the model's constraints, each a polynomial that is at least zero."""
        return [self._expression(text, 0).polynomial() for text in self.model["constraints"]]

    def _expression(self, text: str, time: int) -> Value:
        return evaluated(text, time, self._parameter, self.signal, self._kink)

    def _parameter(self, name: str) -> Value:
        if name not in self.model["parameters"] or name not in self.place:
            raise NotPolynomialError(f"{name!r} is not a parameter of the proof")
        return variable(self.place[name])

    def signal(self, name: str, time: int) -> Value:
        """Return a signal at a time: a variable, the signal behind a measured sample, its own line, or data."""
        if time < 0:
            raise OutsideError
        if (name, time) not in self._memory:
            own = self.place.get(self.instance(name, time))
            if own is not None:
                found = variable(own)
            elif name in self._measured:
                found = self._seen(self._measured[name], time)
            elif name in self.model["lines"]:
                found = self._expression(self.model["lines"][name], time)
            else:
                found = self._sample(name, time)
            # The time of the value is the time at which the line reads it.
            self._memory[name, time] = Value(found.above, found.below, time)
        return self._memory[name, time]

    def _seen(self, measurement: Mapping[str, Any], time: int) -> Value:
        """Return the signal behind a measured sample: the sensor's inverse curve of measurement minus noise."""
        if measurement["noise"] is None:
            seen = self._sample(measurement["channel"], time)
        else:
            noise = self.place.get(self.instance(measurement["noise"], time))
            if noise is None:
                raise OutsideError
            # A missing sample is zero, with a noise that has no bound.
            missing = self.samples[self._experiment][measurement["channel"]][time] is None
            seen = (number(0) if missing else self._sample(measurement["channel"], time)) - variable(noise)
        if measurement["inverse"] is None:
            return seen

        def name_of(name: str) -> Value:
            return seen if name == "value" else self._parameter(name)

        return evaluated(measurement["inverse"], time, name_of, self.signal, self._kink)

    def _sample(self, channel: str, time: int) -> Value:
        sample = self.samples[self._experiment][channel][time]
        if sample is None:
            raise OutsideError
        return number(sample)

    def _kink(self, kind: str, argument: Value) -> Value:
        """Return the positive part or the sign of a value, from its number, a kink of the proof, or the box."""
        terms = argument.polynomial()
        opposite = {m: -c for m, c in terms.items()}
        sign = kind == "sign"
        if terms.keys() <= {()}:
            size = terms.get((), Fraction(0))
            return number((size > 0) - (size < 0) if sign else max(size, Fraction(0)))
        suffix = "" if argument.newest < 0 else self.instance("", argument.newest)
        for n in self._kinks.get(suffix, []):
            kink = self.stated.kinks[n]
            if kink.sign == sign and contains(kink.argument, terms):
                self.used_kinks.add(n)
                return variable(kink.variable, argument.newest)
            if kink.sign == sign and contains(kink.argument, opposite):
                self.used_kinks.add(n)
                own = variable(kink.variable, argument.newest)
                return -own if sign else own + argument
        low, high = value_range(Polynomial(terms), self.box, _WORK)
        if low > 0 or (low >= 0 and not sign):
            return number(1) if sign else argument
        if high < 0 or (high <= 0 and not sign):
            return number(-1 if sign else 0)
        raise OutsideError


def contains(stated: Polynomial, exact: Terms) -> bool:
    """Return whether a stated polynomial, with its rounding errors, contains an exact one."""
    zero = Fraction(0)
    return all(
        abs(stated.mid.get(m, zero) - exact.get(m, zero)) <= stated.rad.get(m, zero)
        for m in {*stated.mid, *stated.rad, *exact}
    )
