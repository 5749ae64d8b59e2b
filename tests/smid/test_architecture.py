"""The layer contract is exhaustive and knows no exemption, and the top of the package is small."""

import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
CONTRACTS = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["tool"]["importlinter"]["contracts"]
LAYERS = {contract["containers"][0]: contract for contract in CONTRACTS if contract["type"] == "layers"}


@pytest.mark.parametrize("package", ["smid", "relaxations"])
def test_every_room_is_in_one_layer_and_none_is_exempt(package):
    contract = LAYERS[package]
    listed = [name.strip() for layer in contract["layers"] for name in layer.split("|")]
    rooms = {path.stem for path in (ROOT / package).glob("*.py")} - {"__init__"}
    rooms |= {path.parent.name for path in (ROOT / package).glob("*/__init__.py")}
    assert sorted(listed) == sorted(rooms)
    assert contract["exhaustive"]
    assert not any("ignore_imports" in each for each in CONTRACTS)


def test_the_top_of_the_package_has_few_modules():
    assert len({path.stem for path in (ROOT / "smid").glob("*.py")} - {"__init__"}) <= 4
