"""A study in a process of its own, for tests that kill it: python study_to_kill.py FOLDER.

It prints a line now and then, and goes on when it is sent one: however slow the machine, it is not done too soon.
"""

import signal
import sys
from pathlib import Path

from smid import order_study
from smid.study.store import FILE
from tests.smid.study.study_records import MODEL, QUICK, record

BOUNDS = (0.1, 0.12, 0.14, 0.16, 0.18, 0.2)


def study(folder, progress=None, **settings):
    """Run or resume the study of twelve cells, more than are on their way when it is stopped."""
    begun = folder is not None and (folder / FILE).is_file()
    records = {"first": record(1, 5), "second": record(2, 5)}
    given = {"orders": [1], "folder": folder, "resume": begun, "progress": progress, **QUICK, **settings}
    return order_study(MODEL, records, BOUNDS, **given)


def tell_and_wait(line):
    print(line, flush=True)
    sys.stdin.readline()


if __name__ == "__main__":
    signal.signal(signal.SIGINT, signal.default_int_handler)  # a shell's background job passes on that it is ignored
    study(Path(sys.argv[1]), tell_and_wait)
