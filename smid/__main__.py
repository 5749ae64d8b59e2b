"""``python -m smid`` is the same as ``smid``."""

from smid.cli.app import main

main()
