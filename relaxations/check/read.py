"""Read a certificate file: first the statement, then the steps one after the other.

Numbers are integers, fractions such as ``"1/3"`` and floats in hexadecimal, ``"0x1.8p+1"``. Decimals are refused,
because their binary value is ambiguous.
"""

from __future__ import annotations

import json
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from stat import S_ISREG
from typing import Any

from relaxations.check import steps
from relaxations.check.arithmetic import Unreadable, Work
from relaxations.check.forms import MANY, Reader, excerpt, read_name, shown_name
from relaxations.check.read_steps import read_proof
from relaxations.check.statement import Box, Kink, Stated

FORMAT = "relaxations certificate"
VERSION = 1

MOST_BYTES = 1 << 28
MOST_VARIABLES = 1 << 20
WORK = 50_000  # products of short numbers, allowed for every file


@dataclass(frozen=True)
class Document:
    """A certificate file.

    Parameters
    ----------
    steps
        Each step is read when it is checked.
    work
        The remaining work of the check.
    origin
        The file's statement about model and data, or None.
    """

    stated: Stated
    box: Box
    steps: steps.Proof
    work: Work
    origin: Any


def read(path: str | Path) -> Any:
    """Return the content of a certificate file, for :func:`relaxations.check.check`.

    Raises
    ------
    Unreadable
        When there is no such file, it is too long, it is not valid JSON, or it has decimals or a duplicate key.

    Examples
    --------
    >>> import tempfile
    >>> from relaxations.check import Unreadable, read
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     file = Path(folder) / "claim.json"
    ...     written = file.write_text('{"bound": -0.25}', encoding="utf-8")
    ...     try:
    ...         read(file)
    ...     except Unreadable as error:
    ...         print(str(error).removeprefix(str(file)))
    : -0.25 is a decimal: write a float in hexadecimal, a fraction or a whole number
    """
    try:
        if not S_ISREG(Path(path).stat().st_mode):
            raise Unreadable(f"{path} is not a regular file")
        with Path(path).open("rb") as file:
            content = file.read(MOST_BYTES + 1)
    except (OSError, ValueError) as error:
        raise Unreadable(f"{path}: {getattr(error, 'strerror', None) or error}") from None
    if len(content) > MOST_BYTES:
        raise Unreadable(f"{path} has more than {MOST_BYTES} bytes, the limit of this program")
    try:
        return json.loads(
            content.decode("utf-8"),
            object_pairs_hook=_unique_keys,
            parse_float=_no_decimal,
            parse_constant=_no_decimal,
        )
    except Unreadable as error:
        raise Unreadable(f"{path}: {error}") from None
    except RecursionError:
        raise Unreadable(f"{path} is nested too deeply") from None
    except ValueError as error:
        raise Unreadable(f"{path} is not valid JSON: {error}") from None


def document(content: Any) -> Document:
    """Return the statement and the steps of a file's content."""
    reader = Reader(0, Work(WORK))
    # Format, version and keys.
    keys = ("format", "version", "variables", "box", "equalities", "inequalities", "steps")
    if not isinstance(content, dict) or content.get("format") != FORMAT:
        raise Unreadable(f"the file is not a certificate: its 'format' is not {FORMAT!r}")
    if content.get("version") != VERSION or isinstance(content["version"], bool):
        raise Unreadable(f"the version is {excerpt(content.get('version'))}, this program checks version {VERSION}")
    file = reader.fields(content, "the file", keys, ("kinks", "cuts", "origin"))
    # Variables with their bounds.
    names = [read_name(name, f"variable {k}") for k, name in enumerate(reader.items(file["variables"], "variables"))]
    if len(names) > MOST_VARIABLES:
        raise Unreadable(f"there are {len(names)} variables, the limit is {MOST_VARIABLES}")
    if len(set(names)) < len(names):
        raise Unreadable(f"two variables have the name {shown_name(max(names, key=names.count))}")
    reader.count = len(names)
    pairs = reader.items(file["box"], "box", len(names))
    box = [reader.ends(pair, f"box of {shown_name(name)}") for name, pair in zip(names, pairs, strict=True)]
    # Constraints, cuts and kinks.
    equalities, inequalities = (
        [reader.polynomial(row, f"{kind} {k}") for k, row in enumerate(reader.items(file[kind], kind))]
        for kind in ("equalities", "inequalities")
    )
    cuts = [_cut(reader, cut, f"cut {k}") for k, cut in enumerate(reader.items(file.get("cuts", []), "cuts"))]
    kinks = _kinks(reader, file.get("kinks", []))
    # The steps are read later, one by one.
    given = reader.items(file["steps"], "steps")
    if not given:
        raise Unreadable("there are no steps: nothing is claimed")
    stated = Stated(names, list(equalities), list(inequalities), kinks, {}, cuts)
    return Document(stated, box, read_proof(reader, given, ""), reader.work, file.get("origin"))


def _cut(reader: Reader, value: Any, where: str) -> steps.Cut:
    """Return the multipliers of a cut."""
    cut = reader.fields(value, where, ("equalities", "inequalities"))
    return steps.Cut(*(reader.pairs(cut[kind], where, MANY) for kind in ("equalities", "inequalities")))


def _kinks(reader: Reader, value: Any) -> list[Kink]:
    """Return the kinks, and check that each uses only earlier ones."""
    kinks: list[Kink] = []
    for n, entry in enumerate(reader.items(value, "kinks")):
        where = f"kink {n}"
        fields = reader.fields(entry, where, ("variable", "kind", "argument"))
        if fields["kind"] not in ("positive part", "sign"):
            raise Unreadable(f"{where}: {excerpt(fields['kind'])} is neither 'positive part' nor 'sign'")
        argument = reader.polynomial(fields["argument"], f"{where}, argument")
        kinks.append(Kink(reader.index(fields["variable"], where), fields["kind"] == "sign", argument))
    places = {kink.variable: n for n, kink in enumerate(kinks)}
    for n, kink in enumerate(kinks):
        if places[kink.variable] != n:
            raise Unreadable(f"kink {n}: its variable is one of another kink")
        if any(places.get(v, -1) >= n for m in kink.argument.mid for v in m):
            raise Unreadable(f"kink {n}: it reads one that is not before it")
    return kinks


def _unique_keys(pairs: Iterable[tuple[str, Any]]) -> dict[str, Any]:
    """Return an object; refuse a duplicate key."""
    result: dict[str, Any] = {}
    for key, value in pairs:
        if key in result:
            raise Unreadable(f"the key {excerpt(key)} occurs twice in one object")
        result[key] = value
    return result


def _no_decimal(text: str) -> Any:
    """Refuse a decimal number."""
    raise Unreadable(f"{excerpt(text)[1:-1]} is a decimal: write a float in hexadecimal, a fraction or a whole number")
