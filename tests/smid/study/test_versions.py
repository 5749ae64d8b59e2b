"""The digest of the code covers everything that an interval depends on."""

import subprocess
import sys
from pathlib import Path

from smid.study import versions


def test_every_room_that_identification_imports_is_hashed():
    code = "import sys, smid.identification.identify; print(*sorted(m for m in sys.modules if m.startswith('smid.')))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    rooms = {module.split(".")[1] for module in done.stdout.split()}
    assert rooms - set(versions.HASHED) <= {"display"}  # text and figures change no number


def test_a_moved_file_changes_the_digest(tmp_path, monkeypatch):
    room = tmp_path / "smid" / "models"
    room.mkdir(parents=True)
    (room / "one.py").write_text("x = 1\n", encoding="utf-8")
    monkeypatch.setattr(versions, "__file__", str(tmp_path / "smid" / "study" / "versions.py"))
    before = dict(versions._own.__wrapped__())["code"]
    Path(room / "one.py").rename(room / "two.py")
    assert dict(versions._own.__wrapped__())["code"] != before
