"""The versions that a result was computed with."""

from __future__ import annotations

import platform
from importlib.metadata import version

PACKAGES = ("smid", "numpy", "scipy", "sympy", "cvxpy", "clarabel")
"""The packages that results depend on."""


def versions() -> dict[str, str]:
    """Return the versions of Python and of the packages that compute, and the platform.

    Examples
    --------
    >>> list(versions())
    ['python', 'smid', 'numpy', 'scipy', 'sympy', 'cvxpy', 'clarabel', 'platform']
    """
    return {
        "python": platform.python_version(),
        **{name: version(name) for name in PACKAGES},
        "platform": platform.platform(),
    }
