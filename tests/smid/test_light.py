"""``import smid`` and the command line load heavy libraries only when they are needed."""

import subprocess
import sys

import click
import pytest

from smid.cli.app import main
from smid.theses.commands import clutch, hybrid

HEAVY = ("cvxpy", "jinja2", "matplotlib", "pandas")


def loaded(code):
    """Run code in a fresh interpreter, and return the names of the modules that it loaded."""
    script = f"import sys\n{code}\nprint('LOADED', *sys.modules)"
    run = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    return set(run.stdout.rpartition("LOADED")[2].split())


def command_line(line):
    """Return code that runs a command line of smid."""
    words = line.split()
    return f"from smid.cli import main\ntry:\n    main({words!r})\nexcept SystemExit:\n    pass"


def test_import_loads_no_library():
    assert loaded("import smid") & {*HEAVY, "numpy", "scipy", "sympy"} == set()


def test_public_names_load_neither_figures_nor_pages():
    names = "[getattr(smid, name) for name in smid.__all__ if name not in ('report', 'reports')]"
    assert loaded(f"import smid\n{names}") & set(HEAVY) == set()


def test_the_help_page_loads_neither_numpy_nor_sympy():
    assert loaded(command_line("--help")) & {*HEAVY, "numpy", "scipy", "sympy"} == set()


def test_the_help_of_no_command_loads_figures():
    helps = "\n".join(command_line(f"{name} --help") for name in main.targets if name not in ("clutch", "hybrid"))
    assert loaded(helps) & set(HEAVY) == set()


@pytest.mark.parametrize(
    ("group", "name"), [(g, n) for g in (main, clutch, hybrid) for n, (_, line) in g.targets.items() if line]
)
def test_the_line_of_a_command_is_the_first_sentence_of_its_help(group, name):
    command = group.get_command(click.Context(group), name)
    assert group.targets[name][1] == " ".join(command.help.partition("\n\n")[0].split())
