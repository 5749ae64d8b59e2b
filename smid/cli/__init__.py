"""The command line ``smid``."""

from smid.cli.app import main

__all__ = ["main"]
