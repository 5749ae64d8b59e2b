"""Run a function with another kernel of OpenBLAS: whether a result depends on the processor."""

from __future__ import annotations

import multiprocessing
import os
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from typing import ParamSpec, TypeVar
from unittest import mock

__all__ = ["OLDER", "with_kernel"]

OLDER = "Prescott"
"""A kernel that every x86-64 processor can run."""

Asked = ParamSpec("Asked")
Answer = TypeVar("Answer")


def with_kernel(kernel: str, function: Callable[Asked, Answer], *given: Asked.args, **named: Asked.kwargs) -> Answer:
    """Call a function of a module in a new process, where OpenBLAS runs a kernel; without a name, its own choice."""
    # OpenBLAS reads the variable when it is loaded.
    with (
        mock.patch.dict(os.environ, {"OPENBLAS_CORETYPE": kernel} if kernel else {}),
        ProcessPoolExecutor(1, mp_context=multiprocessing.get_context("spawn")) as pool,
    ):
        return pool.submit(function, *given, **named).result()
