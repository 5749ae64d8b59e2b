"""Machine code that is kept between runs of Python is that of the functions as they stand, in whatever file."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import relaxations

CALLER = """
import numpy as np
from relaxations.algebra.affine_arithmetic import spread
from relaxations.algebra.compiled import compiled

@compiled
def twice(forms):
    return 2.0 * spread(forms, 0)

print(round(twice(np.array([[1.0, 3.0, 0.0, 0.0]])), 6))
"""


def test_a_function_that_changed_in_another_file_is_compiled_again(tmp_path):
    package = Path(relaxations.__file__).parent
    shutil.copytree(package, tmp_path / "relaxations", ignore=shutil.ignore_patterns("__pycache__"))
    (tmp_path / "caller.py").write_text(CALLER)
    changed = tmp_path / "relaxations" / "algebra" / "affine_arithmetic.py"

    def printed() -> str:
        environment = {**os.environ, "PYTHONPATH": str(tmp_path), "PYTHONDONTWRITEBYTECODE": "1"}
        command = [sys.executable, "caller.py"]
        return subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, text=True, check=True).stdout

    assert printed() == "6.0\n"
    text = changed.read_text()
    assert "    total = 0.0\n" in text
    changed.write_text(text.replace("    total = 0.0\n", "    total = 1.0\n"))
    assert printed() == "8.0\n"
