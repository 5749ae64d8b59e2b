"""The choice of the structure: the least noise bound and the error elsewhere for several powers and poles.

The least noise bound falls with every term, because it is a fit. A term is justified if the bound falls much and the
error on the rest of the record falls too. With two poles the enclosure of the least bound takes a minute and stays
wide, so only the least-squares fit is compared.

Reference: clutch thesis, section 3.2.1 ("this structure has been selected after several trials") and (3.5).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

from relaxations.deadline import Progress
from smid.data import Dataset
from smid.display.result import Part, Result, plain
from smid.display.table import Table
from smid.fitting.binding import bind
from smid.fitting.fit import fit
from smid.identification.error_bound import ErrorBound, error_bound
from smid.models import ModelError
from smid.study.finished import finished
from smid.theses.clutch.hammerstein.model import clutch_hammerstein
from smid.validation.validate import validate

__all__ = ["STRUCTURES", "Structure", "StructureChoice", "choose_structure"]

Powers = tuple[int, ...]

STRUCTURES: tuple[tuple[int, Powers], ...] = (
    (1, (3,)),
    (1, (4, 3)),
    (1, (5, 4, 3)),
    (1, (5, 4, 3, 2, 1)),
    (2, (5, 4, 3)),
)
"""Poles and powers of the candidates: up to the thesis's (3.5), then all powers as in (3.23), then a second pole."""
NEAR = 1.1
"""Least noise bounds up to this multiple of the smallest count as equal."""


@dataclass(frozen=True)
class Structure:
    """A candidate.

    Parameters
    ----------
    bound
        Least noise bound on the part; None with more than one pole.
    rmse, rmse_elsewhere
        Of the free run of the least-squares fit, on the part and on the whole record.
    """

    poles: int
    powers: Powers
    bound: ErrorBound | None
    rmse: float
    rmse_elsewhere: float

    @property
    def n_parameters(self) -> int:
        """Return the number of poles and coefficients; the gain of the linear part is one."""
        return self.poles + len(self.powers)


@dataclass(frozen=True, repr=False)
class StructureChoice(Result):
    """Candidates for the structure, and the unit of the output."""

    structures: tuple[Structure, ...]
    unit: str

    @property
    def table(self) -> Table:
        """Return a row per candidate."""
        rows = tuple(
            (
                str(s.poles),
                ", ".join(map(str, s.powers)),
                str(s.n_parameters),
                "-" if s.bound is None else s.bound.enclosure,
                f"{s.rmse:.3f}",
                f"{s.rmse_elsewhere:.3f}",
            )
            for s in self.structures
        )
        header = ("poles", "powers", "parameters", "least noise bound", "RMSE on the part", "RMSE on the record")
        caption = f"Structures [{self.unit}]: least noise bound, and free run of a least-squares fit to the part."
        return Table(caption, header, rows, "rlrrrr")

    @property
    def choice(self) -> Structure:
        """Return the candidate with the fewest parameters whose least noise bound is near the smallest."""
        bounded = [(s, s.bound) for s in self.structures if s.bound is not None]
        smallest = min(bound.upper for _, bound in bounded)
        near = [s for s, bound in bounded if bound.upper <= NEAR * smallest]
        return min(near, key=lambda s: s.n_parameters)

    @property
    def conclusion(self) -> str:
        """Return in a sentence which candidate suffices."""
        powers = ", ".join(map(str, self.choice.powers))
        return (
            f"The fewest parameters with a least noise bound within {100 * (NEAR - 1):.0f} % of the smallest: one "
            f"pole, powers {powers}."
        )

    def _content(self) -> Iterator[Part]:
        yield self.table
        yield self.conclusion

    def to_dict(self) -> dict[str, Any]:
        """Return plain data."""
        return {"structures": plain(self.structures), "conclusion": self.conclusion}


def choose_structure(
    part: Dataset,
    record: Dataset,
    structures: Sequence[tuple[int, Powers]] = STRUCTURES,
    *,
    progress: Progress | None = None,
) -> StructureChoice:
    """Compare pairs of poles and powers, identified on a part of a record; ModelError if no pair has one pole."""
    if not any(poles == 1 for poles, _ in structures):
        raise ModelError("there is no structure with one pole to choose: give at least one pair such as (1, (5, 4, 3))")
    models = [clutch_hammerstein(poles, powers) for poles, powers in structures]
    found = []
    for (poles, powers), model in zip(structures, models, strict=True):
        # More nodes would not close the gap of two poles, and would cost minutes.
        bound = finished(error_bound(model, part, nodes=0, progress=progress)) if poles == 1 else None
        fitted = fit(bind(model, part), part).model
        errors = [validate(fitted, data).scores[0].rmse for data in (part, record)]
        found.append(Structure(poles, tuple(powers), bound, *errors))
    return StructureChoice(tuple(found), part.channel(part.output).unit)
