import pytest
from click.testing import CliRunner, Result

from smid.cli import main


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    """An empty working folder."""
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.fixture
def smid():
    """Run a command line; arguments are split at blanks."""

    def run(line: str) -> Result:
        return CliRunner().invoke(main, line.split(), prog_name="smid")

    return run
