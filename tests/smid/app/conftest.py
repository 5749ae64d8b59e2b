import numpy as np
import pytest

from smid.models import OutputError
from smid.models.simulate import simulate
from tests.smid.app.served import Served


def _file(n):
    """A file of n samples of a lag of first order (a1 = -0.8, b0 = 1, noise of at most 0.05), simulated."""
    random = np.random.default_rng(7)
    u = np.repeat(random.uniform(-1, 1, n // 4), 4)
    y = simulate(OutputError(), {"u": u}, {"a1": -0.8, "b0": 1.0})["y"] + random.uniform(-0.05, 0.05, n)
    rows = [f"{0.1 * k:.1f},{v:.4f},{w:.4f}" for k, (v, w) in enumerate(zip(u, y, strict=True))]
    return "\n".join(["# SIMULATED lag of first order.", "time [s],valve [V],level (LT-1) [m]", *rows, ""]).encode()


@pytest.fixture(scope="session")
def content():
    return _file(200)


@pytest.fixture(scope="session")
def long_content():
    """A search on it takes so long that it can be stopped."""
    return _file(2400)


@pytest.fixture(scope="session")
def served():
    with Served() as found:
        yield found
