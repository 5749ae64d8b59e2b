"""Collect garbage seldom: the tests make many objects that live to the end, and looking through them takes long."""

import gc
from collections.abc import Generator

import pytest

gc.set_threshold(20_000, 10, 10)


@pytest.hookimpl(wrapper=True)
def pytest_collection() -> Generator[None, object, object]:
    """Leave the collected tests out of every later search for garbage."""
    gc.disable()
    try:
        return (yield)
    finally:
        gc.freeze()
        gc.enable()
