"""Bundles of certificates about parts of a record: true ones hold what they should, forged ones are refused."""

import copy
import json
import random
from fractions import Fraction
from itertools import pairwise

import pytest

from relaxations import check
from relaxations.check import bundle
from relaxations.check.arithmetic import Refused, Unreadable
from relaxations.errors import ProblemError
from relaxations.proof.certificate_file import write_content

BOX = (0, 8)


def certificate(low, high, box=BOX, name="x"):
    """Prove low <= x <= high from two inequalities that state it; no point where high < low."""
    sides = [[[1, 0, [0]], [str(-Fraction(low)), 0, []]], [[-1, 0, [0]], [str(Fraction(high)), 0, []]]]
    steps = [
        {
            "objective": [[sign, 0, [0]]],
            "bound": str(sign * Fraction(end)),
            "centre": [0],
            "scale": [1],
            "equalities": [],
            "products": [{"of": [["inequality", k]], "weight": 1, "basis": [[]], "factor": [[1]]}],
        }
        for k, (sign, end) in enumerate(((1, low), (-1, high)))
    ]
    return {
        "format": check.FORMAT,
        "version": check.VERSION,
        "variables": [name],
        "box": [[str(Fraction(end)) for end in box]],
        "equalities": [],
        "inequalities": sides,
        "steps": steps,
    }


def part(first, last, *certificates):
    return {"windows": [[0, first, last]], "certificates": list(certificates)}


def content(outliers, *rounds):
    return {
        "format": bundle.FORMAT,
        "version": bundle.VERSION,
        "variables": ["x"],
        "box": [list(BOX)],
        "outliers": outliers,
        "rounds": [{"parts": list(parts), "spoilt": list(spoilt)} for parts, spoilt in rounds],
    }


def claim(found):
    return bundle.proven(bundle.document(found))


# One outlier: of three parts the last contradicts the others, a stretch of it is spoilt, and the rest is one part.
TRUE = content(
    1,
    (
        [part(0, 9, certificate(1, 3)), part(10, 19, certificate(2, 4)), part(20, 29, certificate(3, 2))],
        [part(22, 24, certificate(6, 7, (1, 4)))],
    ),
    ([part(0, 29, certificate(2, 3, (1, 4)))], []),
)


def test_a_true_bundle_is_accepted(tmp_path, capsys):
    found = claim(TRUE)
    assert found.box == {"x": (2, 3)}
    assert found.spoilt == (bundle.Window(0, 22, 24),)
    file = tmp_path / "b.json"
    file.write_text(json.dumps(TRUE))
    assert check.main([str(file)]) == 0
    shown = capsys.readouterr().out
    assert "samples 22 to 24 of experiment 0 hold an outlier" in shown
    assert "x: 2 to 3" in shown
    # The first round alone proves the hull of the parts that are not empty.
    assert claim(content(1, (TRUE["rounds"][0]["parts"], []))).box == {"x": (1, 4)}


def test_no_point_is_left_where_all_parts_or_too_many_stretches_are_empty():
    empty = certificate(5, 4)
    assert claim(content(1, ([part(0, 9, empty), part(10, 19, empty)], []))).box is None
    assert claim(content(1, ([], [part(0, 9, empty), part(10, 19, empty)]))).box is None
    assert claim(content(2, ([], [part(0, 9, empty), part(10, 19, empty)]))).box is not None


def test_certificates_of_one_part_hold_together_and_may_be_about_some_variables():
    two = content(0, ([part(0, 9, certificate(1, 3), certificate(2, 4), certificate(0, 1, name="y"))], []))
    two |= {"variables": ["x", "y", "z"], "box": [list(BOX), list(BOX), [None, 5]]}
    assert claim(two).box == {"x": (2, 3), "y": (0, 1), "z": (-float("inf"), 5)}
    two["rounds"][0]["parts"][0]["certificates"].append(certificate(2, 3, name="y"))
    assert claim(two).box is None


def forged(change):
    found = copy.deepcopy(TRUE)
    change(found)
    return found


def first(found, k=0):
    return found["rounds"][0]["parts"][k]


def stretch(found):
    return found["rounds"][0]["spoilt"][0]


FORGERIES = {
    "parts > outliers left fails: 3 > 3": lambda f: f.update(outliers=3),
    "round 2: parts > outliers left fails: 1 > 1": lambda f: f["rounds"][0]["spoilt"].clear(),
    "round 1: parts > outliers left fails: 1 > 1": lambda f: f["rounds"][0]["parts"].__delitem__(slice(1, 3)),
    "round 1: sample 9 of experiment 0 is in two windows": lambda f: first(f, 1).update(windows=[[0, 9, 19]]),
    "round 1: sample 0 of experiment 0 is in two": lambda f: first(f, 2).update(windows=[[0, 40, 45], [0, 0, 2]]),
    "stretch 2: sample 24 of experiment 0 is in two windows": lambda f: f["rounds"][0]["spoilt"].append(
        part(24, 26, certificate(6, 7, (1, 4)))
    ),
    "stretch 1: windows = 1 fails: 2": lambda f: stretch(f).update(windows=[[0, 22, 22], [0, 24, 24]]),
    "stretch 1: windows = 1 fails: 0": lambda f: stretch(f).update(windows=[]),
    "do not prove that no point": lambda f: stretch(f).update(certificates=[certificate(4, 7, (1, 4))]),
    "stretch 1: its certificates do not prove that": lambda f: stretch(f).update(certificates=[]),
    # It proves emptiness of a box that is not all that is left.
    "certificate 1: its box of x does not hold all": lambda f: stretch(f).update(
        certificates=[certificate(6, 7, (1, 3))]
    ),
    "round 2, part 1, certificate 1: its box of x": lambda f: f["rounds"][1]["parts"][0].update(
        certificates=[certificate(2, 3, (2, 3))]
    ),
    "part 1, certificate 1: step 1": lambda f: first(f)["certificates"][0]["steps"][0].update(bound="2"),
    "certificate 1: step 2: inequality 7 is not": lambda f: first(f)["certificates"][0]["steps"][1]["products"][
        0
    ].update(of=[["inequality", 7]]),
}


@pytest.mark.parametrize("message", FORGERIES)
def test_forged_bundles_are_refused(message):
    with pytest.raises(Refused, match=message) as told:
        claim(forged(FORGERIES[message]))
    assert not isinstance(told.value, Unreadable)


UNREADABLE = {
    "ends before it begins": lambda f: first(f).update(windows=[[0, 5, 4]]),
    "-1 is not a number from 0": lambda f: first(f).update(windows=[[0, -1, 4]]),
    "True is not a number from 0": lambda f: first(f).update(windows=[[0, True, 4]]),
    "has 2 entries instead of 3": lambda f: first(f).update(windows=[[0, 4]]),
    "outliers: -1 is not a number from 0": lambda f: f.update(outliers=-1),
    "outliers: '1' is not a number from 0": lambda f: f.update(outliers="1"),
    "two variables have the name x": lambda f: f.update(variables=["x", "x"], box=[[0, 8], [0, 8]]),
    "box has 1 entries instead of 2": lambda f: f.update(variables=["x", "y"]),
    "unknown key 'claim'": lambda f: f.update(claim=1),
    "has no 'spoilt'": lambda f: f["rounds"][0].pop("spoilt"),
    "the version is 2": lambda f: f.update(version=2),
    "the version is None": lambda f: f.pop("version"),
    "there are 0 certificates": lambda f: f.update(rounds=[]),
    "certificate 1: the file is not a certificate": lambda f: first(f).update(certificates=[TRUE]),
    "certificate 1: the file is not": lambda f: first(f).update(certificates=[7]),
}


@pytest.mark.parametrize("message", UNREADABLE)
def test_what_is_no_bundle_is_unreadable(message):
    with pytest.raises(Unreadable, match=message):
        claim(forged(UNREADABLE[message]))


def test_a_bundle_that_proves_nothing_is_refused(tmp_path):
    nothing = content(1, ([part(0, 9, certificate(0, 3)), part(10, 19, certificate(2, 8))], []))
    with pytest.raises(Refused, match="proves nothing beyond the stated box"):
        claim(nothing)
    # It may be written, as a certificate of the priors may.
    write_content(tmp_path / "b.json", nothing)
    with pytest.raises(ProblemError, match=r"round 1: parts > outliers left"):
        write_content(tmp_path / "b.json", nothing | {"outliers": 2})


def test_what_is_proven_holds_wherever_the_outliers_are():
    # Samples state intervals around the truth; those of outliers state anything.
    rng = random.Random(1)
    proven = 0
    for _ in range(150):
        truth, n = Fraction(rng.randrange(80), 10), 12
        outliers = set(rng.sample(range(n), rng.randrange(3)))
        shown = []
        for k in range(n):
            low, high = sorted((truth - Fraction(rng.randrange(20), 10), truth + Fraction(rng.randrange(20), 10)))
            shift = Fraction(rng.randrange(-60, 60), 10) if k in outliers else 0
            shown.append((low + shift, high + shift))

        def about(first, end, box=BOX, shown=shown):
            return part(first, end - 1, *(certificate(low, high, box) for low, high in shown[first:end]))

        count = len(outliers) + 1
        whole = [about(a, b) for a, b in pairwise([n * k // count for k in range(count + 1)])]
        try:
            box = claim(content(len(outliers), (whole, []))).box["x"]
        except Refused:  # all of the stated box is left
            continue
        proven += 1
        assert box[0] <= truth <= box[1]
        apart = [k for k, (low, high) in enumerate(shown) if low > box[1] or high < box[0]]
        assert set(apart) <= outliers
        spoilt = [about(k, k + 1, box) for k in apart]
        assert claim(content(len(outliers), (whole, spoilt))).box == {"x": box}
    assert proven > 100
