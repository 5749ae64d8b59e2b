"""Look for false statements: ``python -m benchmarks.soundness COMMAND [options]``."""

from __future__ import annotations

import argparse
import sys
from importlib import import_module

COMMANDS = {
    "sets": "identify random feasible and empty sets",
    "priors": "identify random models with priors, whose rational truth lies at an end of a prior",
    "inversion": "invert free runs of random models of the effect library",
    "checker": "change certificates, and see whether the checker accepts what is false",
}
"""Modules of this package, each with a ``main`` that takes the options and returns the exit code."""


def main() -> int:
    """Run the command that is named first, with the options behind it."""
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.soundness",
        description="\n".join(f"{name:9} {what}" for name, what in COMMANDS.items()),
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("command", choices=COMMANDS)
    given = parser.parse_args(sys.argv[1:2])
    code: int = import_module(f"benchmarks.soundness.{given.command}").main(sys.argv[2:])
    return code


if __name__ == "__main__":
    sys.exit(main())
