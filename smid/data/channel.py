"""A named signal and its unit, and the search for a name."""

from collections.abc import Iterable
from dataclasses import dataclass
from difflib import get_close_matches


@dataclass(frozen=True)
class Channel:
    """A measured signal: its name, unique in its data set, and its unit.

    Parameters
    ----------
    unit
        As printed on axes and in tables; empty if unknown, or if the signal has none.
    estimate_of
        The channel that this one estimates without its noise (`smid.data.estimates`); empty if it is measured.

    Examples
    --------
    >>> str(Channel("pressure", "bar"))
    'pressure [bar]'
    """

    name: str
    unit: str = ""
    estimate_of: str = ""

    def __str__(self) -> str:
        return f"{self.name} [{self.unit}]" if self.unit else self.name


def name_hint(wanted: str, present: Iterable[str]) -> str:
    """Return the end of an error message: the present names nearest to the wanted one, or all present names.

    Examples
    --------
    >>> name_hint("presure", ["time", "current", "pressure"])
    "did you mean 'pressure'?"
    """
    names = list(present)
    by_folded_name = {name.casefold(): name for name in names}
    near = [by_folded_name[name] for name in get_close_matches(wanted.casefold(), by_folded_name)]
    if near:
        return f"did you mean {' or '.join(map(repr, near))}?"
    return f"choose among {', '.join(map(repr, names))}"
