"""Mutations of what holds steps: parts, faces, sides, hulls, quotients, cuts; and files that are joined."""

from __future__ import annotations

import random
from collections.abc import Callable
from fractions import Fraction
from typing import Any

from benchmarks.soundness.mutations.exact import number
from benchmarks.soundness.mutations.places import copied, steps
from benchmarks.soundness.mutations.simple import shown

__all__ = ["INSIDE", "joined", "merged_variables"]

Document = dict[str, Any]


def of_kind(document: Document, key: str, rng: random.Random) -> Any:
    """Return one of the steps of a kind; raise where there is none."""
    return rng.choice([place.value for place in steps(document) if key in place.value])


def part(document: Document, rng: random.Random) -> None:
    """Drop, double, shrink, move or flip a part."""
    parts = of_kind(document, "parts", rng)["parts"]
    k, kind = rng.randrange(len(parts)), rng.randrange(8)
    own = parts[k]
    if kind == 0:
        del parts[k]
    elif kind == 1:
        parts.append(copied(own))
    elif kind == 2:
        own["side"] = -own["side"]
    elif kind == 3:
        own["steps"] = copied(parts[rng.randrange(len(parts))]["steps"])
    elif kind == 4:
        own["variable"] = rng.randrange(len(document["variables"]))
    elif kind == 5:
        parts[k] = {"kink": 0, "side": rng.choice([1, -1]), "steps": own["steps"]}
    elif kind == 6:
        own["steps"] = own["steps"][1:]
    else:
        low, high = (number(end) for end in own["box"])
        share = rng.choice([Fraction(1, 10**12), Fraction(1, 8), Fraction(-1, 8), Fraction(3)])
        moved = share * ((high - low) or 1)
        own["box"] = rng.choice([[shown(low + moved), shown(high)], [shown(low), shown(high - moved)]])


def kink_parts(document: Document, rng: random.Random) -> None:
    """Split at a kink in the place of ranges, on one side or both."""
    step = of_kind(document, "parts", rng)
    number_of = rng.randrange(len(document["kinks"]))
    inner = step["parts"][0]["steps"]
    sides = rng.choice([[1, -1], [1, 1], [1], [-1]])
    step["parts"] = [{"kink": number_of, "side": side, "steps": copied(inner)} for side in sides]


def empty_ranges(document: Document, rng: random.Random) -> None:
    """Branch where nothing was branched: a step becomes the only step of each of two ranges."""
    place = rng.choice([p for p in steps(document) if "products" in p.value])
    step = place.value
    v = rng.randrange(len(document["variables"]))
    low, high = (number(end) for end in document["box"][v])
    middle = low + (high - low) * Fraction(rng.randint(-1, 9), 8)
    gap = rng.choice([Fraction(0), Fraction(1, 10**9), Fraction(1, 4)])
    ranges = [[low, middle - gap], [middle + gap, high]]
    parts = [{"variable": v, "box": [shown(a), shown(b)], "steps": [copied(step)]} for a, b in ranges]
    if rng.random() < 0.5:
        place.put({"objective": step["objective"], "bound": step["bound"], "parts": parts})
    else:
        place.put({"hull": [rng.randrange(len(document["variables"])) for _ in range(2)], "parts": parts})


def branches_to_hull(document: Document, rng: random.Random) -> None:
    step = of_kind(document, "parts", rng)
    count = len(document["variables"])
    if "hull" in step:
        step["hull"] = [rng.randrange(count) for _ in range(rng.randint(0, 3))]
    elif rng.random() < 0.5:
        step["hull"] = list(range(count))
    else:
        step["equality"] = rng.randrange(len(document["equalities"]))


def sides(document: Document, rng: random.Random) -> None:
    """Flip, add or drop a decided side, or change a row or definition."""
    step = of_kind(document, "sides", rng)
    count, kind = len(document["kinks"]), rng.randrange(8)
    if kind == 0:
        rng.choice(step["sides"])[1] *= -1
    elif kind == 1:
        step["sides"].append([rng.randrange(count), rng.choice([1, -1])])
    elif kind == 2:
        del step["sides"][rng.randrange(len(step["sides"]))]
    elif kind == 3:
        del step["rows"][rng.randrange(len(step["rows"]))]
    elif kind == 4:
        rng.choice(step["rows"])[0] = rng.choice(["above", "chord", "low", "high", "side"])
    elif kind == 5:
        own = rng.choice([entry for entry in step["rows"] if len(entry) > 2])
        k = rng.randrange(2, len(own))
        own[k] = shown(number(own[k]) * rng.choice([Fraction(1, 2), Fraction(99, 100), Fraction(0), Fraction(-1)]))
    elif kind == 6:
        new = rng.choice([["above"], ["chord", "-1/2", "1/2"], ["low", "-1/2"], ["high", "1/2"], ["side"]])
        step["rows"].insert(rng.randrange(len(step["rows"]) + 1), [new[0], rng.randrange(count), *new[1:]])
    else:
        equality = rng.randrange(len(document["equalities"]))
        variable = rng.randrange(len(document["variables"]))
        step["defined"].append({"equality": equality, "variable": variable})


def around_sides(document: Document, rng: random.Random) -> None:
    """Put a step into sides of its own, some of them not decided."""
    own = [place for place in steps(document) if "products" in place.value]
    place = rng.choice(own)
    count = len(document["kinks"])
    decided = [[n, rng.choice([1, -1])] for n in range(count) if rng.random() < 0.5]
    place.put({"sides": decided, "rows": [], "defined": [], "steps": [place.value]})


def reach(document: Document, rng: random.Random) -> None:
    own = of_kind(document, "reach", rng)["reach"]
    faces, kind = own["faces"], rng.randrange(8)
    k = rng.randrange(len(faces))
    if kind == 0:
        del faces[k]
    elif kind == 1:
        faces[k]["side"] *= -1
    elif kind == 2:
        faces[k]["steps"] = copied(faces[rng.randrange(len(faces))]["steps"])
    elif kind == 3:
        pair = rng.choice(own["variables"])
        pair[1] = rng.choice([0, -1, 1, shown(number(pair[1]) / 2), shown(number(pair[1]) * 2)])
    elif kind == 4:
        own["riding"].append(rng.randrange(len(document["variables"])))
    elif kind == 5:
        del own["riding"][rng.randrange(len(own["riding"]))]
    elif kind == 6:
        del own["variables"][rng.randrange(len(own["variables"]))]
    else:
        own["variables"].append([rng.randrange(len(document["variables"])), 1])


def level(document: Document, rng: random.Random) -> None:
    """Move a level, or prove a step below one."""
    if rng.random() < 0.5:
        step = of_kind(document, "level", rng)
        step["level"] = shown(number(step["level"]) + rng.choice([-1, 1]) * Fraction(10) ** rng.randint(-9, 1))
        return
    place = rng.choice([p for p in steps(document) if "products" in p.value])
    step = place.value
    at = number(step["bound"]) + rng.choice([Fraction(0), Fraction(1, 10), Fraction(1), Fraction(-1, 100)])
    claim = {key: step[key] for key in ("objective", "bound")}
    place.put({**claim, "level": shown(at), "steps": [step]})


def new_quotient(document: Document, rng: random.Random) -> None:
    own = document["steps"]
    found = {"equality": rng.randrange(len(document["equalities"])), "variable": rng.randrange(len(document["box"]))}
    own.insert(rng.randrange(len(own) + 1), {"quotient": found})


def cuts(document: Document, rng: random.Random) -> None:
    step = of_kind(document, "weights", rng)
    kind = rng.randrange(5)
    if kind == 0:
        step["outer"] = [v for v in range(len(document["variables"])) if rng.random() < 0.4]
    elif kind == 1:
        rng.choice(step["weights"])[1] = rng.choice([0, -1, 1, 100])
    elif kind == 2:
        rng.choice(step["weights"])[0] = rng.randrange(len(document["cuts"]))
    elif kind == 3:
        step["weights"].append(rng.choice(step["weights"]))
    else:
        own = rng.choice(document["cuts"])
        family = rng.choice(["equalities", "inequalities"])
        own[family].append([rng.randrange(len(document[family])), rng.choice([1, -1, "1/3"])])


def move_level(document: Document, rng: random.Random) -> None:
    """Take steps out of what holds them, or put them into something else that holds steps."""
    outer = [p for p in steps(document) if any(key in p.value for key in ("parts", "sides", "reach"))]
    place = rng.choice(outer)
    step = place.value
    inner = step["steps"] if "sides" in step else rng.choice(step.get("parts") or step["reach"]["faces"])["steps"]
    document["steps"][rng.randrange(len(document["steps"])) : 0] = copied(inner)


# ---------------------------------------------------------------- files joined


def joined(left: Document, right: Document) -> Document:
    """Return both files as one, of all variables: as true as they were, before anything else is changed."""
    a, b = len(left["variables"]), len(right["variables"])
    n = a + b
    none = dict.fromkeys(("equalities", "inequalities", "kinks", "cuts"), 0)
    one = _moved(left, list(range(a)), n, none, len(right["inequalities"]))
    two = _moved(right, list(range(a, n)), n, {kind: len(left.get(kind, [])) for kind in none}, 0)
    return {
        **left,
        "variables": [*left["variables"], *(f"{name}'" for name in right["variables"])],
        **{kind: [*one[kind], *two[kind]] for kind in ("box", "equalities", "inequalities", "kinks", "cuts")},
        "steps": [*one["steps"], *two["steps"]],
    }


def _moved(document: Document, numbers: list[int], n: int, offset: dict[str, int], later: int) -> Document:
    """Renumber variables, rows, kinks and cuts; rows of sides and faces stand behind all inequalities."""
    own_count = len(numbers)
    first = offset["equalities"], offset["inequalities"]

    def factor(kind: str, k: int) -> list[Any]:
        if kind != "inequality":
            return [kind, variable(k)]
        return [kind, first[1] + k + (later if k >= len(document["inequalities"]) else 0)]

    def variable(v: int) -> int:
        return numbers[v] if v < own_count else n  # s of a face

    def terms(listed: list[Any]) -> list[Any]:
        return [[mid, rad, [variable(v) for v in m]] for mid, rad, m in listed]

    def placed(values: list[Any], missing: Any) -> list[Any]:
        total = [missing] * (n + len(values) - own_count)
        for v, value in enumerate(values):
            total[variable(v)] = value
        return total

    def step(old: dict[str, Any]) -> dict[str, Any]:
        new = dict(old)
        if "objective" in old:
            new["objective"] = terms(old["objective"])
        if "centre" in old:
            new["centre"], new["scale"] = placed(old["centre"], 0), placed(old["scale"], 1)
            new["equalities"] = [
                [first[0] + k, [[value, [variable(v) for v in m]] for value, m in own]] for k, own in old["equalities"]
            ]
            new["products"] = [
                {
                    **product,
                    "of": [factor(kind, k) for kind, k in product["of"]],
                    "basis": [[variable(v) for v in m] for m in product["basis"]],
                }
                for product in old["products"]
            ]
        if "weights" in old:
            new["outer"] = [variable(v) for v in old["outer"]]
            new["weights"] = [[offset["cuts"] + k, value] for k, value in old["weights"]]
        if "hull" in old:
            new["hull"] = [variable(v) for v in old["hull"]]
        if "equality" in old:
            new["equality"] = first[0] + old["equality"]
        if "quotient" in old:
            new["quotient"] = quotient(old["quotient"])
        if "parts" in old:
            new["parts"] = [
                {
                    **{key: value for key, value in own.items() if key in ("side", "box")},
                    **({"kink": offset["kinks"] + own["kink"]} if "kink" in own else {}),
                    **({"variable": variable(own["variable"])} if "variable" in own else {}),
                    "steps": [step(each) for each in own["steps"]],
                }
                for own in old["parts"]
            ]
        if "sides" in old:
            new["sides"] = [[offset["kinks"] + k, side] for k, side in old["sides"]]
            new["rows"] = [[kind, offset["kinks"] + k, *ends] for kind, k, *ends in old["rows"]]
            new["defined"] = [quotient(each) for each in old["defined"]]
        if "steps" in old:
            new["steps"] = [step(each) for each in old["steps"]]
        if "reach" in old:
            reach_of = old["reach"]
            new["reach"] = {
                "variables": [[variable(k), size] for k, size in reach_of["variables"]],
                "riding": [variable(k) for k in reach_of["riding"]],
                "faces": [
                    {**face, "variable": variable(face["variable"]), "steps": [step(each) for each in face["steps"]]}
                    for face in reach_of["faces"]
                ],
            }
        return new

    def quotient(old: dict[str, Any]) -> dict[str, Any]:
        return {"equality": first[0] + old["equality"], "variable": variable(old["variable"])}

    return {
        "box": document["box"],
        "equalities": [terms(row) for row in document["equalities"]],
        "inequalities": [terms(row) for row in document["inequalities"]],
        "kinks": [
            {**kink, "variable": variable(kink["variable"]), "argument": terms(kink["argument"])}
            for kink in document.get("kinks", [])
        ],
        "cuts": [
            {
                "equalities": [[first[0] + k, value] for k, value in own["equalities"]],
                "inequalities": [[first[1] + k, value] for k, value in own["inequalities"]],
            }
            for own in document.get("cuts", [])
        ],
        "steps": [step(each) for each in document["steps"]],
    }


def merged_variables(document: Document, rng: random.Random) -> None:
    """Let one variable be another everywhere in the rows, as if they had been the same."""
    i, j = rng.sample(range(len(document["variables"])), 2)
    for kind in ("equalities", "inequalities"):
        document[kind] = [[[a, r, [i if v == j else v for v in m]] for a, r, m in row] for row in document[kind]]


INSIDE: dict[str, Callable[[Document, random.Random], Any]] = {
    "part": part,
    "parts of a kink": kink_parts,
    "new parts": empty_ranges,
    "branches or hull": branches_to_hull,
    "sides": sides,
    "new sides": around_sides,
    "reach": reach,
    "quotient": new_quotient,
    "cut": cuts,
    "level": level,
    "level of steps": move_level,
    "merged variables": merged_variables,
}
