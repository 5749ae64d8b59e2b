"""Machine code that is kept between runs of Python is that of the functions as they stand, in whatever file."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import relaxations

OPTIONS = """
from relaxations.algebra.compiled import compiled

@compiled
def inverse(x):
    return 1.0 / x

print(inverse(0.0))
"""

CALLER = """
import numpy as np
from relaxations.algebra.affine_arithmetic import spread
from relaxations.algebra.compiled import compiled

@compiled
def twice(forms):
    return 2.0 * spread(forms, 0)

print(round(twice(np.array([[1.0, 3.0, 0.0, 0.0]])), 6))
"""


def run(folder: Path) -> subprocess.CompletedProcess[str]:
    """Run the caller with the copy of the package beside it."""
    environment = {**os.environ, "PYTHONPATH": str(folder), "PYTHONDONTWRITEBYTECODE": "1"}
    command = [sys.executable, "caller.py"]
    return subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, check=False)


def copied(folder: Path, caller: str) -> Path:
    """Copy the package beside a caller; return the folder of its algebra."""
    package = Path(relaxations.__file__).parent
    shutil.copytree(package, folder / "relaxations", ignore=shutil.ignore_patterns("__pycache__"))
    (folder / "caller.py").write_text(caller)
    return folder / "relaxations" / "algebra"


def test_a_function_that_changed_in_another_file_is_compiled_again(tmp_path):
    changed = copied(tmp_path, CALLER) / "affine_arithmetic.py"
    assert run(tmp_path).stdout == "6.0\n"
    text = changed.read_text()
    assert "(one + other)" in text
    changed.write_text(text.replace("(one + other)", "(one + other + 1.0)"))
    assert run(tmp_path).stdout == "8.0\n"


def test_a_function_is_compiled_again_where_the_options_changed(tmp_path):
    changed = copied(tmp_path, OPTIONS) / "compiled.py"
    assert run(tmp_path).stdout == "inf\n"
    text = changed.read_text()
    assert 'error_model="numpy"' in text
    changed.write_text(text.replace('error_model="numpy"', 'error_model="python"'))
    assert "ZeroDivisionError" in run(tmp_path).stderr
