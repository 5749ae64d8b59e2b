"""Polynomial problems in GAMS's scalar format (``.gms``), as GLOBALLib and SparsePOP publish them.

Supported:

- ``Variables``, ``Positive``, ``Negative`` and ``Free Variables``, bounds ``x.lo``, ``x.up``, ``x.fx``;
- ``Equations``, ``e1.. left =E= right;`` with ``=E=``, ``=L=`` and ``=G=``;
- ``Model m / all /`` or with named equations, ``Solve m using NLP minimizing objvar``.

Ignored: lines that begin with ``*`` or ``$``, levels, marginals and options. Refused: sets, parameters, integer
variables and functions that are not polynomials. Names are case-insensitive.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from fractions import Fraction
from pathlib import Path

from relaxations.algebra.polynomial import Polynomials
from relaxations.errors import ProblemError
from relaxations.formats.expressions import Constraint, Expression, problem_of, variables
from relaxations.formats.files import parsed
from relaxations.formats.text import Token, parse_tokens, tokens
from relaxations.problem.problem import PolynomialProblem

End = Fraction | float | None

_KINDS: dict[str, tuple[End, End]] = {"free": (None, None), "positive": (0.0, None), "negative": (None, 0.0)}
_DISCRETE = ("binary", "integer", "sos1", "sos2", "semicont", "semiint")
_SKIPPED = ("option", "options", "display", "file", "put")
_ATTRIBUTES = ("l", "m", "scale", "prior", "stage")  # of variables; they do not change the problem


@dataclass
class _Model:
    """The content of the statements read so far; all names in lower case."""

    box: dict[str, tuple[End, End]] = field(default_factory=dict)
    spelling: dict[str, str] = field(default_factory=dict)
    declared: list[str] = field(default_factory=list)
    equations: dict[str, Constraint] = field(default_factory=dict)
    models: dict[str, list[str] | None] = field(default_factory=dict)  # None: all equations
    objective: Expression | None = None
    chosen: str = ""

    @property
    def names(self) -> Mapping[str, Expression]:
        """Return each variable as an expression."""
        return {name: variables(name)[0] for name in self.box}


def read_gams(path: str | Path) -> tuple[PolynomialProblem, Polynomials]:
    """Return the problem and the objective of a file; see :func:`parse_gams`.

    Raises
    ------
    ProblemError
        With the file, the line and the cause.

    Examples
    --------
    >>> import numpy as np, tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     file = Path(folder) / "model.gms"
    ...     written = file.write_text("Variables x, z; Equations e1; e1.. z - x*x + x =E= 0; x.lo = 0; x.up = 2;"
    ...                               "Model m / all /; Solve m using NLP minimizing z;")
    ...     problem, objective = read_gams(file)
    >>> problem.names, problem.upper, objective.evaluate(np.array([0.5]))
    (('x',), array([2.]), array([-0.25]))
    """
    return parsed(path, parse_gams)


def parse_gams(text: str) -> tuple[PolynomialProblem, Polynomials]:
    """Return the problem of a scalar GAMS model and its objective, to be minimised.

    If one equation defines the objective variable, linearly and without bounds, the variable is eliminated. A model
    that maximises gives the negative objective.

    Raises
    ------
    ProblemError
        With the line and the cause.

    Examples
    --------
    >>> problem, objective = parse_gams('''
    ... Variables x, y, objvar;  Positive Variables x;  Equations e1, e2;
    ... e1.. objvar - x*y =E= 0;
    ... e2.. sqr(x) + sqr(y) =L= 1;
    ... Model m / all /;  Solve m using NLP minimizing objvar;''')
    >>> problem.names, problem.lower.tolist(), problem.upper.tolist(), objective.degree
    (('x', 'y'), [0.0, -1.0], [1.0, 1.0], 2)
    """
    model = _Model()
    for statement in _statements(text):
        _apply(statement, model)
    if model.objective is None:
        raise ProblemError("there is no 'Solve m using NLP minimizing objvar;': the objective is missing")
    return _problem(model)


def _statements(text: str) -> list[list[Token]]:
    """Return the statements of a file as tokens, without comments, directives and quoted texts."""
    lines, inside = [], False
    for line in text.splitlines():
        lowered = line.lower()
        if lowered.startswith("$ontext"):
            inside = True
        skipped = inside or line.startswith(("*", "$"))
        if lowered.startswith("$offtext"):
            inside = False
        lines.append("" if skipped else re.sub(r"'[^']*'|\"[^\"]*\"", " ", line))
    found, number = [], 1
    pieces = "\n".join(lines).split(";")
    for k, piece in enumerate(pieces):
        statement = tokens(piece, number)
        if statement and k == len(pieces) - 1:
            raise ProblemError(f"line {statement[0].line}: the statement {statement[0].text!r} has no semicolon")
        if statement:
            found.append(statement)
        number += piece.count("\n")
    return found


def _apply(statement: list[Token], model: _Model) -> None:
    """Add one statement to the model."""
    first = statement[0]
    word = first.text.lower()
    second = statement[1].text.lower() if len(statement) > 1 else ""
    if word in _DISCRETE or (word in _KINDS and second in _DISCRETE):
        raise ProblemError(
            f"line {first.line}: {first.text} variables are not continuous: only continuous ones are supported"
        )
    if word in ("variable", "variables"):
        _declare(statement[1:], "free", model)
    elif word in _KINDS and second in ("variable", "variables"):
        _declare(statement[2:], word, model)
    elif word in ("equation", "equations"):
        model.declared += [t.text.lower() for t in _names(statement[1:])]
    elif word in ("model", "models"):
        _declare_model(statement[1:], model)
    elif word == "solve":
        _solve(statement, model)
    elif second == "..":
        _define(statement, model)
    elif second == ".":
        _assign(statement, model)
    elif word not in _SKIPPED:
        raise ProblemError(
            f"line {first.line}: a statement that begins with {first.text!r} is not part of the scalar format"
        )


def _names(pieces: list[Token]) -> list[Token]:
    """Return the names in a list; a comma may be missing, as at the end of a line."""
    for piece in pieces:
        if piece.kind != "name" and piece.text != ",":
            raise ProblemError(f"line {piece.line}: a list of names cannot hold {piece.text!r}")
    return [piece for piece in pieces if piece.kind == "name"]


def _declare(pieces: list[Token], kind: str, model: _Model) -> None:
    """Add variables of one kind."""
    for piece in _names(pieces):
        name = piece.text.lower()
        if name not in model.box:
            model.spelling[name] = piece.text
            model.box[name] = (None, None)
        if kind != "free":
            model.box[name] = _KINDS[kind]


def _define(statement: list[Token], model: _Model) -> None:
    """Read an equation ``e1.. left =E= right``."""
    first, name = statement[0], statement[0].text.lower()
    if name not in model.declared:
        raise ProblemError(f"line {first.line}: equation {first.text!r} is not declared: list it under Equations")
    if name in model.equations:
        raise ProblemError(f"line {first.line}: equation {first.text!r} is defined twice")
    places = [k for k, t in enumerate(statement) if t.kind == "relation"]
    if len(places) != 1:
        raise ProblemError(f"line {first.line}: equation {first.text!r} needs one of =E=, =L= and =G=")
    relation = statement[places[0]]
    sides = []
    for side, pieces in (("left", statement[2 : places[0]]), ("right", statement[places[0] + 1 :])):
        if not pieces:
            raise ProblemError(f"line {relation.line}: equation {first.text!r} has nothing {side} of {relation.text}")
        sides.append(parse_tokens(_lowered(pieces), model.names))
    left, right = sides
    kind = relation.text[1].lower()
    if kind not in "elg":
        raise ProblemError(f"line {relation.line}: {relation.text} is not supported: write =E=, =L= or =G=")
    model.equations[name] = (
        Constraint(left - right, equality=True)
        if kind == "e"
        else Constraint(right - left if kind == "l" else left - right, equality=False)
    )


def _lowered(pieces: list[Token]) -> list[Token]:
    """Return the tokens in lower case."""
    return [Token(t.kind, t.text.lower(), t.line) for t in pieces]


def _assign(statement: list[Token], model: _Model) -> None:
    """Read ``x.up = 3``; attributes of models and starting values are ignored."""
    first = statement[0]
    name, attribute = first.text.lower(), statement[2].text.lower() if len(statement) > 2 else ""
    if name in model.models or (name in model.box and attribute in _ATTRIBUTES):
        return
    if name not in model.box:
        raise ProblemError(f"line {first.line}: {first.text!r} is neither a variable nor a model")
    if attribute not in ("lo", "up", "fx") or len(statement) < 5 or statement[3].text != "=":
        raise ProblemError(f"line {first.line}: a bound is written {first.text}.lo, .up or .fx = number")
    value = _bound(statement[4:], first)
    low, high = model.box[name]
    model.box[name] = (low if attribute == "up" else value, high if attribute == "lo" else value)


def _bound(pieces: list[Token], first: Token) -> End:
    """Return the value of a bound."""
    words = "".join(t.text.lower() for t in pieces)
    if words in ("inf", "+inf", "-inf"):
        return float(words)
    value = parse_tokens(pieces, {}).constant
    if value is None:
        raise ProblemError(f"line {first.line}: the bound of {first.text} is not a number")
    return value


def _declare_model(pieces: list[Token], model: _Model) -> None:
    """Read ``m / all /`` or ``m / e1, e2 /``."""
    slashes = [k for k, t in enumerate(pieces) if t.text == "/"]
    if not pieces or pieces[0].kind != "name" or len(slashes) != 2 or slashes[1] != len(pieces) - 1:
        raise ProblemError("a model is written Model m / all /; or with the names of its equations")
    listed = _names(pieces[slashes[0] + 1 : slashes[1]])
    whole = [t.text.lower() for t in listed] == ["all"]
    for t in listed:
        if not whole and t.text.lower() not in model.declared:
            raise ProblemError(f"line {t.line}: the model holds {t.text!r}, which is not an equation")
    model.models[pieces[0].text.lower()] = None if whole else [t.text.lower() for t in listed]


def _solve(statement: list[Token], model: _Model) -> None:
    """Read ``Solve m using NLP minimizing objvar`` (or with ``minimizing`` first)."""
    words = [t.text.lower() for t in statement]
    line = statement[0].line
    sense = next((k for k, w in enumerate(words) if w in ("minimizing", "maximizing")), None)
    if sense is None or sense + 1 == len(words) or "using" not in words or len(words) < 2:
        raise ProblemError(f"line {line}: a problem is solved by Solve m using NLP minimizing objvar")
    if words[1] not in model.models:
        raise ProblemError(f"line {line}: {statement[1].text!r} is not a model")
    goal = words[sense + 1]
    if goal not in model.box:
        raise ProblemError(f"line {line}: the objective {statement[sense + 1].text!r} is not a variable")
    objective = variables(goal)[0]
    model.objective = objective if words[sense] == "minimizing" else -objective
    model.chosen = words[1]


def _problem(model: _Model) -> tuple[PolynomialProblem, Polynomials]:
    """Return the problem of a complete model."""
    assert model.objective is not None
    listed = model.models[model.chosen]
    undefined = [name for name in (model.declared if listed is None else listed) if name not in model.equations]
    if undefined:
        raise ProblemError(
            f"equation {undefined[0]!r} is declared and not defined: write {undefined[0]}.. left =E= right"
        )
    equations = list(model.equations.values()) if listed is None else [model.equations[name] for name in listed]
    objective = model.objective
    ((goal,),) = objective.terms
    box = dict(model.box)
    definition = _definition(goal, equations, box)
    if definition is not None:
        number, meaning = definition
        objective = objective.terms[goal,] * meaning
        equations = [c for k, c in enumerate(equations) if k != number]
        del box[goal]
    spelling = model.spelling
    return problem_of(
        _renamed(objective, spelling),
        [Constraint(_renamed(c.expression, spelling), c.equality) for c in equations],
        [spelling[name] for name in box],
        {spelling[name]: pair for name, pair in box.items()},
    )


def _definition(
    goal: str, equations: list[Constraint], box: Mapping[str, tuple[End, End]]
) -> tuple[int, Expression] | None:
    """Return the equation that defines the objective variable and its right-hand side; None if there is none."""
    holding = [k for k, c in enumerate(equations) if any(goal in m for m in c.expression.terms)]
    if len(holding) != 1 or box[goal] != (None, None) or not equations[holding[0]].equality:
        return None
    terms = dict(equations[holding[0]].expression.terms)
    slope = terms.pop((goal,), None)
    if slope is None or any(goal in m for m in terms):
        return None
    return holding[0], Expression(terms) / -slope


def _renamed(expression: Expression, spelling: Mapping[str, str]) -> Expression:
    """Return an expression with the names as they are spelled in the file."""
    return Expression({tuple(sorted(spelling[v] for v in m)): c for m, c in expression.terms.items()})
