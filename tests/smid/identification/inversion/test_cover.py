"""How a set that is empty is covered: no unknown is left wide, and what is proven grows towards the whole."""

import numpy as np
import pytest

from smid import Dataset, OwnModel
from smid.identification.inversion import cover as covers
from smid.identification.inversion.cover import Cover
from smid.identification.inversion.record import Record
from smid.models.simulate import simulate

# A sine of the state: its rate and phase say nothing before they are narrow.
SINE = OwnModel(
    ["w[t] = a*w[t-1] + b*u[t-1]", "s[t] = h*sin(r*w[t] + p) + c*w[t] + l"],
    {"y": "s"},
    ["u"],
    {"a": (-1.0, 1.0), "b": (-0.5, 0.5), "h": (-3, 3), "r": (0.1, 40.0), "p": (-3, 3), "c": (-1, 2), "l": (-3, 3)},
).bound(w=(-3, 3))
LAG = OwnModel(["w[t] = a*w[t-1] + b*u[t-1]"], {"y": "w"}, ["u"], {"a": (0.0, 1.0), "b": (0.0, 5.0)})


def posed(model, y):
    u = np.random.default_rng(1).uniform(-1, 1, len(y))
    data = Dataset.from_arrays(input={"u": u}, output={"y": y}, sampling_time=1.0)
    return Record(model, data, {"y": 0.05}, whole=True)


def test_no_unknown_that_bends_the_runs_is_left_wide():
    u = np.random.default_rng(1).uniform(-1, 1, 40)
    cover = Cover(posed(SINE, 3.0 * np.sin(4.0 * u)), 0.0, deepest_first=True)
    for _ in range(60):
        cover.step()
    bent = [cover.record.names.index(name) for name in "abrp"]
    widths = [(box.upper - box.lower)[bent] / (cover.root.upper - cover.root.lower)[bent] for box in cover.boxes]
    assert min(box.share for box in cover.boxes) < 1e-4  # the search went deep
    assert max(width.max() / width.min() for width in widths) <= 2 * covers._ASPECT  # what the last halving adds
    assert len(cover.boxes) < 40


def test_an_unknown_that_the_runs_are_linear_in_does_not_bend_them():
    record = posed(LAG, np.zeros(20))
    assert [record.names[k] for k in Cover(record, 0.0)._bent] == ["a"]


@pytest.mark.parametrize("deepest_first", [False, True])
def test_an_empty_set_is_proven_in_any_order(deepest_first):
    u = np.random.default_rng(1).uniform(-1, 1, 60)
    y = simulate(LAG, {"u": u}, {"a": 0.8, "b": 1.0})["w"] + 0.4 * np.sign(np.sin(np.arange(60) / 4))
    cover, proven = Cover(posed(LAG, y), 0.0, deepest_first=deepest_first), [0.0]
    while not cover.done:
        proven.append(cover.proven)
        cover.step()
    assert not cover.boxes
    assert 0.0 < proven[-1] <= 1.0
