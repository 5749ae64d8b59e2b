"""The result of a diagnosis."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from math import nan
from textwrap import indent
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from relaxations.algebra.arrays import Array, Mask
from smid.data import Dataset
from smid.data.reference import identity, referred
from smid.diagnosis.cause import Cause, percent
from smid.diagnosis.evidence.faults import Fault
from smid.diagnosis.evidence.misfit import Misfit
from smid.diagnosis.experiment import SeparatingExperiment
from smid.diagnosis.gain import Gain
from smid.diagnosis.proof.emptiness import Emptiness
from smid.diagnosis.proof.name_proof import NameProof
from smid.diagnosis.repeated import repeated_runs, seen_part, test_part
from smid.display.from_plain import Plain, fields_from_plain, read
from smid.display.result import Part, Tabular, plain
from smid.models import Model
from smid.validation.correlation import Correlation, autocorrelation, cross_correlation

if TYPE_CHECKING:
    from matplotlib.figure import Figure


ENDED_EARLY = (
    "The search ended early (Ctrl-C, SIGTERM or the time limit): effects that were not tested yet may explain more."
)


class Verdict(StrEnum):
    """The verdict of a diagnosis.

    Examples
    --------
    >>> Verdict("none").sentence
    'No effect is significant.'
    """

    NAMED = "named"
    NONE = "none"
    AMBIGUOUS = "ambiguous"

    @property
    def sentence(self) -> str:
        """The verdict in words."""
        return {
            Verdict.NAMED: "The cause is named.",
            Verdict.NONE: "No effect is significant.",
            Verdict.AMBIGUOUS: "Several effects explain the data equally well.",
        }[self]


@dataclass(frozen=True, eq=False, repr=False)
class Diagnosis(Tabular):
    """The result of `diagnose`.

    Parameters
    ----------
    base
        The base model with its best fit.
    model
        The extended model with its fit; the base where nothing was named.
    output, unit
        The channel judged, and its unit.
    causes
        Named effects, what is missed most first; where ambiguous, the likeliest alternative comes last and names the
        others.
    alternatives
        Where ambiguous, the effects of which one is there, the likeliest first; otherwise none.
    details
        Effects that the record shows, but that change the test error by less than its own spread.
    doubts
        Effects that were weighed and are not named, with their probabilities.
    misfit
        What is wrong with the base model, and where.
    faults
        What is wrong with the data.
    shortened
        How a long record was thinned and cut for the search, in sentences.
    gain
        On the test part, which no fit and no choice has seen.
    proof
        The certificate that the base model cannot explain the data, where one was found.
    experiment
        Where ambiguous: an input on which the predictions of the equally good effects differ.
    skipped
        Effects that could not be tried, and what they need, or how they failed.
    failed
        Of these, the effects that raised an exception or diverged from every start.
    dropped
        Effects that led at some time, and were replaced by others later.
    unexplained
        Whether the test error of the extended model still exceeds the noise bound, or is correlated.
    simulated, extended
        Shape (n,). Free runs of base and extended model, per experiment.
    test
        Shape (n,). Per experiment, the samples of the test part.
    interrupted
        Whether Ctrl-C, SIGTERM or the time limit ended the search early.
    name_proof
        What `prove_name` proved of the base model, the extended model and the rivals; None where it was not called.
    """

    SCHEMA: ClassVar = "smid.diagnosis/1"

    base: Model
    model: Model
    data: Dataset
    output: str
    unit: str
    verdict: Verdict
    causes: tuple[Cause, ...]
    alternatives: tuple[str, ...]
    details: tuple[Cause, ...]
    doubts: Mapping[str, float]
    misfit: Misfit
    faults: tuple[Fault, ...]
    shortened: tuple[str, ...]
    gain: Gain
    proof: Emptiness | None
    experiment: SeparatingExperiment | None
    skipped: Mapping[str, str]
    failed: tuple[str, ...]
    dropped: tuple[str, ...]
    unexplained: bool
    simulated: tuple[Array, ...]
    extended: tuple[Array, ...]
    test: tuple[Mask, ...]
    interrupted: bool
    seconds: float
    name_proof: NameProof | None = None

    def __len__(self) -> int:
        return len(self.causes)

    def __iter__(self) -> Iterator[Cause]:
        return iter(self.causes)

    def __contains__(self, effect: object) -> bool:
        return any(cause.effect == effect or cause is effect for cause in self.causes)

    def __bool__(self) -> bool:
        return True  # also one without causes is a diagnosis, and no missing one

    def __str__(self) -> str:
        causes = (indent(str(cause), "  ") for cause in self.causes)
        proof = () if self.name_proof is None else (str(self.name_proof),)
        return "\n".join((*self._before, *causes, *proof, *self._after))

    def _content(self) -> Iterator[Part]:
        yield from self._before
        yield from self.causes
        if self.name_proof is not None:
            yield self.name_proof
        yield from self._after
        if self.is_extended:
            yield self.gain

    @property
    def _before(self) -> Iterator[str]:
        yield self.misfit.sentence
        if self.proof is not None:
            yield self.proof.sentence
        yield from self.shortened
        yield from (fault.sentence for fault in self.faults)
        if self.interrupted:
            yield ENDED_EARLY
        yield self.conclusion

    @property
    def _after(self) -> Iterator[str]:
        if self.experiment is not None:
            yield self.experiment.sentence
        yield self.gain_sentence
        if self.details:
            names = ", ".join(cause.effect for cause in self.details)
            yield f"Details, which the test error does not show: {names}."
        if self.doubts:
            yield f"In doubt: {', '.join(f'{name} ({percent(p)})' for name, p in self.doubts.items())}."
        yield from (f"Not tested: {name} failed with {self.skipped[name]}" for name in self.failed)
        if self.unexplained:
            yield "The remaining error is more than noise: no effect of the library explains it."

    def _picture(self) -> Figure | None:
        return self.plot() if self.simulated else None  # none where the file was loaded without its record

    def _rows(self) -> Iterator[dict[str, Any]]:
        """Yield a row for each cause, and one for each effect that was weighed against it."""
        for cause in self.causes:
            named = {"cause": cause.effect, "effect": cause.effect, "named": True, "confidence": cause.confidence}
            yield {**named, "rmse": cause.evidence.get("rmse_after", nan), "odds": nan, "said": cause.sentence}
            for r in cause.rivals:
                rival = {"cause": cause.effect, "effect": r.effect, "named": False, "confidence": nan}
                yield {**rival, "rmse": r.rmse, "odds": r.odds, "said": r.why}

    @property
    def conclusion(self) -> str:
        """One sentence with the verdict."""
        sure = self.causes[:-1] if self.verdict is Verdict.AMBIGUOUS else self.causes
        said = [f"Cause: {', then '.join(cause.effect for cause in sure)}."] if sure else []
        if self.verdict is not Verdict.NAMED:
            said.append(self.verdict_sentence)
        if self.verdict is Verdict.AMBIGUOUS:
            said.append(f"It is {' or '.join(self.alternatives)}.")
        return " ".join(said)

    @property
    def verdict_sentence(self) -> str:
        """The verdict in words."""
        if self.verdict is Verdict.NONE and self.details:
            return "Effects explain what was fitted better, but the test part shows none of them."
        return self.verdict.sentence

    @property
    def new_parameters(self) -> tuple[str, ...]:
        """Parameters of the extended model that the causes brought, or set free."""
        known = {p.name for p in self.model.parameters}
        return tuple(dict.fromkeys(p.name for c in self.causes for p in c.parameters if p.name in known))

    @property
    def gain_sentence(self) -> str:
        """The gain in words."""
        g = self.gain
        unit = f" {self.unit}".rstrip()
        if not self.is_extended:
            return f"Test RMSE of the base model: {g.rmse_before:.4g}{unit} over {g.samples} samples."
        worse = " The extended model errs more there than the base model: it does not carry over to samples unseen."
        return (
            f"On {g.samples} test samples the RMSE changes from {g.rmse_before:.4g} to {g.rmse_after:.4g}{unit}, the "
            f"largest error from {g.noise_bound_before:.4g} to {g.noise_bound_after:.4g}{unit}."
            f"{worse * (g.rmse_after > g.rmse_before)}"
        )

    def to_dict(self) -> dict[str, Any]:
        """Return plain data: the ``diagnosis`` of the versioned JSON schema in docs/json.md."""
        return {
            "schema": self.SCHEMA,
            "verdict": self.verdict.value,
            "causes": [cause.to_dict() for cause in self.causes],
            "alternatives": list(self.alternatives),
            "details": [cause.to_dict() for cause in self.details],
            "doubts": dict(self.doubts),
            "gain": self.gain.to_dict(),
            "held_samples": self.gain.samples,
            "test_samples": {
                name: [int(k) for k in np.flatnonzero(mask)[[0, -1]]] if mask.any() else None
                for name, mask in zip(self.data.experiment_names, self.test, strict=True)
            },
            "misfit": self.misfit.to_dict(),
            "shortened": list(self.shortened),
            "faults": [fault.to_dict() for fault in self.faults],
            "proof": None if self.proof is None else self.proof.to_dict(),
            "name_proof": None if self.name_proof is None else self.name_proof.to_dict(),
            "experiment": plain(self.experiment),
            "skipped": dict(self.skipped),
            "failed": list(self.failed),
            "dropped": list(self.dropped),
            "unexplained": self.unexplained,
            "interrupted": self.interrupted,
            "base": self.base.to_dict(),
            "model": self.model.to_dict(),
            "data": identity(self.data),
        }

    @staticmethod
    def from_dict(content: Mapping[str, Any], data: Dataset | None = None) -> Diagnosis:
        """Return the diagnosis that `to_dict` described, without the time that it took.

        The free runs are repeated if the record is given, from the initial states that fit the samples before the test
        part best.
        """
        record = referred(read(content, "data", Plain), data)
        base, model = read(content, "base", Model), read(content, "model", Model)
        model = base if model == base else model
        shown = Misfit.from_dict(read(content, "misfit", Plain), record)
        ends = read(content, "test_samples", Mapping[str, tuple[int, int] | None])
        lengths = dict.fromkeys(record.experiment_names, 0)
        if data is not None:
            lengths = {run.name: run.n_samples for run in data.experiments}
        test = tuple(test_part(ends.get(name), length) for name, length in lengths.items())
        simulated: tuple[Array, ...] = ()
        extended: tuple[Array, ...] = ()
        if data is not None:
            simulated, extended = (repeated_runs(one, data, test, shown.channel) for one in (base, model))
            shown = shown.on(*seen_part(data, test, simulated, shown.channel))
        found: Diagnosis = fields_from_plain(
            Diagnosis,
            content,
            base=base,
            model=model,
            data=record,
            output=shown.channel,
            unit=shown.unit,
            misfit=shown,
            gain=Gain.from_dict(read(content, "gain", Plain), read(content, "held_samples", int)),
            simulated=simulated,
            extended=extended,
            test=test,
            seconds=nan,
        )
        return found

    @property
    def is_extended(self) -> bool:
        """Whether an effect was put on the base model."""
        return self.model is not self.base

    def correlations(self, simulated: Sequence[Array]) -> tuple[Correlation, ...]:
        """Return the correlations of the test error of a free run with its own past, and with each input.

        Parameters
        ----------
        simulated
            Shape (n,). `simulated` or `extended`, per experiment.
        """
        tested = [
            (run, free, mask)
            for run, free, mask in zip(self.data.experiments, simulated, self.test, strict=True)
            if mask.any()
        ]
        error = [(run.values[self.output] - free)[mask] for run, free, mask in tested]
        inputs = {name: [run.values[name][mask] for run, _, mask in tested] for name in self.base.input_channels}
        found = (autocorrelation(error), *(cross_correlation(error, u, name) for name, u in inputs.items()))
        return tuple(one for one in found if one is not None)

    def plot(self) -> Figure:
        """Draw measured, base and extended output on the test part, with their errors."""
        from smid.diagnosis.figures import on_test_part

        return on_test_part(self)
