"""The benchmark that changes certificates: its oracle, its repairs, and a few hundred of its mutants."""

import random
from dataclasses import dataclass
from fractions import Fraction
from itertools import pairwise
from pathlib import Path

import pytest

from benchmarks.soundness.mutations import run
from benchmarks.soundness.mutations.exact import is_feasible, number, stated, terms_of
from benchmarks.soundness.mutations.inside import joined
from benchmarks.soundness.mutations.library import RECIPES, Genuine, library, points_of
from benchmarks.soundness.mutations.mutate import mutant
from benchmarks.soundness.mutations.residual import claim_all
from benchmarks.soundness.mutations.run import run_mutants
from benchmarks.soundness.mutations.section import markdown
from relaxations import check

QUICK = ("quadratic, sparse", "empty, dense", "cases of a product", "derived box", "quotient", "cuts", "kink", "sign")


@pytest.fixture(scope="module")
def genuine(tmp_path_factory: pytest.TempPathFactory) -> list[Genuine]:
    return library(tmp_path_factory.mktemp("genuine"), QUICK)


def test_there_are_genuine_files_of_every_kind(genuine: list[Genuine]) -> None:
    assert len(RECIPES) >= 20
    for one in genuine:
        own = stated(one.document())
        assert [is_feasible(own, point) for point in one.guesses] == [not one.name.startswith("empty")] * len(
            one.guesses
        )


@pytest.mark.parametrize(
    ("written", "value"),
    [(3, 3), ("-7/9", Fraction(-7, 9)), ("-0x1.8p+1", -3), ("0x1.0p-1080", Fraction(1, 2**1080)), ("0x0.8p+0", 0.5)],
)
def test_numbers_are_read_exactly(written: int | str, value: Fraction) -> None:
    assert number(written) == value


def document(**more: object) -> dict[str, object]:
    plain = {"variables": ["x", "y"], "box": [[0, 2], [None, 3]], "equalities": [], "inequalities": []}
    return plain | more


@pytest.mark.parametrize(
    ("more", "point", "feasible"),
    [
        ({}, (2, -100), True),
        ({}, (2, 4), False),
        ({"equalities": [[[1, 0, [0]], [-1, 0, [1]]]]}, (1, 1), True),
        ({"equalities": [[[1, 0, [0]], [-1, "1/10", [1]]]]}, (1, Fraction(10, 11)), True),
        ({"equalities": [[[1, 0, [0]], [-1, "1/10", [1]]]]}, (1, Fraction(9, 11)), False),
        ({"inequalities": [[[1, 0, [1, 1]], [-1, "1/2", [0]]]]}, (2, 1), True),
        ({"inequalities": [[[1, 0, [1, 1]], [-1, "1/2", [0]]]]}, (2, Fraction(1, 2)), False),
        ({"kinks": [{"variable": 1, "kind": "positive part", "argument": [[2, 0, [0]], [-1, 0, []]]}]}, (1, 1), True),
        ({"kinks": [{"variable": 1, "kind": "positive part", "argument": [[2, 0, [0]], [-1, 0, []]]}]}, (0, -1), False),
        ({"kinks": [{"variable": 1, "kind": "sign", "argument": [[1, 0, [0]], [-1, 0, []]]}]}, (0, -1), True),
        ({"kinks": [{"variable": 1, "kind": "sign", "argument": [[1, 0, [0]], [-1, 0, []]]}]}, (1, 1), False),
    ],
)
def test_feasibility_is_decided_by_the_definition(more: dict, point: tuple, feasible: bool) -> None:
    assert is_feasible(stated(document(**more)), [Fraction(value) for value in point]) is feasible


def test_points_reach_the_least_value_of_an_objective() -> None:
    """Minimise y where x y = 1 and y is the positive part of z."""
    kinks = [{"variable": 1, "kind": "positive part", "argument": [[1, 0, [2]]]}]
    names, rows = ["x", "y", "z"], [[[1, 0, [0, 1]], [-1, 0, []]]]
    own = stated(document(variables=names, box=[[0, 4], [0, 5], [-1, 5]], equalities=rows, kinks=kinks))
    points = points_of(own, [terms_of([[1, 0, [1]]])], [], random.Random(1), starts=4)
    assert all(is_feasible(own, point) for point in points)
    assert 0 <= min(point[1] for point in points) - Fraction(1, 4) < 1e-6


def test_a_repaired_claim_is_what_the_arithmetic_of_the_check_allows(genuine: list[Genuine]) -> None:
    for one in genuine:
        before, changed = check.check(one.document()), one.document()
        claim_all(changed)
        after = check.check(changed)
        assert len(before) == len(after)
        for old, new in zip(before, after, strict=True):
            assert old.bound - Fraction(1e-12) < new.bound < old.bound + max(abs(old.bound), 1)


def test_joined_files_prove_what_both_did(genuine: list[Genuine]) -> None:
    for left, right in pairwise(genuine):
        assert check.check(joined(left.document(), right.document()))


def test_a_number_gives_the_same_mutant(genuine: list[Genuine]) -> None:
    assert [mutant(3, n, genuine) for n in range(40)] == [mutant(3, n, genuine) for n in range(40)]
    assert len({mutant(3, n, genuine).text for n in range(40)}) > 35


def test_no_mutant_is_accepted_that_is_false(genuine: list[Genuine]) -> None:
    batch = run_mutants(genuine, 11, 0, 300)
    assert [(failure["number"], failure["reason"]) for failure in batch.failures] == []
    verdicts = {name: sum(own[name] for own in batch.verdicts.values()) for name in run.VERDICTS}
    assert sum(verdicts.values()) == 300
    assert verdicts["accepted"] >= 30
    assert verdicts["accepted"] + verdicts["refused"] >= 150
    assert batch.judged >= 20


@dataclass(frozen=True)
class Objective:
    mid: dict[tuple[int, ...], Fraction]
    rad: dict[tuple[int, ...], Fraction]


@dataclass(frozen=True)
class Believed:
    objective: Objective
    bound: Fraction
    empty: bool = False


def test_a_check_that_believes_everything_is_caught(genuine: list[Genuine], monkeypatch: pytest.MonkeyPatch) -> None:
    """A raised claim, a lost row and a wider box are seen, each by a feasible point."""

    def believe(own: dict) -> tuple[Believed, ...]:
        try:
            stated(own)
            found = []
            for step in own["steps"]:
                if "bound" in step:
                    mid = {tuple(m): value for value, _, m in terms_of(step["objective"])}
                    rad = {tuple(m): value for _, value, m in terms_of(step["objective"])}
                    bound = number(step["bound"])
                    found.append(Believed(Objective(mid, rad), bound, bound > 0 and not mid))
            return tuple(found)
        except Exception as error:
            raise check.Refused(f"step: {error}") from None

    monkeypatch.setattr(check, "check", believe)
    batch = run_mutants(genuine, 11, 0, 300)
    assert sum(failure["reason"].startswith("false claim") for failure in batch.failures) > 10


def test_what_takes_too_long_or_ends_in_a_traceback_is_a_failure(
    genuine: list[Genuine], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    path = tmp_path / "file.json"
    path.write_text(genuine[0].text)

    def endless(_: object) -> None:
        while True:
            pass

    def greedy(_: object) -> None:
        list(range(10**9))

    def broken(_: object) -> None:
        raise KeyError("parts")

    monkeypatch.setattr(run, "SECONDS", 0.2)
    for behaviour, reason in ((endless, "0.2 s"), (broken, "KeyError: 'parts'"), (greedy, "500 MB|0.2 s")):
        monkeypatch.setattr(check, "check", behaviour)
        verdict, found, *_ = run.checked(path)
        assert verdict == "failure"
        assert any(part in found for part in reason.split("|"))


def test_the_section_counts_what_failed(genuine: list[Genuine]) -> None:
    batch = run_mutants(genuine, 11, 0, 20)
    failure = {"number": 1, "reason": "false claim: x >= 7 is false", "changes": [], "text": ""}
    text = markdown([batch, run.Batch(11, 20, 1, {}, {}, failures=[failure])], len(genuine), 11)
    assert f"21 changes of {len(QUICK)} genuine certificate files" in text
    assert "- 1 x false claim" in text
