"""A sensor that does not see the sign: the magnitude is started from a fit to guessed signs."""

import numpy as np

from smid.data import Dataset
from smid.diagnosis.effects import Site
from smid.diagnosis.effects.output_curve import EFFECT
from smid.fitting.fit import fit
from smid.models import OutputError
from smid.models.simulate import simulate


def test_a_magnitude_starts_where_the_signs_are_right() -> None:
    """The output is the magnitude of a resonance, which the linear model alone misses by nearly all of its power."""
    truth = {"a1": -1.6, "a2": 0.8, "b0": 0.1, "b1": 0.1}
    u = np.random.default_rng(4).choice([-1.0, 1.0], 300)
    w = simulate(OutputError(2, 1), {"u": u}, truth)["y"]
    data = Dataset.from_arrays(input={"u": u}, output={"y": np.abs(w)}, sampling_time=1.0)
    base = fit(OutputError(2, 1, offset=True), data)
    site = Site(data, "u", "y", base.residual(data, "y"))
    (extension,) = (item for item in EFFECT.extensions(base.model, site) if item.label == "magnitude")
    values = {**base.model.values, **extension.starts[0], "output_fold": 1.0}
    left = simulate(extension.model, {"u": u}, values)["y"] - np.abs(w)
    assert np.sqrt(np.mean(left**2)) < 1e-6 * np.std(np.abs(w))
    assert base.cost > 0.5 * np.sum((np.abs(w) - np.abs(w).mean()) ** 2)
