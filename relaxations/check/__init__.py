"""Check a certificate file: ``python -m relaxations.check FILE``.

A certificate states a problem in variables x, and proves lower bounds of polynomials on the set of its points. This
program checks the proof again, from the numbers in the file alone. It uses exact rational numbers and Python's standard
library. It shares no code with the package that wrote the file.

The modules, from the bottom:

- :mod:`relaxations.check.arithmetic`: polynomials with exact coefficients, or coefficients within a radius;
- :mod:`relaxations.check.statement`: the statement of a file, and theorems;
- :mod:`relaxations.check.steps`: the kinds of steps;
- :mod:`relaxations.check.rules`: one rule for each kind, with the proof of its soundness at the head;
- :mod:`relaxations.check.proof`: the steps, one after the other;
- :mod:`relaxations.check.read`: the file and its limits;
- :mod:`relaxations.check.report`: the printed report;
- :mod:`relaxations.check.runs`: the same for certificates of another kind, which prove by enclosures of a model's run;
- :mod:`relaxations.check.bundle`: certificates about parts of a record, of which some samples are outliers.

The kernel consists of arithmetic, statement, rules, proof and bundle: only an error there can accept a false theorem.
:mod:`relaxations.proof.certificate_file` writes such files.
"""

from __future__ import annotations

import sys
from typing import Any

from relaxations.check import bundle, runs
from relaxations.check.arithmetic import Polynomial, Refused, Unreadable, value_range
from relaxations.check.proof import conclusion
from relaxations.check.read import FORMAT, VERSION, Document, document, read
from relaxations.check.report import report
from relaxations.check.runs.read import document as document_of_run
from relaxations.check.runs.read import is_run
from relaxations.check.runs.report import report as report_of_run
from relaxations.check.statement import Context, Theorem

__all__ = ["FORMAT", "VERSION", "Polynomial", "Refused", "Theorem", "Unreadable", "check", "main", "read", "theorems"]

EXIT_ACCEPTED, EXIT_REFUSED, EXIT_UNREADABLE = 0, 1, 2


def check(content: Any) -> tuple[Theorem, ...]:
    """Return the theorems of a certificate, step by step.

    Parameters
    ----------
    content
        The content of a file, as :func:`read` returns it.

    Raises
    ------
    Unreadable
        When the content is not a certificate, or exceeds a limit.
    Refused
        When a step does not prove its claim (the message states the inequality that fails), or nothing is proven beyond
        the stated box.

    Examples
    --------
    x^2 - x >= -1/4 on [0, 2], where x = 1 + t: the square of x - 1/2 = 1/2 + t.

    >>> step = {"objective": [[1, 0, [0, 0]], [-1, 0, [0]]], "bound": "-1/4", "centre": [1], "scale": [1],
    ...         "equalities": [], "products": [{"of": [], "weight": 1, "basis": [[], [0]], "factor": [["1/2"], [1]]}]}
    >>> content = {"format": "relaxations certificate", "version": 1, "variables": ["x"], "box": [[0, 2]],
    ...            "equalities": [], "inequalities": [], "steps": [step]}
    >>> check(content)[0].bound
    Fraction(-1, 4)
    >>> step["bound"] = "-1/5"
    >>> check(content)
    Traceback (most recent call last):
    relaxations.check.arithmetic.Refused: step 1: bound <= r_0 - sum |r_i| fails: -0.2 > -0.25
    """
    return proven(document(content))


def theorems(content: Any) -> tuple[Theorem, ...]:
    """Return the theorems as :func:`check` does, but accept a proof of no more than the stated box.

    Raises
    ------
    Unreadable, Refused
        As :func:`check`.

    Examples
    --------
    >>> step = {"objective": [[1, 0, [0]]], "bound": 0, "centre": [1], "scale": [1], "equalities": [], "products": []}
    >>> content = {"format": "relaxations certificate", "version": 1, "variables": ["x"], "box": [[0, 2]],
    ...            "equalities": [], "inequalities": [], "steps": [step]}
    >>> len(theorems(content))
    1
    >>> check(content)
    Traceback (most recent call last):
    relaxations.check.arithmetic.Refused: the file proves nothing beyond the stated box
    """
    return _proven(document(content))


def _proven(found: Document) -> tuple[Theorem, ...]:
    """Return the theorems of a document."""
    context = Context("", found.stated, list(found.box), [], found.work)
    return tuple(conclusion(found.steps, context))


def proven(found: Document) -> tuple[Theorem, ...]:
    """Return the theorems of a document; refuse a document that proves nothing beyond the stated box."""
    every = _proven(found)
    if all(value_range(theorem.objective, found.box, found.work)[0] >= theorem.bound for theorem in every):
        raise Refused("the file proves nothing beyond the stated box")
    return every


def main(arguments: list[str]) -> int:
    """Check one file, print its statement and its theorems, and return the exit code.

    The exit code is 0 for an accepted file, 1 for a refused one, and 2 for a file that is not a certificate or a wrong
    call.

    Parameters
    ----------
    arguments
        The file's path alone, or ``--help``.

    Examples
    --------
    >>> import json, pathlib, tempfile
    >>> step = {"objective": [[1, 0, [0, 0]], [-1, 0, [0]]], "bound": "-1/4", "centre": [1], "scale": [1],
    ...         "equalities": [], "products": [{"of": [], "weight": 1, "basis": [[], [0]], "factor": [["1/2"], [1]]}]}
    >>> content = {"format": "relaxations certificate", "version": 1, "variables": ["x"], "box": [[0, 2]],
    ...            "equalities": [], "inequalities": [], "steps": [step]}
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     file = pathlib.Path(folder) / "claim.json"
    ...     written = file.write_text(json.dumps(content), encoding="utf-8")
    ...     main([str(file)])
    accepted: 1 variable, 0 equalities, 0 inequalities
    origin: not stated, so the proof is about the polynomials in this file
    stated box:
      x in [0, 2]
    proven:
      x*x - x >= -0.25 (step 1)
    0
    """
    if len(arguments) != 1 or arguments[0] in ("-h", "--help"):
        print("usage: python -m relaxations.check FILE\nexit codes: 0 accepted, 1 refused, 2 not a certificate")
        return EXIT_ACCEPTED if arguments[:1] in (["-h"], ["--help"]) else EXIT_UNREADABLE
    try:
        content = read(arguments[0])
        if bundle.is_bundle(content):
            held = bundle.document(content)
            lines = list(bundle.report(held, bundle.proven(held)))
        elif is_run(content):
            run = document_of_run(content)
            lines = list(report_of_run(run, runs.proven(run)))
        else:
            found = document(content)
            lines = list(report(found, proven(found)))
    except Refused as refusal:
        readable = not isinstance(refusal, Unreadable)
        print(f"{'refused' if readable else 'not a certificate'}: {refusal}", file=sys.stderr)
        return EXIT_REFUSED if readable else EXIT_UNREADABLE
    except (RecursionError, MemoryError):
        print("not a certificate: the file takes more memory than this program has", file=sys.stderr)
        return EXIT_UNREADABLE
    print("\n".join(lines))
    return EXIT_ACCEPTED
