"""Mutations of one thing at a time: numbers, boxes, rows, weights, bases, names, kinks and types.

Each takes a document and changes it in place; one that finds nothing to change raises an error or returns False.
"""

from __future__ import annotations

import random
from collections.abc import Callable
from fractions import Fraction
from typing import Any

from benchmarks.soundness.mutations.exact import number
from benchmarks.soundness.mutations.places import (
    Place,
    bounds,
    claims,
    copied,
    monomials,
    polynomials,
    put_numbers,
    step_lists,
    steps,
    terms,
)

__all__ = ["SIMPLE", "changed_number"]

Document = dict[str, Any]
Operator = Callable[[Document, random.Random], Any]


def changed_number(value: Any, rng: random.Random) -> Any:
    """Return a number in the place of another."""
    old = Fraction(0) if value is None else number(value)
    kind = rng.randrange(11)
    if kind == 0:
        return shown(-old)
    if kind == 1:
        return 0
    if kind == 2:
        return shown(old * Fraction(2) ** rng.choice([-40, -10, -3, -1, 1, 3, 10, 40]))
    if kind in (3, 4):
        return shown(old + (1 if rng.random() < 0.5 else -1) * Fraction(10) ** rng.randint(-18, 0))
    if kind == 5:
        return shown(old * (1 + Fraction(rng.randint(-9, 9), 10 ** rng.randint(1, 12))))
    if kind == 6:
        return shown(old.limit_denominator(10 ** rng.randint(0, 6)))
    if kind == 7:
        return rng.choice([1, -1, 2, "1/2", "-1/3", 10, -7])
    if kind == 8:
        return rng.choice([10**30, -(10**30), "0x1.0p+900", "-0x1.fffp+1023", f"1/{10**40}", "0x1.0p-1070"])
    if kind == 9:
        return shown(old + rng.choice([-1, 1]))
    return shown(Fraction(rng.randint(-20, 20), rng.randint(1, 9)))


def shown(value: Fraction) -> Any:
    return value.numerator if value.denominator == 1 and abs(value) < 10**6 else str(value)


def numbers(document: Document, rng: random.Random) -> Any:
    return put_numbers(document, rng, lambda value: changed_number(value, rng))


def box(document: Document, rng: random.Random) -> None:
    """Widen, narrow, remove, swap or move ends."""
    k = rng.randrange(len(document["box"]))
    low, high = document["box"][k]
    kind = rng.randrange(6)
    if kind == 0:
        document["box"][k][rng.randrange(2)] = None
    elif kind == 1:
        document["box"][k] = [high, low]
    elif kind == 2:
        j = rng.randrange(len(document["box"]))
        document["box"][k], document["box"][j] = document["box"][j], document["box"][k]
    elif low is None or high is None:
        size = rng.choice([1, 10, "1/2"])
        document["box"][k] = [shown(-number(size)), size]
    else:
        a, b = number(low), number(high)
        share = rng.choice([Fraction(1, 10**9), Fraction(1, 100), Fraction(1, 4), Fraction(3)])
        moved = (b - a) * share * (1 if kind < 5 else -1)
        document["box"][k] = [shown(a - moved * rng.randrange(2)), shown(b + moved)]


def row(document: Document, rng: random.Random) -> None:
    """Drop, double, negate, exchange or move a row, or one of its terms."""
    family = rng.choice([kind for kind in ("equalities", "inequalities") if document[kind]])
    rows = document[family]
    k, kind = rng.randrange(len(rows)), rng.randrange(9)
    if kind == 0:
        del rows[k]
    elif kind == 1:
        rows.insert(rng.randrange(len(rows) + 1), list(rows[k]))
    elif kind == 2:
        rows[k] = [[shown(-number(mid)), rad, m] for mid, rad, m in rows[k]]
    elif kind == 3:
        j = rng.randrange(len(rows))
        rows[k], rows[j] = rows[j], rows[k]
    elif kind == 4:
        other = "equalities" if family == "inequalities" else "inequalities"
        document[other].insert(rng.randrange(len(document[other]) + 1), rows[k])
    elif kind == 5:
        rows[k] = []
    elif kind == 6:
        del rows[k][rng.randrange(len(rows[k]))]
    elif kind == 7:
        rows[k].append([rng.choice([1, -1, "1/3"]), 0, [rng.randrange(len(document["variables"]))]])
    else:
        size = rng.choice([Fraction(-2), Fraction(1, 2), Fraction(3)])
        rows[k] = [[shown(number(mid) * size), shown(number(rad) * abs(size)), m] for mid, rad, m in rows[k]]


def foreign_row(document: Document, rng: random.Random, others: list[Any]) -> None:
    """Put a row of another file in the place of one."""
    family = rng.choice([kind for kind in ("equalities", "inequalities") if document[kind]])
    other = rng.choice(others)
    count = len(document["variables"])
    source = [*other["equalities"], *other["inequalities"]]
    found = [[mid, rad, [v % count for v in m]] for mid, rad, m in rng.choice(source)]
    document[family][rng.randrange(len(document[family]))] = found


def vanishing(document: Document, rng: random.Random) -> None:
    """Make an equality a single monomial."""
    k = rng.randrange(len(document["equalities"]))
    count = len(document["variables"])
    variables = sorted(rng.randrange(count) for _ in range(rng.randint(0, 3)))
    document["equalities"][k] = [[rng.choice([1, "1/3", 0]), rng.choice([0, 0, "1/9", 1]), variables]]


def weight(document: Document, rng: random.Random) -> None:
    product = rng.choice([p for step in bounds(document) for p in step["products"]])
    product["weight"] = rng.choice([0, -1, shown(-number(product["weight"])), 2, "1/2"])


def multiplier(document: Document, rng: random.Random) -> None:
    """Change what an equality or a cut is multiplied by: another row, another sign, a further term."""
    pairs = [e for step in bounds(document) for e in step["equalities"]]
    kind = rng.randrange(5)
    if kind == 0 and document.get("cuts"):
        cut = rng.choice(document["cuts"])
        pair = rng.choice([*cut["equalities"], *cut["inequalities"]])
        pair[1] = rng.choice([shown(-number(pair[1])), 1, -1, 0])
        return
    if kind == 1:
        step = rng.choice(bounds(document))
        k = rng.randrange(len(document["equalities"]))
        step["equalities"].append([k, [[rng.choice([1, -1, "1/7"]), []]]])
        return
    pair = rng.choice(pairs)
    if kind == 2:
        pair[0] = rng.randrange(len(document["equalities"]))
    elif kind == 3:
        pair[1].append([rng.choice([1, -1, "1/7"]), [rng.randrange(len(document["variables"]))]])
    else:
        del pair[1][rng.randrange(len(pair[1]))]


def product(document: Document, rng: random.Random) -> None:
    """Change which constraints a square is multiplied by."""
    of = rng.choice([p for step in bounds(document) for p in step["products"]])["of"]
    kinds = ["inequality", "above", "below", "inside"]
    count = len(document["variables"])
    kind = rng.randrange(4)
    if kind == 0:
        of.append([rng.choice(kinds), rng.randrange(count)])
    elif kind == 1:
        del of[rng.randrange(len(of))]
    elif kind == 2:
        rng.choice(of)[0] = rng.choice(kinds)
    else:
        rng.choice(of)[1] = rng.randrange(count)


def basis(document: Document, rng: random.Random) -> None:
    """Alter, exchange or drop monomials and rows of factors."""
    own = rng.choice([p for step in bounds(document) for p in step["products"] if p["basis"]])
    k, kind = rng.randrange(len(own["basis"])), rng.randrange(4)
    if kind == 0:
        del own["basis"][k], own["factor"][k]
    elif kind == 1:
        del own["factor"][k]
    elif kind == 2:
        own["factor"] = [entries[:-1] for entries in own["factor"]]
    else:
        j = rng.randrange(len(own["basis"]))
        own["basis"][k], own["basis"][j] = own["basis"][j], own["basis"][k]


def monomial(document: Document, rng: random.Random) -> None:
    place, count = rng.choice(monomials(document, rng)), len(document["variables"])
    old, kind = place.value, rng.randrange(4)
    if kind == 0:
        place.put([*old, rng.randrange(count)])
    elif kind == 1:
        place.put(old[1:])
    elif kind == 2:
        place.put([rng.randrange(count) for _ in old])
    else:
        place.put(rng.choice([[], old + old, [0] * rng.randint(1, 6)]))


def radius(document: Document, rng: random.Random) -> None:
    term = rng.choice(terms(document, rng))
    old = number(term[1])
    term[1] = rng.choice([0, shown(-old), "-1/9", shown(2 * old), "1/1000", 1, "0x1.0p-50"])


def objective(document: Document, rng: random.Random) -> None:
    """Bound something else: nothing at all, another variable, the opposite."""
    claim, count = rng.choice(claims(document)), len(document["variables"])
    old = claim["objective"]
    claim["objective"] = rng.choice(
        [[], [[rng.choice([1, -1]), 0, [rng.randrange(count)]]], [[shown(-number(a)), r, m] for a, r, m in old]]
    )


def kink(document: Document, rng: random.Random) -> None:
    kinks = document["kinks"]
    k, kind = rng.randrange(len(kinks)), rng.randrange(7)
    if kind == 0:
        kinks[k]["kind"] = rng.choice(["sign", "positive part"])
    elif kind == 1:
        rng.shuffle(kinks)
    elif kind == 2:
        del kinks[k]
    elif kind == 3:
        kinks[k]["variable"] = rng.randrange(len(document["variables"]))
    elif kind == 4:
        kinks[k]["argument"] = [[shown(-number(a)), r, m] for a, r, m in kinks[k]["argument"]]
    elif kind == 5:
        kinks[k]["argument"] = rng.choice(
            [[], [[1, 0, []]], [[0, 1, []]], kinks[rng.randrange(len(kinks))]["argument"]]
        )
    else:
        kinks[k]["argument"].append([rng.choice([1, "-1/2"]), 0, [rng.randrange(len(document["variables"]))]])


def new_kink(document: Document, rng: random.Random) -> None:
    """Let a variable be a kink that it was not."""
    a, b = rng.sample(range(len(document["variables"])), 2)
    kind = rng.choice(["sign", "positive part"])
    term = [rng.choice([1, -1, 2]), 0, [b]]
    document.setdefault("kinks", []).append({"variable": a, "kind": kind, "argument": [term]})


def name(document: Document, rng: random.Random) -> None:
    names = document["variables"]
    k = rng.randrange(len(names))
    odd = [
        "",
        names[rng.randrange(len(names))],
        "a" * 5000,
        "\x1b[31mx",
        "x\nstep 2: y >= 7",
        "\ud800",
        "\u202ex",
        "x\x00",
    ]
    names[k] = rng.choice(odd)


def index(document: Document, rng: random.Random) -> None:
    """Refer to something that is not there."""
    found = monomials(document, rng)
    found += [Place(pair, 0) for step in bounds(document) for pair in step["equalities"]]
    place = rng.choice(found)
    bad = rng.choice([-1, len(document["variables"]), 10**9, -(10**9)])
    place.put([bad] if isinstance(place.value, list) else bad)


def types(document: Document, rng: random.Random) -> None:
    """Put something of another type anywhere."""
    node: Any = document
    for _ in range(rng.randint(1, 7)):
        keys = list(node) if isinstance(node, dict) else list(range(len(node)))
        key = rng.choice(keys)
        if not isinstance(node[key], dict | list) or not node[key] or rng.random() < 0.1:
            break
        node = node[key]
    odd = [
        True,
        False,
        None,
        "",
        "1e3",
        "0x",
        "1/0",
        [],
        {},
        [[]],
        "x",
        -1,
        "@digits",
        "@decimal",
        {"steps": []},
        "٣",
        "1_0",
    ]
    if rng.random() < 0.2:
        del node[key]
    else:
        node[key] = rng.choice(odd)


def rename_key(document: Document, rng: random.Random) -> None:
    """Add a key that changes what kind of step this is, or take one away."""
    step = rng.choice(steps(document)).value
    if rng.random() < 0.6:
        key = rng.choice(["reach", "quotient", "sides", "hull", "parts", "weights", "equality", "rows", "defined"])
        source = [other.value[key] for other in steps(document) if key in other.value]
        step[key] = copied(rng.choice(source)) if source else rng.choice([[], {}, 0])
    else:
        del step[rng.choice(list(step))]


def order(document: Document, rng: random.Random) -> Any:
    """Drop, double, exchange or move steps."""
    lists = [own for own in step_lists(document) if own]
    own, other = rng.choice(lists), rng.choice(lists)
    k, kind = rng.randrange(len(own)), rng.randrange(5)
    if kind == 0 and (own is not document["steps"] or len(own) > 1):
        del own[k]
    elif kind == 1:
        own.insert(rng.randrange(len(own) + 1), copied(own[k]))
    elif kind == 2:
        rng.shuffle(own)
    elif own is not other or len(own) > 1:
        step = copied(own[k])
        if kind == 3:
            del own[k]
        other.insert(rng.randrange(len(other) + 1), step)
    return None if len(own) > 0 else False


def exchange_polynomials(document: Document, rng: random.Random) -> None:
    a, b = rng.sample(polynomials(document), 2)
    old = a.value
    a.put(b.value)
    b.put(old)


SIMPLE: dict[str, Operator] = {
    "number": numbers,
    "box": box,
    "row": row,
    "vanishing row": vanishing,
    "weight": weight,
    "multiplier": multiplier,
    "product": product,
    "basis": basis,
    "monomial": monomial,
    "radius": radius,
    "objective": objective,
    "kink": kink,
    "new kink": new_kink,
    "name": name,
    "index": index,
    "type": types,
    "key of a step": rename_key,
    "order of steps": order,
    "exchanged polynomials": exchange_polynomials,
}
