"""What is proven of the base model, of the extended model, and of the rivals, on the same samples."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from smid.diagnosis.proof.decide import Decision
from smid.diagnosis.proof.posed import ASSUMED
from smid.display.result import Part, Result
from smid.display.table import Table


@dataclass(frozen=True, repr=False, eq=False)
class NameProof(Result):
    """The proof of the name that a diagnosis gives.

    Parameters
    ----------
    noise_bound
        Of the output, in its unit.
    first, last
        The samples that the proofs are about, counted from the start of the experiment. Each exclusion needs only the
        samples of its own decision.
    causes
        The named effects, which the extended model has.
    base, extended
        What is proven of the two models; no extended one where nothing is named.
    against
        The cause that the rivals were put in the place of.
    rivals
        What is proven of the models with a rival in its place.
    interrupted
        Whether Ctrl-C ended the proof early.

    Examples
    --------
    >>> from smid.diagnosis.proof.decide import Status
    >>> excluded = Decision(Status.EXCLUDED, 20, 59, ((31, 0.4),), "", 0.2)
    >>> feasible = Decision(Status.FEASIBLE, 20, 59, (), "", 0.1)
    >>> about = (0.1, "bar", "run", 20, 59, ("gain",))
    >>> print(NameProof(*about, excluded, feasible, "", {}, False, 0.3))
    Proof of the name on samples 20 to 59 of run, within 0.1 bar; parameters without a box: at most 10 times their fit.
    model       on these samples  most influential, or why undecided
    base model  excluded          31
    with gain   feasible
    >>> NameProof(*about, excluded, feasible, "gain", {"lag": excluded}, False, 0.3).sentence
    'Proof on samples 20 to 59 of run, within 0.1 bar: base model excluded; with gain feasible; 1 of 1 rivals excluded.'
    """

    noise_bound: float
    unit: str
    experiment: str
    first: int
    last: int
    causes: tuple[str, ...]
    base: Decision
    extended: Decision | None
    against: str
    rivals: Mapping[str, Decision]
    interrupted: bool
    seconds: float

    @property
    def title(self) -> str:
        """What the proof is about."""
        return f"Proof of the name on {self._about}; {ASSUMED}{' (interrupted)' if self.interrupted else ''}."

    @property
    def sentence(self) -> str:
        """The decisions in short."""
        said = [f"base model {self.base.status}"]
        if self.extended is not None:
            said.append(f"with {', '.join(self.causes)} {self.extended.status}")
        if self.rivals:
            said.append(f"{sum(r.excluded for r in self.rivals.values())} of {len(self.rivals)} rivals excluded")
        return f"Proof on {self._about}: {'; '.join(said)}."

    @property
    def _about(self) -> str:
        about = f"samples {self.first} to {self.last} of {self.experiment}, within {self.noise_bound:g} {self.unit}"
        return about.rstrip()

    @property
    def decisions(self) -> Iterator[tuple[str, Decision]]:
        """Each model in words, with what is proven of it."""
        yield "base model", self.base
        if self.extended is not None:
            yield f"with {', '.join(self.causes)}", self.extended
        yield from ((f"with {name} in place of {self.against}", found) for name, found in self.rivals.items())

    @property
    def table(self) -> Table:
        """The decisions."""
        header = ("model", "on these samples", "most influential, or why undecided")
        return Table("", header, tuple((name, str(d.status), d.ground) for name, d in self.decisions), "lll")

    def _content(self) -> Iterator[Part]:
        yield self.title
        yield self.table

    def __str__(self) -> str:
        return f"{self.title}\n{self.table}"

    def to_dict(self) -> dict[str, Any]:
        """Return plain, JSON-ready content."""
        return {**super().to_dict(), "title": self.title}
