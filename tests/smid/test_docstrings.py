"""Every public function and class has a docstring in numpydoc's form, with an example.

Types stand in the signature only: a section of parameters has an entry where there is more to say than name and type.
Pytest runs the examples; the call of a study that takes minutes may be skipped, where the docstring says so.

Public is what a package offers by ``__all__``. A class that a public function returns is shown by that function's
example, a protocol by what fits it.
"""

import ast
import dataclasses
import enum
import importlib
import inspect
import pkgutil
import re
import textwrap
from pathlib import Path

import pytest

import relaxations
import smid

API = Path(__file__).parents[2] / "docs" / "api.md"
HEADINGS = ["Parameters", "Attributes", "Returns", "Yields", "Raises", "Warns", "Examples", "References", "Notes"]
SECTION = re.compile(rf"^({'|'.join(HEADINGS)})\n-+\n", re.MULTILINE)


def packages():
    """Return the names of all packages, and of the modules that offer names without one."""
    yield from ("smid", "relaxations.errors")
    for package in (smid, relaxations):
        for info in pkgutil.walk_packages(package.__path__, f"{package.__name__}."):
            if info.ispkg:
                yield info.name


def offered():
    """Return the public functions and classes by their full names, each once."""
    found = {}
    for package in packages():
        module = importlib.import_module(package)
        for name in getattr(module, "__all__", ()):
            found[f"{package}.{name}"] = getattr(module, name)
    once = {id(item): (name, item) for name, item in found.items() if inspect.isfunction(item) or inspect.isclass(item)}
    return dict(sorted(once.values()))


OFFERED = offered()


def sections(item):
    """Return the summary under the empty heading, and the text of each section under its own."""
    pieces = SECTION.split(inspect.getdoc(item) or "")
    return {"": pieces[0].strip(), **dict(zip(pieces[1::2], pieces[2::2], strict=True))}


def heads(text):
    """Return the first lines of the entries of a section."""
    return [line for line in text.splitlines() if line and not line.startswith(" ")]


def listed(text):
    """Return the names that a section of parameters describes."""
    return {name.strip().lstrip("*") for head in heads(text) for name in head.split(",")}


def raised(function):
    """Return the errors that a function raises itself, by name."""
    tree = ast.parse(textwrap.dedent(inspect.getsource(function)))
    calls = [node.exc.func for node in ast.walk(tree) if isinstance(node, ast.Raise) and isinstance(node.exc, ast.Call)]
    return {call.id for call in calls if isinstance(call, ast.Name) and call.id.endswith("Error")}


def shown_by():
    """Return the names of classes that public functions with an example return."""
    functions = [item for item in OFFERED.values() if inspect.isfunction(item) and example(item)]
    texts = [str(inspect.signature(function).return_annotation) for function in functions]
    return {word for text in texts for word in re.findall(r"\w+", text)}


def example(item):
    """Tell whether a docstring has an example."""
    return ">>> " in sections(item).get("Examples", "")


SHOWN = shown_by()


def fields(item):
    """Return the arguments that a caller gives; none for what is not made by calling it."""
    if inspect.isclass(item) and (issubclass(item, enum.Enum | BaseException) or getattr(item, "_is_protocol", False)):
        return set()
    computed = {field.name for field in dataclasses.fields(item)} if dataclasses.is_dataclass(item) else set()
    return set(inspect.signature(item).parameters) | computed


def missing(item):
    """Return what a docstring lacks, in words."""
    has = sections(item)
    lacks = [] if has[""] else ["a summary"]
    described = has.get("Parameters", "")
    lacks += [f"the parameter {name}, which is described" for name in sorted(listed(described) - fields(item))]
    lacks += [f"a type in the signature only: {head}" for head in heads(described) if " :" in head]
    if inspect.isfunction(item):
        lacks += [f"{name} under Raises" for name in sorted(raised(item)) if name not in has.get("Raises", "")]
    elif item.__name__ in SHOWN or getattr(item, "_is_protocol", False):
        return lacks
    return lacks if example(item) else [*lacks, "an example"]


@pytest.mark.parametrize("name", OFFERED)
def test_docstring_is_complete(name):
    assert missing(OFFERED[name]) == []


def test_an_example_that_is_skipped_says_so():
    examples = {name: sections(item).get("Examples", "") for name, item in OFFERED.items()}
    skipped = [name for name, text in examples.items() if "+SKIP" in text]
    assert [name for name in skipped if "and is not run here" not in examples[name]] == []


def test_every_package_and_module_is_in_the_reference():
    listed = re.findall(r"^   ((?:smid|relaxations)[\w.]*)$", API.read_text(encoding="utf-8"), flags=re.MULTILINE)
    assert {name.rpartition(".")[0] for name in OFFERED} - set(listed) == set()


@pytest.mark.parametrize("name", [name for name, item in OFFERED.items() if inspect.isclass(item)])
def test_methods_have_a_summary(name):
    own = {k: getattr(v, "__func__", v) for k, v in vars(OFFERED[name]).items() if not k.startswith("_")}
    methods = {k: v for k, v in own.items() if inspect.isfunction(v) or isinstance(v, property)}
    assert [k for k, v in methods.items() if not inspect.getdoc(v)] == []
