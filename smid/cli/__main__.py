"""``python -m smid.cli`` is the same as ``smid``."""

from smid.cli import main

main()
