"""The command line: ``smid demo``, ``smid identify``, ``smid error-bound``, ``smid validate``, ``smid diagnose``."""

from smid.cli.app import main

__all__ = ["main"]
