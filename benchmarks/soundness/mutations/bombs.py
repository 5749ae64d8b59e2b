"""Small files that would cost a careless checker hours or all memory, and texts that are no certificate."""

from __future__ import annotations

import json
import random
from collections.abc import Callable
from typing import Any

__all__ = ["BOMBS", "TEXTS"]

Document = dict[str, Any]


def file_of(n: int, steps: list[Any], **more: Any) -> Document:
    """Return a file of n variables in [0, 1]."""
    return {
        "format": "relaxations certificate",
        "version": 1,
        "variables": [f"x{k}" for k in range(n)],
        "box": [[0, 1] for _ in range(n)],
        "equalities": [],
        "inequalities": [],
        "steps": steps,
        **more,
    }


def step_of(n: int, objective: list[Any], **more: Any) -> Document:
    half = {"centre": ["1/2"] * n, "scale": ["1/2"] * n}
    return {"objective": objective, "bound": 0, **half, "equalities": [], "products": [], **more}


def degree(rng: random.Random) -> Document:
    """Return a monomial of high degree over many variables, or a power of one."""
    n = rng.choice([1, 2, 5, 40, 60])
    monomial = [k % n for k in range(rng.choice([20, 40, 63, 64]))]
    return file_of(n, [step_of(n, [[1, 0, monomial]])])


def nested_kinks(rng: random.Random) -> Document:
    """Return kinks that are powers, or sums, of the kinks before them."""
    n, power = rng.randint(4, 30), rng.choice([1, 2, 3, 8, 64])
    kinks = [
        {"variable": k, "kind": "positive part", "argument": [[1, 0, [k - 1] * power], [1, 0, [0]]]}
        for k in range(1, n)
    ]
    sides = [[k, 1] for k in range(n - 2)]
    inner = {"sides": sides, "rows": [], "defined": [], "steps": [step_of(n, [[1, 0, [n - 2]]])]}
    return file_of(n, [inner], box=[[1, 2]] * n, kinks=kinks)


def products(rng: random.Random) -> Document:
    """Return products of many dense rows."""
    n = rng.choice([3, 6, 10])
    row = [[1, 0, [i, j]] for i in range(n) for j in range(i, n)] + [[1, "1/9", []]]
    square = {"of": [["inequality", 0]] * rng.choice([3, 8, 30]), "weight": 1, "basis": [[]], "factor": [[1]]}
    return file_of(n, [step_of(n, [], products=[square])], inequalities=[row])


def box_products(rng: random.Random) -> Document:
    n = rng.choice([10, 25, 40])
    of = [[rng.choice(["above", "below", "inside"]), k % n] for k in range(rng.choice([15, 40, 200]))]
    return file_of(n, [step_of(n, [], products=[{"of": of, "weight": 1, "basis": [[]], "factor": [[1]]}])])


def wide_basis(rng: random.Random) -> Document:
    """Return a large basis of monomials of high degree."""
    n, size = 6, rng.choice([40, 120, 250])
    basis = [[rng.randrange(n) for _ in range(rng.randint(0, 20))] for _ in range(size)]
    return file_of(n, [step_of(n, [], products=[{"of": [], "weight": 1, "basis": basis, "factor": [[1]] * size}])])


def multipliers(rng: random.Random) -> Document:
    n = 8
    row = [[1, 0, [rng.randrange(n) for _ in range(rng.choice([2, 12, 30]))]] for _ in range(60)]
    terms = [[1, [rng.randrange(n) for _ in range(rng.choice([2, 12, 30]))]] for _ in range(200)]
    return file_of(n, [step_of(n, [], equalities=[[0, terms]] * rng.choice([1, 5]))], equalities=[row])


def many_parts(rng: random.Random) -> Document:
    count = rng.choice([500, 3000])
    ends = [f"{k}/{count}" for k in range(count + 1)]
    parts = [{"variable": 0, "box": ends[k : k + 2], "steps": []} for k in range(count)]
    return file_of(1, [{"hull": [0] * rng.choice([1, 60]), "parts": parts}])


def deep_parts(rng: random.Random) -> Document:
    """Return parts in parts: deep, or each shared step in twice as many as the one before."""
    inner: list[Any] = [step_of(1, [[1, 0, [0]]])]
    for _ in range(rng.choice([5, 8, 11, 150, 220])):
        inner = [{"hull": [0], "parts": [{"variable": 0, "box": [0, 1], "steps": inner}]}]
    return file_of(1, inner)


def deep_sides(rng: random.Random) -> Document:
    kinks = [{"variable": 1, "kind": "positive part", "argument": [[1, 0, [0]]]}]
    inner: list[Any] = [step_of(2, [[1, 0, [0]]])]
    for _ in range(rng.choice([5, 40, 150])):
        row = rng.choice([["above", 0], ["chord", 0, -1, 1]])
        inner = [{"sides": [], "rows": [row] * 30, "defined": [], "steps": inner}]
    return file_of(2, inner, kinks=kinks)


def deep_reach(rng: random.Random) -> Document:
    """Return boxes derived inside the faces of derived boxes; each multiplies the rows."""
    depth = rng.choice([2, 3, 6])
    steps: list[Any] = [step_of(1 + depth, [[1, 0, [1]]])]
    for _ in range(depth):
        faces = [{"variable": 0, "side": side, "steps": steps} for side in (1, -1)]
        steps = [{"reach": {"variables": [[0, 1]], "riding": [], "faces": faces}}]
    return file_of(1, steps, box=[[None, None]])


def long_numbers(rng: random.Random) -> Document:
    digits = "7" * rng.choice([400, 3999, 4001, 40_000])
    big = rng.choice([digits, f"1/{digits}", f"{digits}/{digits[1:]}3", "0x1.0p+9999", "0x1.0p-9999", "0x1.0p+99999"])
    n = rng.choice([1, 3])
    monomial = [k % n for k in range(rng.choice([1, 10, 64]))]
    step = step_of(n, [[1, 0, monomial]])
    step["centre"] = [big] * n
    step["scale"] = [big] * n
    return file_of(n, [step], box=[[0, big]] * n if rng.random() < 0.3 else [[0, 1]] * n)


def long_sum(rng: random.Random) -> Document:
    """Return fractions whose common denominator grows with every term."""
    count = rng.choice([100, 1000])
    terms = [[f"1/{10**30 + 2 * k + 1}", 0, [0]] for k in range(count)]
    factor = [[f"{k}/{10**20 + 2 * k + 1}"] for k in range(60)]
    square = {"of": [], "weight": 1, "basis": [[0]] * 60, "factor": factor}
    return file_of(1, [step_of(1, terms, products=[square])])


def many_cuts(rng: random.Random) -> Document:
    n = rng.choice([5, 40])
    row = [[1, "1/9", [0] * rng.choice([0, 5, 30]) + [k]] for k in range(1, n)]
    cuts = [{"equalities": [], "inequalities": [[0, 1]] * 20} for _ in range(20)]
    step = {"objective": [], "bound": 0, "outer": [0], "weights": [[k % 20, 1] for k in range(300)]}
    return file_of(n, [step] * 3, inequalities=[row], cuts=cuts)


def many_vanishing(rng: random.Random) -> Document:
    """Return chains of vanishing products that settle one by one, in many steps."""
    n = rng.choice([30, 120])
    rows = [[[1, 0, [k, k + 1]]] for k in range(n - 1)][::-1]
    box = [[0, 1] if k % 2 else [rng.choice([0, "1/2"]), 1] for k in range(n)]
    quotient = {"quotient": {"equality": 0, "variable": n - 1}}
    return file_of(n, [{"hull": [], "parts": [{"variable": 0, "box": [0, 1], "steps": []}]}] * 40 + [quotient],
                   box=box, equalities=rows)  # fmt: skip


def many_names(rng: random.Random) -> Document:
    n = rng.choice([2000, 8000])
    document = file_of(n, [{"hull": list(range(60)), "parts": [{"variable": 0, "box": [0, 1], "steps": []}]}])
    document["variables"] = [f"{'n' * 20}{k}" for k in range(n)]
    return document


BOMBS: dict[str, Callable[[random.Random], Document]] = {
    own.__name__.replace("_", " "): own
    for own in (degree, nested_kinks, products, box_products, wide_basis, multipliers, many_parts, deep_parts,
                deep_sides, deep_reach, long_numbers, long_sum, many_cuts, many_vanishing, many_names)
}  # fmt: skip


# ---------------------------------------------------------------- texts


def cut_short(text: str, rng: random.Random) -> str:
    return text[: rng.randrange(len(text))]


def one_character(text: str, rng: random.Random) -> str:
    k = rng.randrange(len(text))
    return text[:k] + rng.choice('0123456789"[]{},:x-. \x00é') + text[k + 1 :]


def twice(text: str, rng: random.Random) -> str:
    """Give a key twice."""
    key = rng.choice(["steps", "box", "version", "inequalities"])
    return text.replace("{", f'{{"{key}":{rng.choice(["[]", "1", "null"])},', 1)


def deep(text: str, rng: random.Random) -> str:
    depth = rng.choice([500, 5000, 100_000])
    return text.replace('"steps":[', '"steps":[' + "[" * depth + "]" * depth + ",", 1)


def odd_number(text: str, rng: random.Random) -> str:
    odd = ["0.1", "1e5", "NaN", "-Infinity", "1E400", "9" * 5000, "-0", "01", "0x1p3", "1" + "0" * 100_000]
    return text.replace('"bound":', f'"bound":{rng.choice(odd)},"was":', 1)


def another_header(text: str, rng: random.Random) -> str:
    return text.replace('"version":1', f'"version":{rng.choice(["2", "true", "1.0", "0", "[]", "null"])}', 1)


def another_thing(text: str, rng: random.Random) -> str:  # noqa: ARG001
    return rng.choice(["", "null", "[]", "3", '"x"', "{}", "\ufeff{}", "[" * 200_000, json.dumps(file_of(1, []))])


TEXTS: dict[str, Callable[[str, random.Random], str]] = {
    own.__name__.replace("_", " "): own
    for own in (cut_short, one_character, twice, deep, odd_number, another_header, another_thing)
}
