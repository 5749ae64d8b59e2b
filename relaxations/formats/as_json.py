"""Problems to JSON files and back without rounding: every float is written in hexadecimal.

A file contains ``variables``, their ``box`` (null: no bound), ``equalities``, ``inequalities`` and the ``objective``
(null: none). A polynomial is a list of ``[coefficient, radius, [numbers of variables, with repetition]]``. Certificate
files (:mod:`relaxations.check`) state their problem in the same way. A problem's ``exact`` is not written.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np

from relaxations.algebra.ball_arithmetic import Balls
from relaxations.algebra.polynomial import Polynomials, padded
from relaxations.errors import ProblemError
from relaxations.problem.problem import PolynomialProblem
from relaxations.problem.statement import listed, statement
from relaxations.writing import write_text

FORMAT = "relaxations problem"
VERSION = 1
_KEYS = ("format", "version", "variables", "box", "equalities", "inequalities", "objective")


def write_json(path: str | Path, problem: PolynomialProblem, objective: Polynomials | None = None) -> None:
    """Write a problem, and its objective if it has one.

    Examples
    --------
    >>> import tempfile
    >>> from relaxations.formats.expressions import problem_of, variables
    >>> x, y = variables("x y")
    >>> problem, objective = problem_of(x * y / 3, [x**2 + y**2 <= 1])
    >>> file = Path(tempfile.mkdtemp()) / "problem.json"
    >>> write_json(file, problem, objective)
    >>> again, goal = read_json(file)
    >>> again.names, goal.coefficients.mid.tolist() == objective.coefficients.mid.tolist()
    (('x', 'y'), True)
    """
    document = {
        "format": FORMAT,
        "version": VERSION,
        **statement(problem),
        "objective": None if objective is None else listed(objective)[0],
    }
    write_text(path, json.dumps(document, indent=1) + "\n")


def read_json(path: str | Path) -> tuple[PolynomialProblem, Polynomials | None]:
    """Return the problem and the objective of a file.

    Raises
    ------
    ProblemError
        With the file, the position and the cause.

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     file = Path(folder) / "problem.json"
    ...     written = file.write_text('{"format": "relaxations problem", "version": 1, "variables": ["x"]}')
    ...     try:
    ...         read_json(file)
    ...     except ProblemError as error:
    ...         print(str(error).removeprefix(str(file)))
    : box, equalities, inequalities, objective is missing
    """
    try:
        document = json.loads(Path(path).read_text(encoding="utf-8"))
    except OSError as error:
        raise ProblemError(f"{path} cannot be read: {error.strerror}") from None
    except json.JSONDecodeError as error:
        raise ProblemError(f"{path}, line {error.lineno}: not valid JSON: {error.msg}") from None
    except (UnicodeDecodeError, RecursionError) as error:
        raise ProblemError(f"{path} is not valid JSON: {error}") from None
    try:
        return _problem(document)
    except ProblemError as error:
        raise ProblemError(f"{path}: {error}") from None


def _problem(document: Any) -> tuple[PolynomialProblem, Polynomials | None]:
    """Return the problem and the objective of a document."""
    if not isinstance(document, dict) or document.get("format") != FORMAT:
        raise ProblemError(f"this is not a {FORMAT!r}: write one with relaxations.formats.as_json.write_json")
    if document.get("version") != VERSION:
        raise ProblemError(f"version {document.get('version')!r} is unknown, this program reads {VERSION}")
    missing = [key for key in _KEYS if key not in document]
    if missing:
        raise ProblemError(f"{', '.join(missing)} is missing")
    names, box, goal = document["variables"], document["box"], document["objective"]
    if not isinstance(names, list) or not names or not all(isinstance(name, str) for name in names):
        raise ProblemError("variables: a list of names is expected")
    if not isinstance(box, list) or not all(isinstance(pair, list) and len(pair) == 2 for pair in box):
        raise ProblemError("box: a list of pairs is expected")
    count = len(names)
    problem = PolynomialProblem(
        tuple(names),
        np.array([-np.inf if low is None else _float(low, f"box {k}") for k, (low, _) in enumerate(box)]),
        np.array([np.inf if high is None else _float(high, f"box {k}") for k, (_, high) in enumerate(box)]),
        _polynomials(document["equalities"], count, "equality"),
        _polynomials(document["inequalities"], count, "inequality"),
    )
    return problem, None if goal is None else _polynomials([goal], count, "objective")


def _polynomials(members: Any, count: int, where: str) -> Polynomials:
    """Return polynomials from lists of terms."""
    rows: list[int] = []
    keys: list[list[int]] = []
    mids: list[float] = []
    rads: list[float] = []
    if not isinstance(members, list):
        raise ProblemError(f"{where}: a list of polynomials is expected")
    # Check each term, and collect rows, monomials, coefficients and radii.
    for row, terms in enumerate(members):
        if not isinstance(terms, list):
            raise ProblemError(f"{where} {row}: a list of terms is expected")
        for k, term in enumerate(terms):
            place = f"{where} {row}, term {k}"
            if not isinstance(term, list) or len(term) != 3 or not isinstance(term[2], list):
                raise ProblemError(f"{place}: [coefficient, radius, variables] is expected")
            for v in term[2]:
                if not isinstance(v, int) or isinstance(v, bool) or not 0 <= v < count:
                    raise ProblemError(f"{place}: {v!r} is not the number of a variable, 0 to {count - 1}")
            rows.append(row)
            keys.append(term[2])
            mids.append(_float(term[0], place))
            rads.append(_float(term[1], place))
            if rads[-1] < 0:
                raise ProblemError(f"{place}: the radius {rads[-1]} is negative")
    coefficients = Balls(np.array(mids, float), np.array(rads, float))
    return Polynomials(len(members), np.array(rows, dtype=np.int64), padded(keys), coefficients)


def _float(value: Any, where: str) -> float:
    """Return a finite number, or a float in hexadecimal."""
    try:
        # float.fromhex reads "10" as 16.
        number = float.fromhex(value) if isinstance(value, str) and "0x" in value else float(value)
    except (TypeError, ValueError, OverflowError):
        number = np.nan
    if isinstance(value, bool) or not np.isfinite(number) or (isinstance(value, str) and "0x" not in value):
        raise ProblemError(f"{where}: {value!r} is not a finite number; write 3, 0.5 or, exactly, '0x1.8p+1'")
    return number
