"""Functions as machine code that is kept between runs of Python.

Numba keeps the code of a function until the function's own file changes, whatever becomes of the functions that it
calls and of the options below. So what is kept lies in a folder named after the content of all these files.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar, cast

import numba

__all__ = ["compiled", "compiling"]

_Function = TypeVar("_Function", bound=Callable[..., object])

_CALLED = ("ball_arithmetic.py", "affine_arithmetic.py", "affine_functions.py")
_FILES = (Path(__file__), *(Path(__file__).with_name(name) for name in _CALLED))


def compiling(*files: str) -> Callable[[_Function], _Function]:
    """Return a decorator that makes machine code of a function; a division by zero gives an infinite result.

    Parameters
    ----------
    files
        Those with functions that the function calls, beside its own and those of this folder: a change elsewhere
        would not be noticed.
    """
    content = hashlib.sha256(b"".join(file.read_bytes() for file in (*_FILES, *map(Path, files)))).hexdigest()[:16]

    def compiled(function: _Function) -> _Function:
        config: Any = numba.config
        given = config.CACHE_DIR
        config.CACHE_DIR = str(Path(given or Path(__file__).parent / "__pycache__") / content)
        try:
            code: Any = numba.njit(cache=True, error_model="numpy")(function)
            # Else each constant that a caller gives would have machine code of its own.
            template, unliteral = code.get_call_template, cast(Any, numba.types.unliteral)
            code.get_call_template = lambda args, kws: template([unliteral(arg) for arg in args], kws)
            return cast(_Function, code)
        finally:
            config.CACHE_DIR = given

    return compiled


compiled = compiling()
