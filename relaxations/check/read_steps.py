"""Read the steps of a proof. Each step is read when it is checked, so a long proof need not fit into memory."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from fractions import Fraction
from typing import Any

from relaxations.check import steps
from relaxations.check.arithmetic import Polynomial, Unreadable
from relaxations.check.forms import MANY, Reader, excerpt

DEEPEST = 100  # levels of steps inside steps


def read_proof(reader: Reader, value: Any, inside: str) -> Iterator[Any]:
    """Yield the steps one by one."""
    if inside.count("step ") >= DEEPEST:
        raise Unreadable(f"the steps are nested more than {DEEPEST} deep")
    for number, step in enumerate(reader.items(value, f"{inside}steps"), start=1):
        yield _step(reader, step, f"{inside}step {number}")


def _step(reader: Reader, step: Any, where: str) -> Any:
    """Return a step; one of its keys determines its kind."""
    kinds = {
        "reach": _reach,
        "quotient": _division,
        "sides": _sides,
        "fixed": _fixed,
        "hull": _hull,
        "level": _level,
        "parts": _branches,
        "weights": _cuts,
    }
    kind = next((kind for kind in kinds if isinstance(step, dict) and kind in step), None)
    return (kinds[kind] if kind else _bound)(reader, step, where)


def _claim(
    reader: Reader, step: Any, where: str, keys: Iterable[str], optional: Iterable[str] = ()
) -> tuple[dict[str, Any], Polynomial, Fraction]:
    """Return the fields of a step, its objective and its bound."""
    fields = reader.fields(step, where, ("objective", "bound", *keys), optional)
    objective = reader.polynomial(fields["objective"], f"{where}, objective")
    return fields, objective, reader.number(fields["bound"], f"{where}, bound")


def _bound(reader: Reader, step: Any, where: str) -> steps.Bound:
    fields, objective, bound = _claim(reader, step, where, ("centre", "scale", "equalities", "products"))
    centre, scale = (
        [reader.number(v, f"{where}, {key}") for v in reader.items(fields[key], f"{where}, {key}", reader.count)]
        for key in ("centre", "scale")
    )
    equalities = []
    for entry in reader.items(fields["equalities"], f"{where}, equalities"):
        k, terms = reader.items(entry, f"{where}, a multiplier", 2)
        equalities.append((reader.index(k, where, MANY), reader.terms(terms, f"{where}, a multiplier")))
    products = [
        _product(reader, entry, f"{where}, product {j}")
        for j, entry in enumerate(reader.items(fields["products"], f"{where}, products"))
    ]
    return steps.Bound(objective, bound, centre, scale, equalities, products)


def _product(reader: Reader, entry: Any, where: str) -> steps.Product:
    fields = reader.fields(entry, where, ("weight", "basis", "factor", "of"))
    basis = [reader.monomial(m, where) for m in reader.items(fields["basis"], where)]
    rows = reader.items(fields["factor"], f"{where}, factor", len(basis))
    factor = [[reader.number(value, where) for value in reader.items(row, where)] for row in rows]
    if len({len(row) for row in factor}) > 1:
        raise Unreadable(f"{where}: the factor's rows differ in length")
    of = []
    for part in reader.items(fields["of"], where):
        kind, k = reader.items(part, where, 2)
        if kind not in ("inequality", "above", "below", "inside"):
            raise Unreadable(f"{where}: {excerpt(kind)} is none of 'inequality', 'above', 'below', 'inside'")
        of.append((kind, reader.index(k, where, MANY if kind == "inequality" else None)))
    return steps.Product(reader.number(fields["weight"], where), basis, factor, of)


def _cuts(reader: Reader, step: Any, where: str) -> steps.Cuts:
    fields, objective, bound = _claim(reader, step, where, ("outer", "weights"))
    outer = frozenset(reader.index(v, where) for v in reader.items(fields["outer"], f"{where}, outer"))
    return steps.Cuts(objective, bound, outer, reader.pairs(fields["weights"], f"{where}, weights", MANY))


def _branches(reader: Reader, step: Any, where: str) -> steps.Branches:
    fields, objective, bound = _claim(reader, step, where, ("parts",), ("equality",))
    return steps.Branches(objective, bound, _parts(reader, fields, where), _equality(reader, fields, where))


def _hull(reader: Reader, step: Any, where: str) -> steps.Hull:
    fields = reader.fields(step, where, ("hull", "parts"), ("equality",))
    variables = [reader.index(v, where) for v in reader.items(fields["hull"], f"{where}, hull")]
    return steps.Hull(variables, _parts(reader, fields, where), _equality(reader, fields, where))


def _equality(reader: Reader, fields: dict[str, Any], where: str) -> int | None:
    return reader.index(fields["equality"], where, MANY) if "equality" in fields else None


def _parts(reader: Reader, fields: dict[str, Any], where: str) -> Iterator[steps.Range | steps.OneSide]:
    for k, part in enumerate(reader.items(fields["parts"], f"{where}, parts"), start=1):
        inside = f"{where}, part {k}"
        if isinstance(part, dict) and "kink" in part:
            own = reader.fields(part, inside, ("kink", "side", "steps"))
            proof = read_proof(reader, own["steps"], f"{inside}, ")
            yield steps.OneSide(reader.index(own["kink"], inside, MANY), reader.side(own["side"], inside), proof)
        else:
            own = reader.fields(part, inside, ("variable", "box", "steps"))
            low, high = (reader.number(end, inside) for end in reader.items(own["box"], inside, 2))
            proof = read_proof(reader, own["steps"], f"{inside}, ")
            yield steps.Range(reader.index(own["variable"], inside), low, high, proof)


def _level(reader: Reader, step: Any, where: str) -> steps.Level:
    fields, objective, bound = _claim(reader, step, where, ("level", "steps"))
    level = reader.number(fields["level"], f"{where}, level")
    return steps.Level(objective, bound, level, read_proof(reader, fields["steps"], f"{where}, "))


def _quotient(reader: Reader, value: Any, where: str) -> steps.Quotient:
    fields = reader.fields(value, where, ("equality", "variable"))
    return steps.Quotient(reader.index(fields["equality"], where, MANY), reader.index(fields["variable"], where))


def _division(reader: Reader, step: Any, where: str) -> steps.Quotient:
    return _quotient(reader, reader.fields(step, where, ("quotient",))["quotient"], where)


def _reach(reader: Reader, step: Any, where: str) -> steps.Reach:
    reach = reader.fields(reader.fields(step, where, ("reach",))["reach"], where, ("variables", "riding", "faces"))
    sizes = dict(reader.pairs(reach["variables"], f"{where}, variables", reader.count))
    riding = [reader.index(v, where) for v in reader.items(reach["riding"], f"{where}, riding")]
    return steps.Reach(sizes, riding, _faces(reader, reach["faces"], where))


def _faces(reader: Reader, value: Any, where: str) -> Iterator[steps.Face]:
    for face in reader.items(value, f"{where}, faces"):
        fields = reader.fields(face, f"{where}, a face", ("variable", "side", "steps"))
        variable, side = reader.index(fields["variable"], where), reader.side(fields["side"], where)
        reader.count += 1  # the steps of a face have one more variable, s
        yield steps.Face(variable, side, read_proof(reader, fields["steps"], f"{where}, face {variable}, "))
        reader.count -= 1


def _sides(reader: Reader, step: Any, where: str) -> steps.Sides:
    fields = reader.fields(step, where, ("sides", "rows", "defined", "steps"))
    sides = {}
    for pair in reader.items(fields["sides"], f"{where}, sides"):
        number, side = reader.items(pair, f"{where}, sides", 2)
        sides[reader.index(number, where, MANY)] = reader.side(side, where)
    rows = []
    for k, entry in enumerate(reader.items(fields["rows"], f"{where}, rows")):
        place, row = f"{where}, row {k}", reader.items(entry, f"{where}, row {k}")
        if not 2 <= len(row) <= 4 or not isinstance(row[0], str):
            raise Unreadable(f"{place} is not a kind, a kink and at most two ends")
        ends = [reader.number(end, place) for end in row[2:]]
        rows.append(steps.Row(row[0], reader.index(row[1], place, MANY), ends))
    defined = [_quotient(reader, entry, where) for entry in reader.items(fields["defined"], f"{where}, defined")]
    return steps.Sides(sides, rows, defined, read_proof(reader, fields["steps"], f"{where}, "))


def _fixed(reader: Reader, step: Any, where: str) -> steps.Fixed:
    fields = reader.fields(step, where, ("fixed", "steps"))
    rows = []
    for k, entry in enumerate(reader.items(fields["fixed"], f"{where}, fixed")):
        place = f"{where}, row {k}"
        row = reader.fields(entry, place, ("equality", "sign", "slack", "values"))
        equality, sign = reader.index(row["equality"], place, MANY), reader.side(row["sign"], place)
        values = reader.pairs(row["values"], place, reader.count)
        rows.append(steps.FixedRow(equality, sign, reader.number(row["slack"], place), values))
    return steps.Fixed(rows, read_proof(reader, fields["steps"], f"{where}, "))
