"""The least-squares problem of a hybrid model keeps finite normal equations."""

from types import SimpleNamespace

import numpy as np
import pytest

from smid.hybrid.problem import HybridError


@pytest.mark.parametrize("steep", [1e200, np.inf, np.nan])
def test_a_run_that_is_about_to_diverge_does_not_spoil_the_other_slopes(steep):
    """A hundred neurons can have a finite error and slopes whose squares overflow."""
    fitting = SimpleNamespace(
        box=(np.full(2, -10.0), np.full(2, 10.0)),
        residual=lambda _: np.array([1.0, 2.0]),
        jacobian=lambda _: np.array([[steep, 1.0], [1.0, 3.0]]),
    )
    found = HybridError(fitting, np.ones(2), np.zeros(2)).normal_equations(np.zeros(2))
    assert np.isfinite(found.gram).all()
    assert found.gradient[1] == pytest.approx((1.0 + 6.0) / 2)
    assert found.gram[1, 1] == pytest.approx((1.0 + 9.0) / 2)
