"""Run the check from the command line."""

import sys

from relaxations.check import main

if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
