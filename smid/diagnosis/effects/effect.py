"""An effect: a rewrite of a symbolic model with new parameters that have a null value.

An effect applies to any model. It yields one or more *extensions*: models with a few more parameters that equal the old
model where these parameters have their null values. The search fits the extensions and keeps the best; see
`smid.diagnosis.search.search`. The model notes the effect as the origin of what it adds, see `Model.origins`.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from itertools import product

import numpy as np

from relaxations.algebra.arrays import Array, Mask
from smid.data import Dataset
from smid.data.estimates import estimates_of
from smid.models import Model
from smid.models.chains import behind, in_front_of

Describe = Callable[[Mapping[str, float], "Site"], str]


@dataclass(frozen=True, eq=False)
class Site:
    """The data and channels that an effect is applied to.

    Parameters
    ----------
    data
        The part of the record that may be fitted.
    input, output
        Channels of the model's main input and output.
    residual
        Shape (n,). Per experiment, output minus the base model's free run, in the output's unit.

    Examples
    --------
    >>> data = Dataset.from_arrays(input={"u": [0.0, 2, 1]}, output={"y": [0.0, 0, -3]}, sampling_time=0.5)
    >>> site = Site(data, "u", "y")
    >>> site.duration, site.span("u"), site.scale("y"), site.other_channels
    (1.5, (0.0, 2.0), 3.0, ())
    """

    data: Dataset
    input: str
    output: str
    residual: tuple[Array, ...] = ()

    @property
    def sampling_time(self) -> float:
        """Seconds between samples."""
        return self.data.sampling_time

    @cached_property
    def duration(self) -> float:
        """Length of the longest experiment, in seconds."""
        return max(run.n_samples for run in self.data.experiments) * self.sampling_time

    @property
    def other_channels(self) -> tuple[str, ...]:
        """Measured channels that are neither the main input nor the main output."""
        measured = (c.name for c in self.data.channels if not c.estimate_of)
        return tuple(name for name in measured if name not in (self.input, self.output))

    @property
    def estimates(self) -> tuple[str, ...]:
        """Channels that estimate the main input without its noise."""
        return estimates_of(self.data, self.input)

    def unit(self, channel: str) -> str:
        """Return the channel's unit."""
        return self.data.channel(channel).unit

    def values(self, channel: str) -> Array:
        """Return all samples of a channel, experiments joined, shape (n,)."""
        return np.concatenate([run.values[channel] for run in self.data.experiments])

    def span(self, channel: str) -> tuple[float, float]:
        """Return the least and the largest sample of a channel, in its unit."""
        values = self.values(channel)
        return float(values.min()), float(values.max())

    def scale(self, channel: str) -> float:
        """Return the largest magnitude of a channel, in its unit; 1 for a channel that is zero."""
        return float(np.abs(self.values(channel)).max()) or 1.0


@dataclass(frozen=True)
class Extension:
    """One way to put an effect on a model.

    Parameters
    ----------
    model
        The extended model.  The parameters it has more than the base are the effect's: those with a null value
        switch it off there, the others (a frequency, a time) only shape it.
    starts
        Values of all new parameters, away from null, from which a fit may begin; the first is the likeliest.  They may
        hold values of the model's other parameters, too.
    label
        Which way, in a word or two, where the effect has several.
    inside
        Open intervals in which parameters must lie. Outside them the effect is another one: a dead zone that no
        sample enters is a bias.
    describe
        As `Effect.describe`, for this extension only; it must be picklable, a `functools.partial` of a function, say.
        It knows the names that the extension uses, so that no name has to be taken apart.
    place
        Where it stands among other effects on the same input or output, if not next to the channel.

    Examples
    --------
    >>> from smid.models import OutputError, Parameter
    >>> shift = Parameter("shift", -10, 10, "bar", 0.0)
    >>> pushed = Extension(OutputError().add_term("w", shift.symbol, [shift]), ({"shift": 0.1}, {"shift": -0.1}))
    >>> len(pushed.starts), pushed.model.parameter("shift").null
    (2, 0.0)
    """

    model: Model
    starts: Sequence[Mapping[str, float]]
    label: str = ""
    inside: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    describe: Describe | None = None
    place: str = ""


@dataclass(frozen=True, eq=False)
class Detection:
    """An effect on the noise, found in a residual.

    Parameters
    ----------
    model
        The model with the effect in it.
    values
        Sizes of the effect, for its description.
    confidence
        Between 0 and 1.
    evidence
        The figures that show it.
    score_drop
        Twice the gain in log-likelihood of the residual over an autoregression of the largest order, by Schwarz's
        criterion, to compare with effects that free runs show; None where it does not compete with them.
    explained
        Where it competes, the mean square of the residual that it accounts for, in the squared unit of the output.
    glitches
        Shape (n,). Per experiment, samples to leave out of every fit.

    Examples
    --------
    >>> from smid.models import OutputError
    >>> found = Detection(OutputError(), {"step": 0.01}, confidence=0.99, evidence={"shared digits": 1.0})
    >>> found.values["step"], found.glitches is None
    (0.01, True)
    """

    model: Model
    values: Mapping[str, float]
    confidence: float
    evidence: Mapping[str, float]
    score_drop: float | None = None
    explained: float = 0.0
    glitches: tuple[Mask, ...] | None = None


@dataclass(frozen=True)
class Effect:
    """A named cause that a model may lack.

    Parameters
    ----------
    name
        As in the table of effects.
    summary
        What it is, in one sentence without a full stop.
    extend
        Every way to put it on the model; none where it does not apply.
    describe
        One sentence, with sizes in units, from the values of the effect's parameters. None where every extension
        has its own.
    needs
        What the effect needs to apply, shown where it is skipped.
    detect
        For effects on the noise, which no free run can follow to the end: returns what the residual shows of the
        effect. The model has values; the site's residual is over the whole record.
    marks_glitches
        Whether `detect` finds single bad samples. They are left out before any other effect is tried.

    Examples
    --------
    >>> from smid.models import OutputError, Parameter
    >>> shift = Parameter("shift", -10, 10, "", 0.0)
    >>> def extend(model, site):
    ...     yield Extension(model.add_term("w", shift.symbol, [shift]), ({"shift": 0.1},))
    >>> offset = Effect("offset", "the state is pushed", extend, lambda values, site: f"{values['shift']:.3g}")
    >>> data = Dataset.from_arrays(input={"u": [0.0, 1, 1]}, output={"y": [0.0, 0, 1]}, sampling_time=1.0)
    >>> [e.model.parameters[-1].name for e in offset.extensions(OutputError(), Site(data, "u", "y"))]
    ['shift']
    """

    name: str
    summary: str
    extend: Callable[[Model, Site], Iterable[Extension]]
    describe: Describe | None = None
    needs: str = ""
    detect: Callable[[Model, Site], Detection | None] | None = None
    marks_glitches: bool = False

    def extensions(self, model: Model, site: Site) -> Iterator[Extension]:
        """Yield every way to put the effect on a model, with the effect as the origin of all that it adds.

        The effect is put on every input and every output of the base model, at every place among the effects there.
        """
        own = {*(p.name for p in model.parameters), *model.inputs}
        # Names of channels stay free: a later effect may read the channel.
        reserved = tuple(c.name for c in site.data.channels)

        def put(here: Site) -> Iterator[Extension]:
            at_ends = tuple(self.extend(model.edited_by(self.name, reserved), here))
            yield from at_ends
            for channel, chain, side in ((here.input, behind, "behind"), (here.output, in_front_of, "before")):
                there = tuple(chain(model, channel))
                joins = there and any(len(tuple(chain(item.model, channel))) > len(there) for item in at_ends)
                for name in there if joins else ():
                    place = f"{side} the {model.origins[name].replace('_', ' ')}"
                    for item in self.extend(model.edited_by(self.name, reserved, {channel: name}), here):
                        yield replace(item, place=place)

        for item in _at_all_ends(put, model, site, self.describe):
            added = {*(p.name for p in item.model.parameters), *item.model.inputs} - own
            origins = {**item.model.origins, **dict.fromkeys(sorted(added), self.name)}
            yield replace(item, model=replace(item.model, origins=origins, edit=None))


def _at_all_ends(
    put: Callable[[Site], Iterable[Extension]], model: Model, site: Site, describe: Describe | None
) -> Iterator[Extension]:
    """Yield what an effect offers at each pair of an input and an output of the base model, each extension once."""
    own = (
        channel for name, channel in zip(model.inputs, model.input_channels, strict=True) if name not in model.origins
    )
    inputs, outputs = dict.fromkeys((site.input, *own)), dict.fromkeys((site.output, *model.output_channels))
    found: dict[Hashable, tuple[Extension, list[Site]]] = {}
    for output, input in product(outputs, inputs):
        here = replace(site, input=input, output=output)
        for item in put(here):
            found.setdefault(_shape(item), (item, []))[1].append(here)
    for item, sites in found.values():
        said, first = item.describe or describe, sites[0]
        # What is not there for every input is of this input, and so for the outputs.
        of = [first.input] if len({at.input for at in sites}) < len(inputs) else []
        of += [first.output] if len({at.output for at in sites}) < len(outputs) else []
        if of:
            said = said and partial(_at, said, first.input, first.output)
        yield replace(item, label=", ".join((item.label, *of)).removeprefix(", "), describe=said)


def _at(describe: Describe, input: str, output: str, values: Mapping[str, float], site: Site) -> str:
    return describe(values, replace(site, input=input, output=output))


def _shape(item: Extension) -> Hashable:
    """Return what an extension is but for its numbers, which may differ with the site: where it acts, and its names."""
    reads = frozenset((line.signal, frozenset(name for name, _ in line.reads)) for line in item.model.lines)
    return item.label, tuple(p.name for p in item.model.parameters), reads, item.model.measurements


def on_the_noise(_model: Model, _site: Site) -> tuple[Extension, ...]:
    """Return no extension: an effect on the noise is detected in the residual."""
    return ()
