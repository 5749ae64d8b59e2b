"""Print which kernels of OpenBLAS and which loops of numpy run; with --loops, the loops that can be switched off."""

import ctypes
import os
import sys
from pathlib import Path

import numpy as np
import scipy
from numpy._core import _multiarray_umath as core


def kernel(package, function):
    """Return the kernel of the OpenBLAS that a wheel bundles."""
    folder = Path(package.__file__).parent.parent / f"{package.__name__}.libs"
    (library,) = folder.glob("*openblas*")
    asked = getattr(ctypes.CDLL(str(library)), function)
    asked.restype = ctypes.c_char_p
    return asked().decode()


def main():
    """Print what runs, and fail where it is not what was asked for."""
    loops = [name for name in core.__cpu_dispatch__ if core.__cpu_features__[name]]
    if "--loops" in sys.argv:
        print(*loops)
        return
    found = {
        "numpy": kernel(np, "scipy_openblas_get_corename64_"),
        "scipy": kernel(scipy, "scipy_openblas_get_corename"),
    }
    print(
        "kernels:",
        ", ".join(f"{name} {word}" for name, word in found.items()),
        "- loops of numpy:",
        *loops or ["baseline"],
    )
    wanted = os.environ["OPENBLAS_CORETYPE"]
    if set(found.values()) != {wanted}:
        sys.exit(f"the kernel {wanted} was asked for: this machine or its OpenBLAS does not have it")


if __name__ == "__main__":
    main()
