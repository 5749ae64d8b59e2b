"""Problems from and to files and other notations, one module for each format."""

from relaxations.formats.as_json import read_json, write_json
from relaxations.formats.expressions import minimise, problem_of, variables
from relaxations.formats.gams import parse_gams, read_gams
from relaxations.formats.sdpa import SDPProblem, parse_sdpa, read_sdpa, write_sdpa
from relaxations.formats.text import parse

__all__ = [
    "SDPProblem",
    "minimise",
    "parse",
    "parse_gams",
    "parse_sdpa",
    "problem_of",
    "read_gams",
    "read_json",
    "read_sdpa",
    "variables",
    "write_json",
    "write_sdpa",
]
