"""Which effects of the chosen set the test part does not show."""

from types import SimpleNamespace

import pytest

from smid.diagnosis.assemble import too_small


def small(
    errors: dict[tuple[str, ...], float], alternatives: tuple[str, ...] = (), heard: str | None = None
) -> list[str]:
    """Judge effects by the test errors of the sets that were visited, the chosen one first."""
    visited = [
        SimpleNamespace(
            names=names,
            merit=-float(k),
            effects=SimpleNamespace(trials=[SimpleNamespace(effect=n) for n in names]),
        )
        for k, names in enumerate(errors)
    ]
    found = SimpleNamespace(chosen=visited[0], alternatives=alternatives)
    after = next(iter(errors.values()))
    trials = too_small(found, visited, lambda one: errors[one.names if one else ()], after, 0.1, heard)
    return [trial.effect for trial in trials]


@pytest.mark.parametrize(
    ("errors", "expected"),
    [
        # Each stands in for the other, and without both the error is nine times as large.
        ({("a", "b"): 1.0, ("a",): 1.02, ("b",): 1.01, (): 9.0}, ["b"]),
        ({("a", "b"): 1.0, ("a",): 1.02, ("b",): 1.01, (): 1.05}, ["b", "a"]),
        ({("a", "b"): 1.0, ("a",): 1.02, ("b",): 4.0, (): 9.0}, ["b"]),
        ({("a", "b"): 1.0, ("a",): 3.0, ("b",): 4.0, (): 9.0}, []),
        # Of two alike, one has a name of its own to be left out by.
        ({("a", "a", "b"): 1.0, ("a", "b"): 1.0, ("a", "a"): 5.0, ("b",): 6.0, (): 9.0}, ["a"]),
    ],
)
def test_what_the_test_part_does_not_show_is_judged_one_after_another(
    errors: dict[tuple[str, ...], float], expected: list[str]
) -> None:
    assert small(errors) == expected


def test_what_an_experiment_has_to_decide_is_never_too_small() -> None:
    errors = {("a", "b"): 1.0, ("a",): 1.0, ("b",): 1.0, (): 1.0}
    assert small(errors, alternatives=("b", "c")) == ["a"]


def test_noise_that_the_residual_shows_too_is_never_too_small() -> None:
    errors = {("a", "b"): 1.0, ("a",): 1.0, ("b",): 1.0, (): 1.0}
    assert small(errors, heard="b") == ["a"]
