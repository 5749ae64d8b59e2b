from concurrent.futures import ThreadPoolExecutor

import pytest

from tests.smid.study.study_to_kill import study


@pytest.fixture(scope="session")
def whole():
    """The study of :mod:`study_to_kill` in one piece."""
    with ThreadPoolExecutor(1) as executor:
        return study(None, executor=executor)
