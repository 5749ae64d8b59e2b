"""Pages of docs/ and the README: Python blocks and commands run and print what the text block below shows, TOML loads.

A TOML block that begins with the name of a file is that file for the commands below it.
"""

import contextlib
import doctest
import io
import re
import shlex
import subprocess
import sys
import tomllib
from pathlib import Path
from pkgutil import resolve_name

import click
import pytest
from click.testing import CliRunner

from smid.cli import main
from smid.models import ModelError, load_model, model_from_mapping
from smid.models.file import MODEL_CLASSES, fields_of_class

ROOT = Path(__file__).parents[2]
FILES = sorted([*(ROOT / "docs").glob("*.md"), *(ROOT / "docs" / "tasks").glob("*.md")])
PAGES = {page.stem: page.read_text(encoding="utf-8") for page in FILES}
README = (ROOT / "README.md").read_text(encoding="utf-8")
BLOCK = re.compile(r"^```(\w+)\n(.*?)^```$", flags=re.MULTILINE | re.DOTALL)


LINK = re.compile(r"\]\(([^)#\s:]+)(?:#[^)]*)?\)")


def blocks(text, *languages):
    """Return language and text of a page's blocks in these languages."""
    return [found.groups() for found in BLOCK.finditer(text) if found[1] in languages]


def printed_by(text, names):
    """Return what a Python block prints."""
    with contextlib.redirect_stdout(io.StringIO()) as output:
        exec(compile(text, names["__name__"], "exec"), names)
    return output.getvalue()


def printed_by_commands(lines):
    """Return what commands of smid print on standard output."""
    words = [shlex.split(line) for line in lines.splitlines()]
    assert all(line[0] == "smid" for line in words)
    runs = [CliRunner().invoke(main, line[1:], prog_name="smid") for line in words]
    assert all(run.exit_code in (0, 1) for run in runs), [run.stderr for run in runs]
    return "".join(run.stdout for run in runs)


def same(shown, printed):
    """Return whether a page shows what was printed; ``...`` stands for anything."""
    return doctest.OutputChecker().check_output(shown, printed, doctest.ELLIPSIS | doctest.NORMALIZE_WHITESPACE)


@pytest.fixture
def _folder(tmp_path, monkeypatch):
    """Stand in a folder that has data/ and keeps the files that a page writes."""
    (tmp_path / "data").symlink_to(ROOT / "data")
    monkeypatch.chdir(tmp_path)


def test_links_lead_to_files():
    tops = [ROOT / name for name in ("README.md", "CONTRIBUTING.md", "CHANGELOG.md")]
    pages = [
        *tops,
        *FILES,
        *(ROOT / "notebooks").glob("*.md"),
        *(ROOT / "notebooks").glob("*.py"),
    ]
    links = {(page, link) for page in pages for link in LINK.findall(page.read_text(encoding="utf-8"))}
    assert len(links) > 20
    assert [(page.name, link) for page, link in links if not (page.parent / link).exists()] == []


def test_no_page_has_the_name_of_one_that_sphinx_writes_itself():
    assert not {page.stem for page in (ROOT / "docs").glob("*.md")} & {"genindex", "py-modindex", "search"}


@pytest.mark.usefixtures("_folder")
@pytest.mark.parametrize("page", [name for name, text in PAGES.items() if blocks(text, "python", "sh")])
def test_page_shows_what_is_printed(page):
    names, printed = {"__name__": page}, ""
    for language, text in blocks(PAGES[page], "python", "sh", "toml", "text"):
        if language in ("python", "sh"):
            assert not printed, f"nothing on the page shows what was printed:\n{printed}"
            printed = printed_by(text, names) if language == "python" else printed_by_commands(text)
        elif language == "toml":
            if name := re.match(r"# (\S+\.toml)$", text, flags=re.MULTILINE):
                Path(name[1]).write_text(text, encoding="utf-8")
        else:
            assert same(text, printed), f"the page says\n{text}\nbut this is printed\n{printed}"
            printed = ""
    assert not printed, f"nothing on the page shows what was printed:\n{printed}"


README_BLOCKS = [k for k, (language, _) in enumerate(blocks(README, "python", "text")) if language == "python"]


@pytest.mark.usefixtures("_folder")
@pytest.mark.parametrize("k", README_BLOCKS)
def test_each_python_block_of_the_readme_runs_on_its_own(k):
    found = [*blocks(README, "python", "text"), ("", "")]
    printed = printed_by(found[k][1], {"__name__": "README.md"})
    shown = found[k + 1][1] if found[k + 1][0] == "text" else ""
    assert same(shown, printed), f"the README says\n{shown}\nbut this is printed\n{printed}"


@pytest.mark.parametrize("text", [text for _, text in blocks(PAGES["model-files"], "toml")])
def test_model_files_of_the_page_load(text, tmp_path):
    (tmp_path / "model.toml").write_text(text, encoding="utf-8")
    assert load_model(tmp_path / "model.toml").parameters


def test_mistakes_of_the_page_are_told_as_it_says():
    mistakes = re.findall(r"^\| `(.+?)` \| (.+?) \|$", PAGES["model-files"].split("## Mistakes")[1], flags=re.MULTILINE)
    assert len(mistakes) > 3
    for lines, words in mistakes:
        with pytest.raises(ModelError) as told:
            model_from_mapping(tomllib.loads(lines.replace("; ", "\n")))
        assert words.strip("`") in str(told.value)


def test_every_field_is_on_the_page_under_its_class():
    sections = dict(re.findall(r"^## (\w+)\n(.*?)(?=^## |\Z)", PAGES["model-files"], flags=re.MULTILINE | re.DOTALL))
    shared = {name: re.findall(r"^\| `(\w+)` \|", text, flags=re.MULTILINE) for name, text in sections.items()}
    for name, build in MODEL_CLASSES.items():
        listed = set(shared[name])
        if "priors" in sections[name]:
            listed |= set(shared["Priors"])
        assert listed == set(fields_of_class(build)), name


def test_packages_that_the_docs_name_load_after_import_smid_alone():
    code = "import smid; print(smid.signals.prbs(3, seed=1).shape, smid.design.__name__)"
    shown = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert shown.stdout == "(3,) smid.design\n"


def test_the_coverage_of_the_theses_counts_its_rows_and_names_what_exists():
    counts, *parts = (
        [[cell.strip() for cell in line.strip("|").split("|")] for line in part.splitlines() if line.startswith("| ")]
        for part in PAGES["coverage"].split("\n## ")
    )
    verdicts = counts[0][2:]
    for (_, *count), (_, *rows) in zip(counts[1:], parts, strict=True):
        found = [row[1].partition(": ")[::2] for row in rows]
        assert [int(number) for number in count] == [len(rows), *(sum(f[0] == v for f in found) for v in verdicts)]
        assert [row[0] for row in rows if len(row) != 5] == []
        assert [f for f in found if f[0] not in verdicts or (f[0] == "whole") == bool(f[1])] == []
    for name in set(re.findall(r"`((?:smid|relaxations)[ .][^`]+)`", PAGES["coverage"])):
        program, *words = name.split()
        command = main if words else resolve_name(program)
        for word in words:
            command = command.get_command(click.Context(command), word)
        assert command, name
