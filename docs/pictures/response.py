"""Draw gain and phase of a lightly damped plant with their certified bands: response.svg.

``python docs/pictures/response.py`` draws the file again.
"""

from pathlib import Path

import numpy as np

import smid
from smid.display.style import save_svg
from smid.models.simulate import simulate

PLANT = {"a1": -1.3, "a2": 0.75, "b0": 0.4, "b1": 0.2}
NOISE_BOUND, SAMPLES, SEED = 0.3, 40, 3


def estimate():
    """Return the certified intervals on a simulated record of the plant."""
    random = np.random.default_rng(SEED)
    u = random.choice([-1.0, 1.0], SAMPLES)
    w = simulate(smid.OutputError(2, 1), {"u": u}, PLANT)["w"]
    y = w + random.uniform(-NOISE_BOUND, NOISE_BOUND, SAMPLES)
    data = smid.Dataset.from_arrays(input={"u": u}, output={"y": y}, sampling_time=0.1, units={"u": "V", "y": "bar"})
    return smid.identify(smid.OutputError(2, 1, stable=True), data, NOISE_BOUND)


if __name__ == "__main__":
    band = smid.bode(estimate())
    print(band)
    save_svg(band.plot(), Path(__file__).with_suffix(".svg"))
